//! What a run writes and reads beside its tables: folders whose files are whole or not there, checkpoints, what tools and
//! blades did; progress and interrupts.

mod checkpoint;
mod folder;
mod input;
mod interrupt;
mod progress;

pub(crate) use checkpoint::write_checkpoint;
pub use checkpoint::{CHECKPOINT_MAGIC, CheckpointError, CheckpointFault, read_checkpoint};
pub use folder::{OutputError, OutputFolder};
pub(crate) use input::input_csv;
pub use input::{InputFileError, read_input};
pub use interrupt::Interrupt;
pub(crate) use progress::Progress;
