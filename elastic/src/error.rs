//! Errors of data handed to the crate.

/// Why a model could not be built or updated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ElasticError {
    /// A list of another length than the others ask for.
    #[error("{found} {what} where {expected} are needed")]
    Length {
        /// Which list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that fits.
        expected: usize,
    },
    /// Row starts that are not such.
    #[error(
        "offset {value} at position {position} breaks the rule: start at 0, never fall, end at the number of pairs"
    )]
    Offset {
        /// Position in the offsets.
        position: usize,
        /// Value found there.
        value: u32,
    },
    /// A number that must be finite is not.
    #[error("{what} of node {node} is not finite")]
    NotFinite {
        /// Which input.
        what: &'static str,
        /// Node that holds it.
        node: usize,
    },
    /// A volume that must be positive is not.
    #[error("volume of node {node} is {volume}; every node needs a positive volume")]
    NonPositiveVolume {
        /// Node that holds it.
        node: usize,
        /// Its value (m³).
        volume: f64,
    },
    /// A row of the graph is not sorted, repeats a neighbour, or names a node that is not there.
    #[error(
        "row of node {node} must list other nodes in ascending order; found {neighbor} out of order"
    )]
    BadRow {
        /// Row's node.
        node: usize,
        /// Offending entry.
        neighbor: usize,
    },
    /// Pair (i, j) has no (j, i), or its weight differs: hourglass stabilization needs symmetric pairs.
    #[error(
        "pair ({node}, {neighbor}) has no equal weight the other way round; make graph and weights \
         symmetric, or both ends touched, or set stabilization to 0"
    )]
    AsymmetricPair {
        /// First node.
        node: usize,
        /// Second node.
        neighbor: usize,
    },
    /// A gradient row does not reproduce linear fields, not even on a plane or a line.
    #[error(
        "gradient row of node {node} misses linear consistency by {residual:.1e}: the sum of g_ij and \
         g_ii must vanish, and that of X_ij g_ij^T be the identity or an orthogonal projector"
    )]
    InconsistentRow {
        /// Row's node.
        node: usize,
        /// Relative size of the sum, or distance of an eigenvalue from 0 and 1.
        residual: f64,
    },
    /// A material parameter out of its range.
    #[error("material {material}: {parameter} is {value}, {allowed}")]
    BadMaterial {
        /// Index in the list of materials.
        material: usize,
        /// Name of the parameter.
        parameter: &'static str,
        /// Its value.
        value: f64,
        /// What would be allowed.
        allowed: &'static str,
    },
    /// A law without a volumetric part of its own cannot take part in mean dilatation.
    #[error(
        "material {material} is Saint Venant-Kirchhoff, which has no separate energy of the volume; \
         choose another law or local dilatation"
    )]
    NoVolumetricPart {
        /// Index in the list of materials.
        material: usize,
    },
    /// A node names a material that is not in the list.
    #[error("node {node} names material {material}, but there are {count}")]
    UnknownMaterial {
        /// Node.
        node: usize,
        /// Index it names.
        material: usize,
        /// Length of the list.
        count: usize,
    },
}
