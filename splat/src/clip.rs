//! Splats clipped at sharp edges: the part of a disk that its anchor cannot see is not drawn.

use crate::surfels::Surfels;
use glam::{DVec2, DVec3};

/// What bounds a disk, in its tangent plane (m, measured from the centre along the tangents of
/// [`Surfels::tangents`]).
///
/// A point of the disk is drawn if it lies beyond none of `edges` and the segment from `anchor` to
/// it crosses none of `walls`: the same visibility that separates nodes across a cut. A wall that
/// ends inside the disk (the front of a growing cut) hides only what lies in its shadow.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Clip {
    /// The point that sees.
    pub anchor: DVec2,
    /// Lines `p · direction = offset` beyond which there is no body: sharp edges, and for new skin
    /// the body's surface.
    pub edges: Vec<(DVec2, f64)>,
    /// Segments that block the view.
    pub walls: Vec<[DVec2; 2]>,
}

impl Clip {
    /// True if `p` lies beyond an edge or the segment from the anchor to `p` crosses a wall.
    #[must_use]
    pub fn hides(&self, p: DVec2) -> bool {
        self.is_beyond_edge(p)
            || self
                .walls
                .iter()
                .any(|&[a, b]| shadows(a - self.anchor, b - self.anchor, p - self.anchor))
    }

    /// True if `p` lies beyond an edge.
    pub(crate) fn is_beyond_edge(&self, p: DVec2) -> bool {
        self.edges
            .iter()
            .any(|&(direction, offset)| p.dot(direction) > offset)
    }
}

/// True if `p` lies in the shadow that the wall a-b throws from the origin.
fn shadows(a: DVec2, b: DVec2, p: DVec2) -> bool {
    let turn = a.perp_dot(b);
    let (a, b) = if turn < 0.0 { (b, a) } else { (a, b) };
    a.perp_dot(p) >= 0.0 && p.perp_dot(b) >= 0.0 && (b - a).perp_dot(p - a) < 0.0
}

/// The segment in which a triangle meets a surfel's tangent plane, in tangent coordinates (m).
pub(crate) fn wall_of_triangle(
    triangle: &[DVec3; 3],
    position: DVec3,
    normal: DVec3,
) -> Option<[DVec2; 2]> {
    let height = triangle.map(|p| (p - position).dot(normal));
    let (t0, t1) = Surfels::tangents(normal);
    let mut ends = [DVec2::ZERO; 2];
    let mut found = 0;
    for k in 0..3 {
        let (a, b) = (height[k], height[(k + 1) % 3]);
        if (a < 0.0) == (b < 0.0) || found == 2 {
            continue;
        }
        let p = triangle[k].lerp(triangle[(k + 1) % 3], a / (a - b)) - position;
        ends[found] = DVec2::new(p.dot(t0), p.dot(t1));
        found += 1;
    }
    (found == 2).then_some(ends)
}

/// A triangle as an obstacle, tested with room for round-off.
pub(crate) struct Screen {
    corner: DVec3,
    /// Unit normal, then the inward unit normals of the three edges in the triangle's plane, each
    /// with the distance of its plane from the corner (m).
    planes: [(DVec3, f64); 4],
    tolerance: f64,
}

impl Screen {
    pub(crate) fn new(&[a, b, c]: &[DVec3; 3]) -> Self {
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let edge = |p: DVec3, q: DVec3| {
            let inward = normal.cross(q - p).normalize_or_zero();
            (inward, inward.dot(p - a))
        };
        Self {
            corner: a,
            planes: [(normal, 0.0), edge(a, b), edge(b, c), edge(c, a)],
            tolerance: 1e-9 * a.distance(b).max(a.distance(c)),
        }
    }

    /// False only if the segment p-q certainly does not meet the triangle: its ends lie on one side
    /// of the plane, or both beyond the same edge.
    pub(crate) fn may_hide(&self, p: DVec3, q: DVec3) -> bool {
        let (p, q) = (p - self.corner, q - self.corner);
        let room = self.tolerance + 1e-12 * (p.length() + q.length());
        let [(normal, _), edges @ ..] = &self.planes;
        let (low, high) = (normal.dot(p), normal.dot(q));
        let apart = low.min(high) > room || low.max(high) < -room;
        !apart
            && edges.iter().all(|(inward, offset)| {
                (inward.dot(p) - offset).max(inward.dot(q) - offset) >= -room
            })
    }
}

/// The point of segment a-b nearest to `p`.
pub(crate) fn nearest_on_segment(a: DVec2, b: DVec2, p: DVec2) -> DVec2 {
    let ab = b - a;
    let length_squared = ab.length_squared();
    if length_squared <= 0.0 {
        return a;
    }
    a + ab * ((p - a).dot(ab) / length_squared).clamp(0.0, 1.0)
}

/// The point of a triangle nearest to `p`.
pub(crate) fn nearest_on_triangle(&[a, b, c]: &[DVec3; 3], p: DVec3) -> DVec3 {
    let normal = (b - a).cross(c - a);
    let squared = normal.length_squared();
    if squared > 0.0 {
        let q = p - normal * ((p - a).dot(normal) / squared);
        let inside = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|&(s, e)| (e - s).cross(q - s).dot(normal) >= 0.0);
        if inside {
            return q;
        }
    }
    let mut best = a;
    for (s, e) in [(a, b), (b, c), (c, a)] {
        let d = e - s;
        let length_squared = d.length_squared();
        let t = if length_squared > 0.0 {
            ((p - s).dot(d) / length_squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let q = s + d * t;
        if q.distance_squared(p) < best.distance_squared(p) {
            best = q;
        }
    }
    best
}
