#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod background;
mod checks;
mod counts;
mod creases;
mod error;
mod file;
mod fill;
mod frame;
mod graded;
mod grading;
mod grid;
mod hierarchy;
mod improve;
mod intersections;
mod lattice;
mod liver;
mod losses;
mod measures;
mod mesh;
mod octree;
mod oracle;
mod order;
mod patch;
#[cfg(feature = "serde")]
pub mod path_text;
mod points;
mod quality;
mod read;
mod regular;
mod repair;
mod sampling;
mod settings;
mod shape;
mod slimness;
mod solid;
mod spread;
mod stencil;
mod stuffing;
mod sums;
mod surface_areas;
mod surfels;
mod topology;
mod union_find;
mod write;

pub use checks::BadSetting;
pub use error::{RepairError, SampleError};
pub use file::{FileError, SampledFile, sample_file};
pub use glam;
pub use grading::{Grading, Refinement};
pub use hierarchy::{Closest, Crossing, Hierarchy, winding_number};
pub use intersections::self_intersections;
pub use mesh::{Bounds, Mesh};
pub use octree::{Leaf, Octree};
pub use order::{NodeOrder, layered_order, space_filling_order};
pub use points::{PointReport, PointSampling, estimate_point_nodes, sample_points};
pub use quality::{TetrahedraQuality, tetrahedra_quality};
pub use read::{
    Format, ImagePlace, MeshFile, ReadError, ReadErrorKind, TextPlace, TexturedMesh, parse_mesh,
    read_mesh, read_point_cloud, read_textured_mesh,
};
pub use regular::{lattice_tetrahedra, sample_lattice};
pub use repair::{MeshReport, RepairSettings, repair};
pub use sampling::{
    SampledNodes, SamplingReport, estimate_tetrahedra_nodes, sample_tetrahedra, surface_mesh,
};
pub use settings::{SampleSettings, SampleTarget};
pub use shape::{Axis, Placement, Shape, SolidError, UnitGuess, guess_unit};
pub use solid::{LevelSet, Primitive, Solid};
pub use sums::{
    boundary_triangles, nodal_boundary_vectors, nodal_volumes, tetrahedra_edges, tetrahedron_volume,
};
pub use surface_areas::nodal_surface_areas;
pub use surfels::{SurfaceSamples, sample_surfels};
pub use write::{Field, ply_mesh, ply_surfels, vtk_points, vtk_tetrahedra};
