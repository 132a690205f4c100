//! What a run writes and reads beside its tables: folders whose files are whole or not there, checkpoints, what tools and
//! blades did; progress and interrupts.

mod checkpoint;
mod folder;
mod input;
mod interrupt;
mod progress;

pub use checkpoint::{CheckpointError, CheckpointFault, read_checkpoint, write_checkpoint};
pub use folder::{OutputError, OutputFolder};
pub use input::{InputFileError, input_csv, read_input};
pub use interrupt::Interrupt;
pub use progress::Progress;
