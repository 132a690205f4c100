//! What can be wrong with a graph and with the points of a cut.

use glam::DVec3;

/// A graph that is not one of symmetric, sorted rows.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GraphError {
    /// Not one row per node.
    #[error("{found} offsets for {nodes} nodes; n nodes need n + 1")]
    OffsetCount {
        /// Number of offsets.
        found: usize,
        /// Number of nodes.
        nodes: usize,
    },
    /// The offsets do not start at 0, fall, or do not end at the number of indices.
    #[error(
        "offset {value} at position {position} breaks the rule: start at 0, never fall, end at the number of indices"
    )]
    Offset {
        /// Position in the offsets.
        position: usize,
        /// Value found there.
        value: u32,
    },
    /// A coordinate is NaN or infinite.
    #[error("position of node {node} is not finite")]
    NotFinite {
        /// The node.
        node: usize,
    },
    /// A row names the node itself, a node that is not there, one twice or out of order.
    #[error(
        "row of node {node} must name other nodes in ascending order, each once; found {neighbor}"
    )]
    Row {
        /// Row's node.
        node: usize,
        /// Entry out of order.
        neighbor: u32,
    },
    /// A pair without its opposite.
    #[error("pair ({node}, {neighbor}) has no ({neighbor}, {node}); make the graph symmetric")]
    OneWay {
        /// Row's node.
        node: usize,
        /// Entry.
        neighbor: u32,
    },
    /// More pairs than a `u32` can number.
    #[error("{count} pairs exceed the range of 32-bit offsets")]
    TooManyPairs {
        /// Number of directed pairs.
        count: usize,
    },
}

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
