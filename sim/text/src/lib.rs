#![doc = include_str!("../README.md")]

mod check;
mod error;
mod file;
mod format;
mod key_path;
mod keys;
mod kind;
mod locate;
mod misread;
mod overrides;
mod read;
mod suggest;

pub use check::{Checks, Fault, triple};
pub use error::{DidYouMean, FormatProblem, OverrideError, OverrideProblem, Place, TextError};
pub use file::{read_file, read_text};
pub use format::{Syntax, options};
pub use key_path::{KeyPath, Segment};
pub use keys::{KeyPage, KeyRow};
pub use locate::{Content, Node, byte_at, line_column};
pub use overrides::{Override, overriding, place_of, shortened};
pub use read::{Departure, Departures, parse_ron};
pub use suggest::nearest;
