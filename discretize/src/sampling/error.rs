//! Why a body cannot be sampled.

use glam::DVec3;

/// Why a body cannot be sampled as asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// The spacing is not a positive number.
    #[error("spacing {spacing} is not a positive finite number")]
    Spacing {
        /// The spacing asked for.
        spacing: f64,
    },
    /// The grading is out of range.
    #[error(
        "grading with coarsest {coarsest} and growth {growth}: coarsest must lie in 1 to 32, growth \
         must be finite and not negative"
    )]
    Grading {
        /// Largest spacing inside over that at the surface.
        coarsest: f64,
        /// Growth per distance.
        growth: f64,
    },
    /// A refined region is out of range.
    #[error(
        "refinement {refinement} with factor {factor} and radius {radius}: the factor must lie in \
         1/32 to 1, the radius must not be negative, its ends must be finite"
    )]
    Refinement {
        /// Which one, from 0.
        refinement: usize,
        /// Its factor.
        factor: f64,
        /// Its radius.
        radius: f64,
    },
    /// A regular lattice without a cell, or too large.
    #[error(
        "a lattice of {} x {} x {} nodes: give two or more along each axis and at most {limit:.0e} in all",
        counts[0], counts[1], counts[2]
    )]
    Lattice {
        /// Nodes along x, y and z.
        counts: [u32; 3],
        /// Most nodes.
        limit: f64,
    },
    /// Too few nodes asked for to make tetrahedra.
    #[error("{nodes} nodes are too few: ask for at least {least}")]
    TooFewNodes {
        /// Nodes asked for.
        nodes: usize,
        /// The least accepted.
        least: usize,
    },
    /// The lattice for this spacing is larger than the limit.
    #[error(
        "spacing {spacing:.4e} needs {cells:.3e} lattice cells, the limit is {limit:.3e}: \
         use {advice:.4e} or more"
    )]
    TooFine {
        /// The spacing.
        spacing: f64,
        /// Cells it needs.
        cells: f64,
        /// Most cells allowed.
        limit: f64,
        /// A spacing that fits.
        advice: f64,
    },
    /// The body is so slender that no lattice within the limit resolves it.
    #[error(
        "the body fills {share:.1e} of its box, whose sides are {size_x:.4e}, {size_y:.4e} and \
         {size_z:.4e}; lattice cells as small as it is thick ({thickness:.4e}) are {cells:.1e}, and the \
         limit is {limit:.1e}: look for stray vertices or spikes, the farthest point is \
         ({far_x:.4e}, {far_y:.4e}, {far_z:.4e}), or divide the body",
        size_x = size.x, size_y = size.y, size_z = size.z, far_x = far.x, far_y = far.y,
        far_z = far.z
    )]
    Slender {
        /// Volume over that of the box.
        share: f64,
        /// Sides of the box.
        size: DVec3,
        /// Mean thickness `2 V / A`.
        thickness: f64,
        /// Cells of that size in the box.
        cells: f64,
        /// Most cells allowed.
        limit: f64,
        /// Point of the surface farthest from its middle.
        far: DVec3,
    },
    /// The body fell between the lattice points.
    #[error(
        "the body is too thin for the spacing {spacing:.4e}, at which most of it is lost: \
         use {advice:.4e} or less (about {nodes:.1e} nodes)"
    )]
    Vanished {
        /// The spacing.
        spacing: f64,
        /// A spacing that has a chance.
        advice: f64,
        /// About how many nodes that is.
        nodes: f64,
    },
    /// Whole parts of the body fell between the lattice points.
    #[error(
        "{parts} of {of} parts vanish at spacing {spacing:.4e}, the first near \
         ({near_x:.4e}, {near_y:.4e}, {near_z:.4e}): use {advice:.4e} or less (about {nodes:.1e} nodes), \
         or remove the part",
        near_x = near.x, near_y = near.y, near_z = near.z
    )]
    LostParts {
        /// Parts without a node.
        parts: usize,
        /// Parts of the input.
        of: usize,
        /// The spacing.
        spacing: f64,
        /// A point of the first lost part.
        near: DVec3,
        /// A spacing that has a chance.
        advice: f64,
        /// About how many nodes that is.
        nodes: f64,
    },
    /// The function is NaN somewhere.
    #[error("the shape's function is not a number at ({}, {}, {})", at.x, at.y, at.z)]
    NotANumber {
        /// Where.
        at: DVec3,
    },
    /// The shape reaches beyond the bounds given with it.
    #[error("the shape is not inside its bounds: its function is negative at ({}, {}, {})", at.x, at.y, at.z)]
    OutsideBounds {
        /// A point inside the shape and on or beyond the bounds.
        at: DVec3,
    },
    /// The wanted node count cannot be met.
    #[error("{wanted} nodes wanted, the nearest sampling has {reached}: ask for {reached}")]
    NodeCount {
        /// Nodes asked for.
        wanted: usize,
        /// Nodes of the nearest sampling found.
        reached: usize,
    },
}
