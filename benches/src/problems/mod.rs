//! Problems whose answer is known, by a closed form or by finite elements: bodies, loads, references.
//!
//! Studies tabulate errors on them, proofs assert bounds.

use glam::DVec3;

pub mod block;
pub mod cantilever;
pub mod cracks;
pub mod elements;
pub mod indentation;
pub mod lanes;
pub mod model;
pub mod opening;
pub mod reference;
pub mod solid;

/// The node nearest to a point (m) of those whose place at rest passes a test.
pub(crate) fn nearest(rest: &[DVec3], at: DVec3, passes: impl Fn(DVec3) -> bool) -> Option<usize> {
    let far = |i: usize| rest[i].distance_squared(at);
    let nodes = (0..rest.len()).filter(|&i| passes(rest[i]));
    nodes.min_by(|&i, &j| far(i).total_cmp(&far(j)))
}
