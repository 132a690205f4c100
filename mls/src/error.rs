//! What can be wrong with a cloud, a graph or the data on it.

/// A point cloud or a support rule that cannot be searched.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CloudError {
    /// A coordinate is NaN or infinite.
    #[error("point {point} is not finite; remove or repair it before the search")]
    NotFinite {
        /// Index of the point.
        point: usize,
    },
    /// More points than a `u32` can number.
    #[error("{count} points exceed the {limit} that 32-bit indices can number")]
    TooMany {
        /// Number of points given.
        count: usize,
        /// Largest number allowed.
        limit: usize,
    },
    /// No points.
    #[error("no points; give at least one")]
    Empty,
    /// A number of neighbours of zero.
    #[error("zero nearest neighbours asked for; ask for at least one")]
    NoNeighbors,
    /// A radius, scale or spacing that is not positive and finite.
    #[error("{name} is {value}; it must be positive and finite")]
    NotPositive {
        /// Which quantity.
        name: &'static str,
        /// Its value.
        value: f64,
    },
}

/// A graph that is not a CSR neighbourhood.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GraphError {
    /// The offsets do not start at 0, decrease, or do not end at the number of indices.
    #[error(
        "offset {value} at position {position} breaks the CSR rule (start 0, never fall, end at the number of indices)"
    )]
    Offsets {
        /// Position in the offsets.
        position: usize,
        /// Value found there.
        value: u32,
    },
    /// The offsets are empty.
    #[error("the offsets are empty; n nodes need n + 1 offsets")]
    Empty,
    /// An index that names no node.
    #[error("node {node} has the neighbour {neighbor}, but there are only {count} nodes")]
    OutOfRange {
        /// Row.
        node: usize,
        /// Entry.
        neighbor: u32,
        /// Number of nodes.
        count: usize,
    },
    /// A node that is its own neighbour.
    #[error("node {node} is listed as its own neighbour; leave self entries out")]
    SelfLoop {
        /// Row.
        node: usize,
    },
    /// A list that does not have one entry per node or pair.
    #[error("{found} {name} given, the graph needs {wanted}")]
    Length {
        /// Which list.
        name: &'static str,
        /// Its length.
        found: usize,
        /// Number of nodes or pairs.
        wanted: usize,
    },
    /// More pairs than a `u32` can number.
    #[error("{count} pairs exceed the range of 32-bit offsets")]
    TooManyPairs {
        /// Number of directed pairs.
        count: usize,
    },
    /// A pair without its counterpart where a symmetric graph is needed.
    #[error(
        "pair ({node}, {neighbor}) has no counterpart ({neighbor}, {node}); symmetrize the neighbourhoods first"
    )]
    NotSymmetric {
        /// Row.
        node: usize,
        /// Entry.
        neighbor: u32,
    },
}

/// Input from which no gradient stencil can be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StencilError {
    /// A position that is NaN or infinite.
    #[error("position of node {node} is not finite")]
    Position {
        /// Index of the node.
        node: usize,
    },
    /// A volume that is not positive and finite.
    #[error("volume of node {node} is {value}; volumes must be positive and finite")]
    Volume {
        /// Index of the node.
        node: usize,
        /// Its volume.
        value: f64,
    },
    /// A boundary area vector that is NaN or infinite.
    #[error("boundary vector of node {node} is not finite")]
    BoundaryVector {
        /// Index of the node.
        node: usize,
    },
    /// A weight that is negative, NaN or infinite.
    #[error("weight of pair {pair} is {value}; weights must be finite and not negative")]
    Weight {
        /// Position of the pair in the CSR indices.
        pair: usize,
        /// Its weight.
        value: f64,
    },
    /// The solve of conservative stencils stopped short.
    #[error(
        "the stencils' solve stopped after {iterations} iterations at a residual of {residual:.1e}; raise iteration_limit, or sample the body with less uneven cells"
    )]
    NotConverged {
        /// Iterations made.
        iterations: usize,
        /// `max_j |Σ_i V_i g_ij − b_j| / max_j |b_j|` reached.
        residual: f64,
    },
    /// The graph is not symmetric, or a list does not fit it.
    #[error(transparent)]
    Graph(#[from] GraphError),
}

/// Input from which no map between world and material can be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// The cloud cannot be searched.
    #[error(transparent)]
    Cloud(#[from] CloudError),
    /// A list of the wrong length.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// A deformation gradient that is NaN or infinite.
    #[error("deformation gradient of node {node} is not finite")]
    DeformationGradient {
        /// Index of the node.
        node: usize,
    },
}

/// A point at which shape functions cannot be formed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A point that is NaN or infinite.
    #[error("the point is not finite")]
    NotFinite,
    /// Fewer supports hold the point than the basis has functions.
    #[error("{found} supports hold the point, the basis needs {needed}; enlarge the support radii")]
    TooFewNeighbors {
        /// Supports that hold the point.
        found: usize,
        /// Number of functions in the basis.
        needed: usize,
    },
    /// The moment matrix is singular to working precision: the nodes do not tell the functions of
    /// the basis apart.
    #[error(
        "the nodes do not determine basis function {function}; enlarge the support radii or lower the order"
    )]
    SingularMoment {
        /// First function that the ones before it already express.
        function: usize,
    },
}
