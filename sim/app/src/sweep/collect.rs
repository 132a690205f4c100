//! From the folders of cases to tables in that of the sweep.

use crate::output::{OutputError, OutputFolder};

use super::case::Case;
use super::plan::{Plan, PlanError};
use super::tables::{FinishedCase, tables};

/// What was collected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Collected {
    /// Cases of the plan.
    pub cases: usize,
    /// Cases that came to their end.
    pub ended: usize,
    /// Those of them that warn of nothing.
    pub healthy: usize,
    /// Cases that failed.
    pub failed: usize,
}

/// A table that cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CollectError {
    /// A result that no run has.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Nothing has come to an end yet.
    #[error("no case in {folder} is finished; run some first")]
    Nothing {
        /// The sweep's folder.
        folder: String,
    },
}

/// Writes `results.csv` (a row per finished case) and `quantiles.csv` into the sweep's folder. What is written depends on
/// the cases and their results alone.
///
/// # Errors
/// [`CollectError`] if nothing is finished, if no run has a result that the plan asks for, or if a file
/// cannot be written.
pub fn collect(
    plan: &Plan,
    cases: &[Case],
    folder: &OutputFolder,
) -> Result<Collected, CollectError> {
    let finished = cases.iter().filter_map(|case| {
        let outcome = case.outcome(folder.path())?;
        Some(FinishedCase {
            number: case.number,
            values: case.values.clone(),
            error: outcome.error,
            folder: case.folder(folder.path()),
        })
    });
    let finished: Vec<FinishedCase> = finished.collect();
    if finished.is_empty() {
        return Err(CollectError::Nothing {
            folder: folder.path().display().to_string(),
        });
    }
    let found = tables(plan, &finished)?;
    folder.write("results.csv", found.results.as_bytes())?;
    folder.write("quantiles.csv", found.quantiles.as_bytes())?;
    Ok(Collected {
        cases: cases.len(),
        ended: found.ended,
        healthy: found.healthy,
        failed: finished.len() - found.ended,
    })
}
