//! Where results go: an output folder whose files appear whole or not at all, and what people see
//! while they wait.

mod folder;
mod progress;

pub use folder::{OutputError, OutputFile, OutputFolder};
pub use progress::Progress;
