//! Triangle surfaces as plain arrays: read, repair, ask, write. Knows nothing of sampling.

mod creases;
mod deforming;
mod error;
mod hierarchy;
mod intersections;
mod read;
mod repair;
mod sums;
mod topology;
mod union_find;
mod write;

pub(crate) use creases::Creased;
pub use deforming::DeformingPart;
pub use error::RepairError;
pub(crate) use hierarchy::closest_on_triangle;
pub use hierarchy::{Closest, Crossing, Hierarchy, winding_number};
pub use intersections::self_intersections;
pub use read::{
    Format, MeshFile, ReadError, ReadErrorKind, TextPlace, parse_mesh, read_mesh, read_point_cloud,
};
pub use repair::{MeshReport, RepairSettings, repair};
pub use sums::{
    boundary_triangles, nodal_boundary_vectors, nodal_volumes, tetrahedra_edges, tetrahedron_volume,
};
pub(crate) use sums::{fit_boundary, rows};
use topology::{SortedSides, boundary_loops, orient};
pub(crate) use union_find::Groups;
pub use write::{Field, ply_mesh, ply_surfels, vtk_points, vtk_tetrahedra};

use glam::DVec3;

/// A triangle surface: corner positions and counter-clockwise triangles seen from outside.
///
/// Nothing is promised about a mesh that was only read; see [`crate::repair()`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Corner positions (length unit of the file).
    pub vertices: Vec<DVec3>,
    /// Corner indices per triangle, each below `vertices.len()`.
    pub triangles: Vec<[u32; 3]>,
}

/// Surface points: positions (m), outward unit normals, areas (m²) that sum to the surface's.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurfaceSamples {
    /// Positions (m).
    pub positions: Vec<DVec3>,
    /// Outward unit normals; none where a file has none.
    pub normals: Vec<DVec3>,
    /// Areas (m²).
    pub areas: Vec<f64>,
}

/// Axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Lower corner.
    pub min: DVec3,
    /// Upper corner.
    pub max: DVec3,
}

impl Bounds {
    /// The box that contains nothing.
    pub const EMPTY: Self = Self {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };

    /// The box between a lower and an upper corner.
    #[must_use]
    pub const fn new(min: DVec3, max: DVec3) -> Self {
        Self { min, max }
    }

    /// Smallest box around the points; [`Bounds::EMPTY`] for none.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        let mut bounds = Self::EMPTY;
        for p in points {
            bounds.include(p);
        }
        bounds
    }

    /// Grows the box to contain `p`.
    pub fn include(&mut self, p: DVec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    /// Its eight corners, x changing fastest.
    #[must_use]
    pub fn corners(&self) -> [DVec3; 8] {
        [0, 1, 2, 3, 4, 5, 6, 7].map(|k| {
            let pick = |axis: usize| {
                let high = k >> axis & 1 == 1;
                if high { self.max[axis] } else { self.min[axis] }
            };
            DVec3::new(pick(0), pick(1), pick(2))
        })
    }

    /// Edge lengths.
    #[must_use]
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Length of the diagonal.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        self.size().length()
    }

    /// Middle of the box.
    #[must_use]
    pub fn center(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// Squared distance from `p` to the box, 0 inside.
    #[must_use]
    pub fn distance_squared(&self, p: DVec3) -> f64 {
        (self.min - p)
            .max(p - self.max)
            .max(DVec3::ZERO)
            .length_squared()
    }
}

impl Mesh {
    /// The corners of one triangle.
    ///
    /// # Panics
    /// If `triangle` or one of its corners is out of range.
    #[must_use]
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// Area vector of one triangle: unit normal times area.
    ///
    /// # Panics
    /// If `triangle` or one of its corners is out of range.
    #[must_use]
    pub fn area_vector(&self, triangle: usize) -> DVec3 {
        area_vector(self.corners(triangle))
    }

    /// Surface area.
    #[must_use]
    pub fn area(&self) -> f64 {
        (0..self.triangles.len())
            .map(|t| self.area_vector(t).length())
            .sum()
    }

    /// Signed volume by the divergence theorem, `V = 1/3 sum_t c_t . n_t A_t` with the triangle's
    /// centroid `c_t`; positive if the triangles look outward. Summed about the box's middle.
    #[must_use]
    pub fn volume(&self) -> f64 {
        let origin = self.bounds().center();
        (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t).map(|p| p - origin);
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    /// Box around the vertices that triangles use.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        Bounds::of(
            self.triangles
                .iter()
                .flatten()
                .map(|&v| self.vertices[v as usize]),
        )
    }

    /// The mesh scaled about the origin.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        for v in &mut self.vertices {
            *v *= factor;
        }
        self
    }
}

/// Half the cross product of two edges: normal times area.
pub(crate) fn area_vector([a, b, c]: [DVec3; 3]) -> DVec3 {
    0.5 * (b - a).cross(c - a)
}

/// Checked narrowing of an index.
///
/// # Panics
/// If the index does not fit 32 bits; the sizes are limited long before.
pub(crate) fn index(i: usize) -> u32 {
    u32::try_from(i).expect("sizes are checked against u32 before")
}

impl Mesh {
    /// The mesh without vertices that no triangle uses.
    #[must_use]
    pub fn compacted(mut self) -> Self {
        let mut number = vec![u32::MAX; self.vertices.len()];
        let mut vertices = Vec::new();
        for v in self.triangles.iter_mut().flatten() {
            let place = &mut number[*v as usize];
            if *place == u32::MAX {
                *place = index(vertices.len());
                vertices.push(self.vertices[*v as usize]);
            }
            *v = *place;
        }
        self.vertices = vertices;
        self
    }
}
