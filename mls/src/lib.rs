#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod basis;
mod boundary;
mod cloud;
mod conservative;
mod deformation;
mod dissertation;
mod error;
mod kernel;
mod map;
mod masses;
mod neighborhoods;
mod parallel;
mod search;
mod shape;
mod stencil;
mod symmetric;
mod weights;

pub use basis::{Basis, Dimension, Order};
pub use boundary::{BoundarySettings, boundary_vectors, triangle_quadrature};
pub use cloud::{Cloud, CloudSettings, Sample, ShapeFunctions, SupportRule};
pub use conservative::{
    ConservativeSettings, ConservativeStencils, SolveReport, StrokeReport, normal_projector,
};
pub use deformation::{deformation_gradient, gradient_sum};
pub use dissertation::{DissertationCloud, dissertation_cloud};
pub use error::{BoundaryError, CloudError, GraphError, MapError, ShapeError, StencilError};
pub use glam;
pub use kernel::{Kernel, Weight};
pub use map::{MapFrame, MapKind, MapSettings, MaterialMap, MaterialPoint, Preimage};
pub use masses::{NodalMasses, dissertation_masses};
pub use neighborhoods::Neighborhoods;
pub use search::{KNearest, NearestSettings, k_nearest, within_radius};
pub use shape::{Approximation, ShapeScratch, sph_value};
pub use stencil::{GradientStencils, StencilMemory, StencilRank, widen_deficient_rows};
pub use symmetric::SymmetricEigen;
pub use weights::{inverse_square_weights, kernel_weights, mean_neighbor_distance};
