#![doc = include_str!("../README.md")]

mod conservative;
mod deformation;
mod error;
mod kernel;
mod map;
mod neighborhoods;
mod parallel;
mod search;
mod symmetric;
mod weights;

pub use conservative::{
    ConservativeSettings, ConservativeStencils, SolveReport, StencilRank, StrokeReport,
    normal_projector,
};
pub use deformation::{deformation_gradient, gradient_sum};
pub use error::{CloudError, GraphError, MapError, StencilError};
pub use kernel::Kernel;
pub use map::{MapFrame, MapKind, MapSettings, MaterialMap, MaterialPoint};
pub use neighborhoods::Neighborhoods;
pub use search::{KNearest, NearestSettings, k_nearest, within_radius};
pub use symmetric::SymmetricEigen;
pub use weights::{inverse_square_weights, kernel_weights, mean_neighbor_distance};
