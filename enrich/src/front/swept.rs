//! Pairs that a blade has passed between.

use glam::DVec3;

use super::step::Surroundings;
use super::{NEAR, Patch, THROUGH};
use crate::bounds::Bounds;
use crate::cuts::Cuts;
use crate::error::CutError;
use crate::graph::Graph;
use crate::index32;
use crate::predicate::segment_crosses_triangle;

/// A pair between whose nodes a blade has passed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct SweptPair {
    /// Its nodes, the lower number first.
    pub(crate) nodes: [u32; 2],
    /// The position (m) on the line between them, in the material, that the blade passed.
    pub(crate) point: DVec3,
}

impl SweptPair {
    /// Whether the cut does not cross it in the material, with rest positions X (m), shape `(n)`, of nodes that lie
    /// `spacing` (m) apart.
    ///
    /// Pairs that the blade passed beside the cut's surface, within half a spacing and not beyond its edge,
    /// are left out: there it is the cut that says on which side a node lies. To sever those pairs too would
    /// part the node from both sides, as a blade that passes it on the left and a sheet that passes it on
    /// the right would have it.
    pub(crate) fn is_missed(&self, rest: &[DVec3], cuts: &Cuts, spacing: f64) -> bool {
        let [a, b] = self.nodes.map(|node| rest[node as usize]);
        let beside = || {
            let sheet = cuts.nearest(self.point, NEAR * spacing);
            let hair = 1e-6 * spacing;
            sheet.is_some_and(|(sheet, _)| cuts.edges.nearest_free(sheet, hair).is_none())
        };
        !cuts.crosses(a, b) && !beside()
    }
}

/// Pairs whose nodes, where they are now, have some of the triangles between them that a blade swept
/// through the world.
///
/// Exact, by the crate's tie rule. All pairs near the box around the triangles are looked at, however
/// long they have become.
///
/// # Arguments
/// * `present` -- the body's graph with positions x (m) instead of rest positions.
/// * `rest` -- rest positions X (m), shape `(n)`.
/// * `sweep` -- triangles in the world (m).
/// * `known` -- whether a directed pair is known to be crossed by the cut, and need not be looked at.
///
/// # Panics
/// If there is not one rest position per node.
pub(crate) fn swept_pairs(
    present: &Graph<'_>,
    rest: &[DVec3],
    sweep: &[[DVec3; 3]],
    known: &dyn Fn(usize) -> bool,
) -> Vec<SweptPair> {
    let n = present.positions.len();
    assert_eq!(rest.len(), n, "one rest position per node");
    let boxes: Vec<Bounds> = sweep.iter().map(|corners| Bounds::of(corners)).collect();
    let corners: Vec<DVec3> = sweep.iter().flatten().copied().collect();
    let mut found = Vec::new();
    if corners.is_empty() {
        return found;
    }
    // Both ends of a pair that misses the box on one side lie beyond that side.
    let whole = Bounds::of(&corners);
    let beyond: Vec<u8> = (present.positions.iter())
        .map(|x| sides_beyond(&whole, *x))
        .collect();
    for i in 0..rest.len() {
        let a = present.positions[i];
        let row = &present.indices[present.pairs(i)];
        if row.iter().all(|&j| beyond[i] & beyond[j as usize] != 0) {
            continue;
        }
        for pair in present.pairs(i) {
            let j = present.indices[pair] as usize;
            if beyond[i] & beyond[j] != 0 || j < i || known(pair) {
                continue;
            }
            let b = present.positions[j];
            let bounds = Bounds::of(&[a, b]);
            let passed = sweep.iter().zip(&boxes).find(|&(&[p, q, r], near)| {
                bounds.meets(near) && segment_crosses_triangle(a, b, p, q, r)
            });
            let Some((&[p, q, r], _)) = passed else {
                continue;
            };
            let normal = (q - p).cross(r - p);
            let share = share_to_zero(normal.dot(a - p), normal.dot(b - p));
            found.push(SweptPair {
                nodes: [index32(i), index32(j)],
                point: rest[i].lerp(rest[j], share),
            });
        }
    }
    found
}

/// Fraction of the distance from one value to another at which their line is zero; a half if it is nowhere.
fn share_to_zero(from: f64, to: f64) -> f64 {
    let fall = from - to;
    if fall.abs() > 0.0 {
        (from / fall).clamp(0.0, 1.0)
    } else {
        0.5
    }
}

/// A bit for each side of a box that a point lies beyond.
fn sides_beyond(bounds: &Bounds, x: DVec3) -> u8 {
    let low = x.cmplt(bounds.low).bitmask();
    let high = x.cmpgt(bounds.high).bitmask();
    #[allow(clippy::cast_possible_truncation, reason = "three bits each")]
    let sides = (low | high << 3) as u8;
    sides
}

/// Carries the nearest free edge of a cut on through a material point (m), by one triangle.
///
/// # Returns
/// What was added; empty if no edge lies within two spacings.
///
/// # Errors
/// [`CutError::NotFinite`]; the cut is then unchanged.
pub(crate) fn close_edge(
    cuts: &mut Cuts,
    point: DVec3,
    spacing: f64,
    inside: &dyn Fn(DVec3) -> bool,
) -> Result<Patch, CutError> {
    let Some(([p, q], from)) = cuts.edges.nearest_free(point, 2.0 * spacing) else {
        return Ok(Patch::default());
    };
    let way = (point - from).normalize_or_zero();
    let reach = THROUGH * spacing;
    let around = Surroundings { cuts, inside };
    let beyond = around.beyond(point, way, reach, spacing);
    let mut patch = Patch {
        vertices: vec![p, q, beyond.map_or(point + way * reach, |(_, at)| at)],
        triangles: vec![[0, 1, 2]],
    };
    cuts.add_welded(&mut patch.vertices, &patch.triangles, (&[], 0.0))?;
    Ok(patch)
}
