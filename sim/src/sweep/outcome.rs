//! Running one case, and what is left of it.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::case::Case;
use crate::output::{Interrupt, OutputError, OutputFolder};
use crate::run::{RunError, RunOptions, run};

/// What says in a case's folder that it is finished.
const OUTCOME: &str = "outcome.json";
/// Files of a run that a sweep has no use for: a case is run again from its start.
const UNUSED: [&str; 1] = [crate::run::CHECKPOINT];

/// How a case ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Outcome {
    /// Number of the case.
    pub case: usize,
    /// Hash of what was run.
    pub hash: String,
    /// Why it failed; `None` if it came to its end.
    pub error: Option<String>,
}

/// A case of which nothing is known yet: it was not run to an end, good or bad.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CaseError {
    /// Its results cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// It was asked to stop.
    #[error("case {case} was stopped; the same command runs it again")]
    Stopped {
        /// Number of the case.
        case: usize,
    },
}

impl Case {
    /// Folder of the case in that of its sweep.
    #[must_use]
    pub fn folder(&self, sweep: &Path) -> PathBuf {
        sweep.join("cases").join(format!("{:06}", self.number))
    }

    /// How the case ended; `None` if it has not, or if what ended was another scene or version.
    #[must_use]
    pub fn outcome(&self, sweep: &Path) -> Option<Outcome> {
        let text = fs::read(self.folder(sweep).join(OUTCOME)).ok()?;
        let outcome: Outcome = serde_json::from_slice(&text).ok()?;
        (outcome.hash == self.hash).then_some(outcome)
    }

    /// Writes down how the case ended.
    ///
    /// # Errors
    /// [`OutputError`] if it cannot be written.
    pub fn end(&self, sweep: &Path, error: Option<String>) -> Result<Outcome, OutputError> {
        let outcome = Outcome {
            case: self.number,
            hash: self.hash.clone(),
            error,
        };
        let mut text = serde_json::to_vec(&outcome).unwrap_or_default();
        text.push(b'\n');
        OutputFolder::create(&self.folder(sweep))?.write(OUTCOME, &text)?;
        Ok(outcome)
    }
}

/// Runs a case in this process and writes down how it ended. A run that fails is an outcome.
///
/// # Errors
/// [`CaseError`] if it did not come to an end of its own.
pub fn run_case(
    case: &Case,
    sweep: &Path,
    threads: Option<usize>,
    interrupt: &Interrupt,
) -> Result<Outcome, CaseError> {
    let out = case.folder(sweep);
    // Held before the outcome goes, so that no one else is about to write it.
    let folder = OutputFolder::claim(&out)?;
    folder.remove(OUTCOME)?;
    drop(folder);
    let options = RunOptions {
        out: out.clone(),
        threads,
        quiet: true,
        interrupt: Some(interrupt.clone()),
    };
    let error = match run(&case.scene, &options) {
        Ok(_) => None,
        Err(RunError::Output(error)) => return Err(error.into()),
        Err(RunError::Interrupted { .. }) => {
            return Err(CaseError::Stopped { case: case.number });
        }
        // Without the advice to go on from a checkpoint, which would be another scene.
        Err(RunError::Diverged { source, .. }) => Some(source.to_string()),
        Err(error) => Some(error.to_string()),
    };
    let folder = OutputFolder::create(&out)?;
    for name in UNUSED {
        folder.remove(name)?;
    }
    Ok(case.end(sweep, error)?)
}
