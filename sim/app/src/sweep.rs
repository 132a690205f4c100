//! Many runs of one scene: a plan says what changes from case to case, every case is run by a process of
//! its own, and their results are put into one table.
//!
//! A case is finished when its folder holds an outcome with the case's hash (of the scene as resolved, of
//! the files it names and of the program's version), so that any process that runs cases, in whatever order and on
//! whatever machine, shares nothing but a folder.

use std::path::Path;

mod case;
mod collect;
mod design;
mod plan;
mod pool;
mod statistics;

pub use case::{Case, Outcome, write_cases};
pub use collect::{CollectError, Collected, collect};
pub use plan::{Plan, PlanError};
pub use pool::{PoolError, PoolOptions, Tally, run_cases};

use case::CaseHashes;
use design::cases;
use phyxel_scene::{KeyPath, OverrideError, Place, SceneError, TextError};
use rayon::prelude::*;

use crate::output::{Interrupt, OutputError, OutputFolder};
use crate::run::{RunError, RunOptions, run};
use phyxel::scene::{Scene, Shape};

/// A case with a value that the scene does not take.
#[derive(Debug, thiserror::Error)]
#[error("{place}: case {case}: {source}")]
pub struct RefusedCase {
    /// Where the plan has the value.
    pub place: Place,
    /// Number of the case.
    pub case: usize,
    /// What is wrong with the scene.
    pub source: Box<SceneError>,
}

/// A case of which nothing is known yet: it was not run to an end, good or bad.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CaseError {
    /// Its results cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// It, the case of this number, was asked to stop.
    #[error("case {0} was stopped; the same command runs it again")]
    Stopped(usize),
}

/// Where a plan says what is wrong with its scene: at one of the changes that all cases share, or where it
/// names the scene.
#[must_use]
pub fn place_of(plan: &Plan, error: &SceneError) -> Place {
    plan.place_of_change(match error {
        SceneError::Text(TextError::Override(OverrideError { text, .. })) => text,
        SceneError::Text(TextError::At { place, .. }) => {
            place.origin.strip_prefix("--set ").unwrap_or_default()
        }
        _ => "",
    })
}

/// Every case of a plan; `base` is its scene with the changes that all share.
///
/// # Errors
/// [`RefusedCase`] if a case has a value that the scene does not take.
pub fn all_cases(plan: &Plan, base: &Scene) -> Result<Vec<Case>, RefusedCase> {
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
pub fn one_case(
    plan: &Plan,
    base: &Scene,
    number: usize,
) -> Result<Option<(Case, Scene)>, RefusedCase> {
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
) -> Result<(Case, Scene), RefusedCase> {
    let scene = scene(plan, base, number, &values)?;
    let text = phyxel_scene::to_ron(&scene);
    let hash = hashes.of(env!("CARGO_PKG_VERSION"), &text, files_of(&scene));
    let case = Case {
        number,
        values,
        hash,
    };
    Ok((case, scene))
}

/// The scene of a case.
fn scene(plan: &Plan, base: &str, number: usize, values: &[String]) -> Result<Scene, RefusedCase> {
    let refused = |index: Option<usize>, error: SceneError| RefusedCase {
        place: plan.place_of_key(index),
        case: number,
        source: Box::new(error.without_position()),
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
            SceneError::Text(TextError::Override(OverrideError { text, .. })) => {
                *text == change.to_string()
            }
            SceneError::Text(TextError::At { path, .. }) => {
                KeyPath::parse(path).is_some_and(|path| change.path().contains(&path))
            }
            _ => false,
        });
        refused(index.map(|(index, _)| *index), error)
    })
}

/// Files that a scene is built from.
fn files_of(scene: &Scene) -> impl Iterator<Item = &Path> {
    scene.bodies.iter().flat_map(|body| {
        let surfels = &body.surfels;
        let mesh = match &body.shape {
            Shape::Mesh { file, .. } => Some(file),
            _ => None,
        };
        let images = [&surfels.image, &surfels.cut_image];
        let images = images.into_iter().flatten().map(|image| &image.file);
        let points = surfels.points.as_ref().map(|points| &points.file);
        let files = mesh.into_iter().chain(images).chain(points);
        files.map(|file| &**file)
    })
}

/// Runs a case, whose scene this is, in this process and writes down how it ended. A run that fails is an outcome.
///
/// # Errors
/// [`CaseError`] if it did not come to an end of its own.
pub fn run_case(
    case: &Case,
    scene: &Scene,
    sweep: &Path,
    threads: Option<usize>,
    interrupt: &Interrupt,
) -> Result<Outcome, CaseError> {
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
        Err(RunError::Interrupted { .. }) => {
            return Err(CaseError::Stopped(case.number));
        }
        // Without the advice to resume from a checkpoint, which would be another scene.
        Err(RunError::Diverged { source, .. }) => Some(source.to_string()),
        Err(error) => Some(error.to_string()),
    };
    // A case is run again from its start.
    OutputFolder::create(&out)?.remove(crate::run::CHECKPOINT)?;
    Ok(case.end(sweep, error)?)
}
