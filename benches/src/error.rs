//! Why a study did not end.

use std::error::Error;
use std::fmt::Display;
use std::path::Path;

/// What a scene, a world, a body, a file or the terminal says of itself. A scene that does not end is a row, not an error.
pub type StudyError = Box<dyn Error + Send + Sync>;

/// Names the file or folder that a problem is of.
pub(crate) fn of_file<E: Display>(path: &Path) -> impl Fn(E) -> StudyError {
    let path = path.display().to_string();
    move |problem| format!("{path}: {problem}").into()
}

/// A linear system that was not solved.
pub(crate) fn not_solved(residual: f64) -> StudyError {
    format!("a study's linear system stopped at a relative residual of {residual:e}").into()
}
