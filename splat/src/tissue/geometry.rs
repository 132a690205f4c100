//! Triangles of a cut against points, segments and tangent planes.

use crate::render::Surfel;
use glam::{DVec2, DVec3};
use rstar::AABB;

/// The box of a triangle (m), grown by a margin (m).
pub(super) fn envelope(&[a, b, c]: &[DVec3; 3], margin: f64) -> AABB<[f64; 3]> {
    let (low, high) = (a.min(b).min(c) - margin, a.max(b).max(c) + margin);
    AABB::from_corners(low.to_array(), high.to_array())
}

/// The segment in which a triangle meets a surfel's tangent plane, in tangent coordinates (m).
pub(super) fn wall_of_triangle(
    triangle: &[DVec3; 3],
    position: DVec3,
    normal: DVec3,
) -> Option<[DVec2; 2]> {
    let height = triangle.map(|p| (p - position).dot(normal));
    let (t0, t1) = Surfel::tangents(normal);
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

/// The line that the plane through `at` across `normal` draws in the tangents of a point `x`: direction, offset from
/// `x` (m), and the sine of the angle between the two planes.
pub(super) fn line_of_plane(
    x: DVec3,
    tangents: (DVec3, DVec3),
    at: DVec3,
    normal: DVec3,
) -> Option<(DVec2, f64, f64)> {
    let flat = DVec2::new(normal.dot(tangents.0), normal.dot(tangents.1));
    let sine = flat.length();
    Some((flat.try_normalize()?, (at - x).dot(normal) / sine, sine))
}

/// A triangle as an obstacle, tested with room for round-off.
pub(super) struct Screen {
    corner: DVec3,
    /// Unit normal, then the inward unit normals of the three edges in the triangle's plane, each
    /// with the distance of its plane from the corner (m).
    planes: [(DVec3, f64); 4],
    tolerance: f64,
}

impl Screen {
    pub(super) fn new(&[a, b, c]: &[DVec3; 3]) -> Self {
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
    pub(super) fn may_hide(&self, p: DVec3, q: DVec3) -> bool {
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

/// The point of segment a-b in the plane nearest to `p`.
pub(super) fn nearest_on_segment(a: DVec2, b: DVec2, p: DVec2) -> DVec2 {
    let ab = b - a;
    let length_squared = ab.length_squared();
    if length_squared <= 0.0 {
        return a;
    }
    a + ab * ((p - a).dot(ab) / length_squared).clamp(0.0, 1.0)
}

/// The point of a triangle nearest to `p`.
pub(super) fn nearest_on_triangle(&[a, b, c]: &[DVec3; 3], p: DVec3) -> DVec3 {
    let normal = (b - a).cross(c - a);
    let squared = normal.length_squared();
    let edges = [(a, b), (b, c), (c, a)];
    if squared > 0.0 {
        let q = p - normal * ((p - a).dot(normal) / squared);
        let inside = |(s, e): (DVec3, DVec3)| (e - s).cross(q - s).dot(normal) >= 0.0;
        if edges.into_iter().all(inside) {
            return q;
        }
    }
    let on_edges = edges.map(|(s, e)| {
        let (d, along) = (e - s, (p - s).dot(e - s));
        let squared = d.length_squared();
        let share = if squared > 0.0 { along / squared } else { 0.0 };
        s + d * share.clamp(0.0, 1.0)
    });
    on_edges.into_iter().fold(a, |best, q| {
        let nearer = q.distance_squared(p) < best.distance_squared(p);
        if nearer { q } else { best }
    })
}
