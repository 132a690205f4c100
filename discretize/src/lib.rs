#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod mesh;
mod sampling;

pub use glam;
pub use mesh::*;
pub use sampling::*;
