//! Why a surface cannot be made the boundary of a solid.

use glam::DVec3;

/// Why a surface cannot be made the boundary of a solid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RepairError {
    /// No triangle at all, or none left after the degenerate ones were dropped.
    #[error(
        "the mesh has no usable triangle ({dropped} degenerate or duplicate ones were dropped)"
    )]
    Empty {
        /// Triangles dropped.
        dropped: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not a finite number")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A coordinate is so large or the body so small that its volume leaves the range of numbers.
    #[error("the box diagonal {diagonal:e} is outside 1e-90 to 1e90: change the length unit")]
    Scale {
        /// Diagonal of the bounding box.
        diagonal: f64,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, but there are only {vertex_count}")]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The index it holds.
        vertex: u32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// The surface has a hole that is not small against the body.
    #[error(
        "the surface is open: {holes} hole(s), the largest of perimeter {perimeter:.4e} near \
         ({near_x:.4e}, {near_y:.4e}, {near_z:.4e}); only perimeters up to {limit:.4e} are closed: \
         close it in a mesh editor, or set largest_hole (a fraction of the box's diagonal) to {:.2}",
        (1e2 * share).ceil() / 1e2, near_x = near.x, near_y = near.y, near_z = near.z
    )]
    Open {
        /// Number of holes.
        holes: usize,
        /// Length around the largest.
        perimeter: f64,
        /// A point on its rim.
        near: DVec3,
        /// The longest perimeter that is closed.
        limit: f64,
        /// The longest perimeter found over the box's diagonal.
        share: f64,
    },
    /// Triangles meet so that no consistent inside exists.
    #[error(
        "{edges} edge(s) where more triangles arrive than leave, the first near \
         ({near_x:.4e}, {near_y:.4e}, {near_z:.4e}): the surface bounds no solid there",
        near_x = near.x, near_y = near.y, near_z = near.z
    )]
    Unbalanced {
        /// Number of such edges.
        edges: usize,
        /// Middle of the first.
        near: DVec3,
    },
    /// The surface has one side only, as a Moebius strip or a Klein bottle.
    #[error(
        "the surface has one side only: it comes back to itself turned over near \
         ({near_x:.4e}, {near_y:.4e}, {near_z:.4e}), so it bounds no solid",
        near_x = near.x, near_y = near.y, near_z = near.z
    )]
    OneSided {
        /// Middle of a triangle where both sides meet.
        near: DVec3,
    },
    /// The closed surface contains no volume.
    #[error("the closed surface contains no volume ({volume:e} against an area of {area:e})")]
    NoVolume {
        /// Signed volume.
        volume: f64,
        /// Area.
        area: f64,
    },
}
