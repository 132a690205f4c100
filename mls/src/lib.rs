#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod basis;
mod cloud;
mod conservative;
mod dissertation;
mod error;
mod kernel;
mod map;
mod neighborhoods;
mod parallel;
mod search;
mod shape;
mod stencil;
mod symmetric;
mod weights;

pub use basis::{Basis, Dimension, Order};
pub use cloud::{Cloud, CloudSettings, Sample};
pub use conservative::ConservativeSettings;
pub use dissertation::{DissertationCloud, NodalMasses, dissertation_cloud};
pub use error::{CloudError, GraphError, MapError, ShapeError, StencilError};
pub use glam;
pub use kernel::{kernel, kernel_slope};
pub use map::{MapFrame, MaterialMap, Preimage};
pub use neighborhoods::Neighborhoods;
pub use search::{KNearest, NearestSettings, k_nearest, within_radius};
pub use shape::{Approximation, ShapeScratch};
pub use stencil::{GradientStencils, SolveReport, StencilRank, widen_deficient_rows};
pub use weights::{
    inverse_square_weights, kernel_weights, mean_neighbor_distance, mean_pair_length,
};
