//! What can be wrong with the points of a cut.

use glam::DVec3;

/// A piece of a cut that cannot be taken. The cut is unchanged after it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CutError {
    /// A coordinate is NaN or infinite.
    #[error(
        "blade point {point} has the position {position}, which is not finite; skip this capture"
    )]
    NotFinite {
        /// Place of the point among those given.
        point: usize,
        /// The position as given.
        position: DVec3,
    },
    /// A blade edge is a polyline of at least two points.
    #[error("a blade edge of {found} points spans no surface; give at least 2")]
    TooFewPoints {
        /// Number of points given.
        found: usize,
    },
    /// No stroke of this number was started.
    #[error("stroke {stroke} was never started; {started} strokes were")]
    UnknownStroke {
        /// Number of the stroke asked for.
        stroke: usize,
        /// Number of strokes started so far.
        started: usize,
    },
    /// The stroke has ended already.
    #[error("stroke {stroke} has ended; start another one")]
    StrokeEnded {
        /// Number of the stroke.
        stroke: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex} of {vertices}")]
    VertexOutOfRange {
        /// Place of the triangle among those given.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// Number of vertices given.
        vertices: usize,
    },
}
