//! What the pair factors ask of a cut, in the plane and in space.

use glam::DVec3;

use crate::index::Bounds;

/// Where the shortest way between two points passes an edge of a cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiffractionPoint {
    /// Point of the edge with the shortest way from `a` over it to `b` (m).
    pub point: DVec3,
    /// Unit vector away from the cut.
    pub outward: DVec3,
}

/// A cut as a set of pieces: segments in the plane ([`PlanarCuts`](crate::PlanarCuts)) or triangles
/// in space ([`Cuts`](crate::Cuts)).
///
/// Pieces are numbered in the order of their arrival and never change or go.
pub trait Obstacle: Sync {
    /// Number of pieces.
    fn piece_count(&self) -> usize;

    /// Box round one piece.
    ///
    /// # Panics
    /// If there is no such piece.
    fn piece_bounds(&self, piece: usize) -> Bounds;

    /// Whether the segment `ab` crosses one piece; exact, see the crate's tie rule.
    ///
    /// # Panics
    /// If there is no such piece.
    fn piece_crosses(&self, piece: usize, a: DVec3, b: DVec3) -> bool;

    /// Whether the segment `ab` crosses any piece.
    fn crosses(&self, a: DVec3, b: DVec3) -> bool;

    /// Number of pieces that the segment `ab` crosses.
    fn crossings(&self, a: DVec3, b: DVec3) -> usize;

    /// Numbers of the edges (in the plane: points) that a way may pass round and that may meet
    /// the box, sorted, each once; replaces what `out` held.
    ///
    /// # Returns
    /// Whether the cut may end in the box: false only if an even number of pieces meets at each of its
    /// edges there.
    fn diffraction_edges_into(&self, near: &Bounds, out: &mut Vec<u32>) -> bool;

    /// The shortest way over one of these edges.
    ///
    /// # Panics
    /// If there is no such edge.
    fn diffraction_point(&self, edge: u32, a: DVec3, b: DVec3) -> DiffractionPoint;

    /// Numbers of the pieces that may meet the box, sorted, each once; replaces what `out` held.
    fn pieces_into(&self, near: &Bounds, out: &mut Vec<u32>);

    /// Where the segment `ab` meets a piece that it crosses (m).
    ///
    /// # Panics
    /// If there is no such piece.
    fn meeting_point(&self, piece: usize, a: DVec3, b: DVec3) -> DVec3;

    /// Distance of a point to one of the edges that a way may pass round (m).
    ///
    /// # Panics
    /// If there is no such edge.
    fn edge_distance(&self, edge: u32, point: DVec3) -> f64;
}

/// Orders points by x, then y, then z; what depends on it does not depend on the order of arrival.
pub(crate) fn before(a: DVec3, b: DVec3) -> bool {
    (a.x, a.y, a.z) < (b.x, b.y, b.z)
}

/// Below this length the sum of the unit directions into the cut counts as zero: the edge is flat.
///
/// Two faces that meet at less than 2.9 degrees from straight.
const FLAT: f64 = 0.05;

/// The faces at a flat edge reach so far from it (in cells of the index, so about in influence radii);
/// where they reach less far, the edge must be straighter in the same proportion. A smooth sheet that
/// comes in small pieces has such edges this way, if its radius is below `FACE / FLAT`, 2.5 cells: round a
/// larger one, ways that leave them out are too short by less than 0.7 % of the influence radius.
const FACE: f64 = 0.125;

/// Unit vector out of the cut from the directions into it, zero if the edge is flat.
///
/// The sum runs in the order of the points, so that it has the same bits for any order of arrival.
///
/// # Arguments
/// * `inward` -- per piece at the edge a point of it to sort by, and the vector (m) from the edge to its
///   far end.
/// * `cell` -- cell of the index (m).
pub(crate) fn outward(inward: &mut [(DVec3, DVec3)], cell: f64) -> DVec3 {
    inward.sort_by(|(a, _), (b, _)| {
        let order = |a: f64, b: f64| a.total_cmp(&b);
        order(a.x, b.x).then(order(a.y, b.y)).then(order(a.z, b.z))
    });
    let (mut sum, mut farthest) = (DVec3::ZERO, 0.0_f64);
    for (_, vector) in &*inward {
        sum += vector.normalize_or_zero();
        farthest = farthest.max(vector.length());
    }
    if sum.length() < FLAT * (farthest / (FACE * cell)).min(1.0) {
        DVec3::ZERO
    } else {
        -sum.normalize_or_zero()
    }
}

/// Converts a count to an index of 32 bits.
///
/// # Panics
/// If there are 2³² of them or more.
pub(crate) fn index32(count: usize) -> u32 {
    u32::try_from(count).expect("fewer than 2^32 pieces, nodes and pairs")
}

/// Share of the way from one value to another at which their line is zero; a half if it is nowhere.
pub(crate) fn share_to_zero(from: f64, to: f64) -> f64 {
    let fall = from - to;
    if fall.abs() > 0.0 {
        (from / fall).clamp(0.0, 1.0)
    } else {
        0.5
    }
}
