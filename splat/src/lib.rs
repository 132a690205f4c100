#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod cast;
mod error;
mod render;
mod tissue;

pub use error::{ImageError, SurfelError};
pub use glam;
pub use render::*;
pub use tissue::*;
