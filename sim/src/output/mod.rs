//! Where results go: an output folder whose files appear whole or not at all, and what people see
//! while they wait.

mod checkpoint;
mod folder;
mod input;
mod interrupt;
mod progress;

pub use checkpoint::{CheckpointError, read_checkpoint, write_checkpoint};
pub use folder::{OutputError, OutputFile, OutputFolder};
pub use input::{InputFileError, input_csv, read_input};
pub use interrupt::Interrupt;
pub use progress::Progress;
