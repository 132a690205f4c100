//! Bodies and their nodes: from a solid to positions, volumes, boundary vectors, tetrahedra and surfels.

mod background;
mod counts;
pub(crate) mod error;
mod fill;
mod frame;
mod graded;
pub(crate) mod grading;
mod improve;
mod lattice;
mod liver;
mod losses;
mod measures;
mod near;
pub(crate) mod octree;
mod oracle;
pub(crate) mod order;
mod patch;
#[cfg(feature = "serde")]
pub mod path_text;
pub(crate) mod points;
pub(crate) mod quality;
pub(crate) mod regular;
pub(crate) mod settings;
pub(crate) mod shape;
mod slimness;
pub(crate) mod solid;
mod spread;
mod stencil;
mod stuffing;
pub(crate) mod surface_areas;
pub(crate) mod surfels;
pub(crate) mod tetrahedra;
