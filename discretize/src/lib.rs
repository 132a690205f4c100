#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod mesh;
mod sampling;

pub use glam;
pub use mesh::deforming::DeformingPart;
pub use mesh::error::RepairError;
pub use mesh::hierarchy::{Closest, Crossing, Hierarchy, winding_number};
pub use mesh::intersections::self_intersections;
pub use mesh::read::{
    Format, MeshFile, ReadError, ReadErrorKind, TextPlace, parse_mesh, read_mesh, read_point_cloud,
};
pub use mesh::repair::{MeshReport, RepairSettings, repair};
pub use mesh::sums::{
    boundary_triangles, nodal_boundary_vectors, nodal_volumes, tetrahedra_edges, tetrahedron_volume,
};
pub use mesh::write::{Field, ply_mesh, ply_surfels, vtk_points, vtk_tetrahedra};
pub use mesh::{Bounds, Mesh, SurfaceSamples};
pub use sampling::error::SampleError;
pub use sampling::grading::{Grading, Refinement};
pub use sampling::octree::{Leaf, Octree};
pub use sampling::order::{NodeOrder, layered_order, space_filling_order};
#[cfg(feature = "serde")]
pub use sampling::path_text;
pub use sampling::points::{PointReport, PointSampling, estimate_point_nodes, sample_points};
pub use sampling::quality::{TetrahedraQuality, tetrahedra_quality};
pub use sampling::regular::{lattice_tetrahedra, sample_lattice};
pub use sampling::settings::{SampleSettings, SampleTarget};
pub use sampling::shape::{Axis, Placement, Shape, SolidError, UnitGuess, guess_unit};
pub use sampling::solid::{LevelSet, Primitive, Solid};
pub use sampling::surface_areas::nodal_surface_areas;
pub use sampling::surfels::sample_surfels;
pub use sampling::tetrahedra::{
    SampledNodes, SamplingReport, estimate_tetrahedra_nodes, sample_tetrahedra, surface_mesh,
};
