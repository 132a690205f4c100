//! Scenes as texts: RON and JSON, overrides, embedded scenes, the page of keys.

mod embedded;
mod error;
mod file;
#[cfg(feature = "schemars")]
mod key_page;
mod key_path;
#[cfg(feature = "schemars")]
mod keys;
mod mesh;
mod overrides;
mod read;
mod tree;
mod values;

#[cfg(test)]
mod tests;

pub use embedded::{EMBEDDED, Embedded};
pub use error::{OverrideError, Place, TextError};
pub use file::{read_file, read_text};
pub use key_path::{KeyPath, Segment};
#[cfg(feature = "schemars")]
pub use keys::{key_reference, schema};
pub use mesh::for_mesh;
pub use overrides::{Override, place_of, shortened};
pub use read::{embedded, from_text, load, read_settings, to_ron};
pub use tree::Syntax;
pub use values::{Raw, parse};
