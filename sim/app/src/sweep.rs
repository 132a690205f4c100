//! Many runs of one scene: a plan says what changes from case to case, every case is run by a process of
//! its own, and their results are put into one table.
//!
//! A case is finished when its folder holds an outcome with the case's hash (of the scene as resolved, of
//! the files it names and of the program's version), so that any process that runs cases, in whatever order and on
//! whatever machine, shares nothing but a folder.

use std::io;
use std::path::{Path, PathBuf};

mod case;
mod collect;
mod design;
mod plan;
mod pool;
mod statistics;

pub(crate) use case::{Case, Outcome, write_cases};
pub(crate) use collect::collect;
pub use plan::{Design, Plan, ResultColumn, SweptKey, Values};
pub(crate) use pool::{PoolOptions, Tally, run_cases};

use case::CaseHashes;
use design::cases;
use phyxel_scene::{KeyPath, OverrideError, Place, TextError};
use rayon::prelude::*;

use crate::output::{Interrupt, OutputError, OutputFolder};
use crate::run::{RunError, RunOptions, run};
use phyxel::scene::Scene;

/// A sweep that cannot be planned, run or collected.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// The plan is not as it must be, or asks for a result that no run has.
    #[error(transparent)]
    Text(#[from] TextError),
    /// A case has a value that the scene does not take.
    #[error("{place}: case {case}: {source}")]
    Refused {
        /// Where the plan has the value.
        place: Place,
        /// Number of the case.
        case: usize,
        /// What is wrong with the scene.
        source: Box<TextError>,
    },
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The case of this number was asked to stop: nothing is known of it.
    #[error("case {0} was stopped; the same command runs it again")]
    CaseStopped(usize),
    /// All were asked to stop, with so many cases that are not finished.
    #[error("stopped with {0} cases left; the same command continues with them")]
    Stopped(usize),
    /// No process can be started.
    #[error("cannot start {}: {source}", program.display())]
    Start {
        /// The program.
        program: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A process ended without an outcome and without fault of its scene.
    #[error("case {case}: {said}")]
    Case {
        /// Number of the case.
        case: usize,
        /// What it said.
        said: String,
    },
    /// Nothing has come to an end yet in this folder.
    #[error("no case in {} is finished; run some first", .0.display())]
    Nothing(PathBuf),
}

/// Where a plan says what is wrong with its scene: at one of the changes that all cases share, or where it
/// names the scene.
pub(crate) fn place_of(plan: &Plan, error: Option<&TextError>) -> Place {
    let change = match error {
        Some(TextError::Override(OverrideError { text, .. })) => text,
        Some(TextError::At { place, .. }) => {
            place.origin.strip_prefix("--set ").unwrap_or_default()
        }
        _ => "",
    };
    let index = plan.set.iter().position(|set| set.to_string() == change);
    let path = index.map_or("scene".to_owned(), |index| format!("set[{index}]"));
    plan.source.place(&path)
}

/// Every case of a plan; `base` is its scene with the changes that all share.
///
/// # Errors
/// [`SweepError::Refused`] if a case has a value that the scene does not take.
pub(crate) fn all_cases(plan: &Plan, base: &Scene) -> Result<Vec<Case>, SweepError> {
    let text = phyxel_scene::to_ron(base);
    let hashes = CaseHashes::default();
    let rows = cases(plan).into_par_iter().enumerate();
    // All of them first: the one that is told is the first that is refused.
    let all: Vec<_> = rows
        .map(|(index, values)| Ok(case(plan, &text, index + 1, values, &hashes)?.0))
        .collect();
    all.into_iter().collect()
}

/// The case of a number alone with its scene, validated; nothing where the plan has fewer.
///
/// # Errors
/// As [`all_cases`].
pub(crate) fn one_case(
    plan: &Plan,
    base: &Scene,
    number: usize,
) -> Result<Option<(Case, Scene)>, SweepError> {
    let index = number.checked_sub(1);
    let values = index.and_then(|index| cases(plan).into_iter().nth(index));
    let base = phyxel_scene::to_ron(base);
    let case = values.map(|values| case(plan, &base, number, values, &CaseHashes::default()));
    case.transpose()
}

fn case(
    plan: &Plan,
    base: &str,
    number: usize,
    values: Vec<String>,
    hashes: &CaseHashes,
) -> Result<(Case, Scene), SweepError> {
    let mut scene = scene(plan, base, number, &values)?;
    let case = Case {
        number,
        values,
        hash: hashes.of(&mut scene),
    };
    Ok((case, scene))
}

/// The scene of a case.
fn scene(plan: &Plan, base: &str, number: usize, values: &[String]) -> Result<Scene, SweepError> {
    let refused = |index: Option<usize>, error: TextError| {
        let keys = index.map_or("keys".to_owned(), |index| format!("keys[{index}].values"));
        SweepError::Refused {
            place: plan.source.place(&keys),
            case: number,
            source: Box::new(error.without_position()),
        }
    };
    let mut changes = Vec::new();
    for (index, (key, value)) in plan.keys.iter().zip(values).enumerate() {
        let parsed = key.overrides(value);
        let parsed = parsed.map_err(|error| refused(Some(index), error.into()))?;
        changes.extend(parsed.into_iter().map(|change| (index, change)));
    }
    let all: Vec<_> = changes.iter().map(|(_, change)| change.clone()).collect();
    phyxel_scene::from_text(base, "the scene", "", &all).map_err(|error| {
        // The key whose change is at fault, if one alone is.
        let index = changes.iter().find(|(_, change)| match &error {
            TextError::Override(OverrideError { text, .. }) => *text == change.to_string(),
            TextError::At { path, .. } => {
                KeyPath::parse(path).is_some_and(|path| change.path().contains(&path))
            }
            _ => false,
        });
        refused(index.map(|(index, _)| *index), error)
    })
}

/// Runs a case, whose scene this is, in this process and writes down how it ended. A run that fails is an outcome.
///
/// # Errors
/// [`SweepError`] if it did not come to an end of its own.
pub(crate) fn run_case(
    case: &Case,
    scene: &Scene,
    sweep: &Path,
    threads: Option<usize>,
    interrupt: &Interrupt,
) -> Result<Outcome, SweepError> {
    case.begin(sweep)?;
    let out = case.folder(sweep);
    let options = RunOptions {
        out: out.clone(),
        threads,
        quiet: true,
        interrupt: Some(interrupt.clone()),
    };
    let error = match run(scene, &options) {
        Ok(_) => None,
        Err(RunError::Output(error)) => return Err(error.into()),
        Err(RunError::Interrupted { .. }) => return Err(SweepError::CaseStopped(case.number)),
        // Without the advice to resume from a checkpoint, which would be another scene.
        Err(RunError::Diverged { source, .. }) => Some(source.to_string()),
        Err(error) => Some(error.to_string()),
    };
    // A case is run again from its start.
    OutputFolder::create(&out)?.remove(crate::run::CHECKPOINT)?;
    Ok(case.end(sweep, error)?)
}
