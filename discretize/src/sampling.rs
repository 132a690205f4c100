//! Bodies and their nodes: from a solid to positions, volumes, boundary vectors, tetrahedra and surfels.

mod background;
mod counts;
mod error;
mod fill;
mod frame;
mod graded;
mod grading;
mod improve;
mod lattice;
mod liver;
mod losses;
mod measures;
mod near;
mod octree;
mod order;
mod patch;
#[cfg(feature = "serde")]
pub mod path_text;
mod points;
mod quality;
mod regular;
mod settings;
mod shape;
mod sides;
mod slimness;
mod solid;
mod spread;
mod stencil;
mod stuffing;
mod surface_areas;
mod surfels;
mod tetrahedra;

use background::{BackgroundEdge, BackgroundMesh, Visit};
use counts::{MEAN_EDGE, SHIFT, SURFACE_NODES, model, nodes_at, solve_cell, too_fine};
pub use error::SampleError;
use fill::{Filler, last_jumps};
use frame::Frame;
use graded::Graded;
pub use grading::{Grading, Refinement};
use improve::improve;
use lattice::{Lattice, WARP_LONG, WARP_SHORT};
use liver::liver;
use losses::{check_parts, count_pieces, missed_share};
use measures::{Measures, measures_by_grid};
use near::Near;
use octree::Cell;
pub use octree::{Leaf, Octree};
pub use order::{NodeOrder, layered_order, space_filling_order};
use patch::StuffingPatch;
pub use points::{PointReport, PointSampling, estimate_point_nodes, sample_points};
use quality::faces;
pub use quality::{TetrahedraQuality, tetrahedra_quality};
pub use regular::{lattice_tetrahedra, sample_lattice};
pub use settings::{SampleSettings, SampleTarget};
pub use shape::{Axis, Placement, Shape, SolidError, UnitGuess, guess_unit};
use slimness::Slimness;
pub use solid::{LevelSet, Primitive, Solid};
use spread::boundary_vectors;
use stencil::Stencil;
use stuffing::{Stuffed, stuff};
pub use surface_areas::nodal_surface_areas;
pub use surfels::sample_surfels;
pub use tetrahedra::{
    SampledNodes, SamplingReport, estimate_tetrahedra_nodes, sample_tetrahedra, surface_mesh,
};
use tetrahedra::{finish, surface_triangles};
