//! What a run writes and reads beside its tables: checkpoints with their scene, and what tools and blades did. Folders,
//! progress and interrupts are those of `phyxel-output`.

mod checkpoint;
mod input;

pub use checkpoint::{ResumeError, read_checkpoint, write_checkpoint};
pub use input::{InputFileError, input_csv, read_input};
pub use phyxel_output::{Interrupt, OutputError, OutputFile, OutputFolder, Progress};
