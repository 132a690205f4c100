//! Running a scene: from the validated scene to the files of its folder.

use std::path::PathBuf;

use serde::Serialize;

use crate::output::{OutputError, OutputFolder};
use crate::scene::Scene;

/// How a scene is run, beside what it says itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunOptions {
    /// Folder of the results; made where it is not there.
    pub out: PathBuf,
    /// Number of threads; all that the machine has where not given.
    pub threads: Option<usize>,
    /// Whether nothing is shown while the scene runs.
    pub quiet: bool,
}

/// What a run did: the content of `summary.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the scene.
    pub scene: String,
    /// Folder of the results.
    pub out: PathBuf,
}

/// A run that did not end well.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// A result cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Runs `scene` and writes its results.
///
/// # Errors
/// [`RunError`] says what went wrong; the folder then holds no half-written file.
pub fn run(scene: &Scene, options: &RunOptions) -> Result<Summary, RunError> {
    let folder = OutputFolder::create(&options.out)?;
    folder.write("scene.ron", scene.to_ron().as_bytes())?;
    Ok(Summary {
        scene: scene.name.clone(),
        out: options.out.clone(),
    })
}
