#![doc = include_str!("../README.md")]

mod checkpoint;
mod folder;
mod interrupt;
mod progress;

pub use checkpoint::{CheckpointError, read_checkpoint, write_checkpoint};
pub use folder::{OutputError, OutputFile, OutputFolder};
pub use interrupt::Interrupt;
pub use progress::Progress;
