//! Points of triangles and of the cut that are nearest to others.

use glam::DVec3;

use crate::bounds::Bounds;
use crate::cuts::Cuts;

impl Cuts {
    /// Nearest point (m) of the cut within a distance, and its distance (m).
    pub(crate) fn nearest(&self, point: DVec3, within: f64) -> Option<(DVec3, f64)> {
        let mut near = Vec::new();
        let around = Bounds::of(&[point]).grown(within);
        self.forest.in_box(&around, |triangle| near.push(triangle));
        near.sort_unstable();
        let mut best: Option<(f64, f64, DVec3)> = None;
        for triangle in near {
            let at = nearest_on_triangle(self.triangle(triangle as usize), point);
            let distance = at.distance(point);
            if distance > within {
                continue;
            }
            // Of several triangles that share the nearest point the one seen most from above
            // decides: near an edge the others are seen from behind.
            let normal = self.normal(triangle as usize);
            let height = (point - at).normalize_or_zero().dot(normal).abs();
            let nearer = best.is_none_or(|(d, h, _)| {
                let tie = 1e-12 * (d + distance);
                distance < d - tie || (distance <= d + tie && height > h)
            });
            if nearer {
                best = Some((distance, height, at));
            }
        }
        best.map(|(distance, _, at)| (at, distance))
    }
}

/// Nearest point of a segment.
pub(crate) fn nearest_on_segment([p, q]: [DVec3; 2], point: DVec3) -> DVec3 {
    let along = q - p;
    let t = (point - p).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
    p + t.clamp(0.0, 1.0) * along
}

/// Nearest point of a triangle (Ericson 2005, section 5.1.5).
pub(crate) fn nearest_on_triangle([a, b, c]: [DVec3; 3], point: DVec3) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = point - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = point - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let total = va + vb + vc;
    a + ab * (vb / total) + ac * (vc / total)
}
