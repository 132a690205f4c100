//! The faces that a cut opens: sides, distances, area vectors.

use glam::DVec3;

use crate::bounds::Bounds;
use crate::cuts::Cuts;
use crate::predicate::above;

/// Nearest point of a cut.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct NearestCut {
    /// The triangle that decides the side.
    pub triangle: u32,
    /// The nearest point (m).
    pub point: DVec3,
    /// Its distance (m).
    pub distance: f64,
    /// 1 on the side that the triangle's normal points to, −1 on the other; a point on the cut gets
    /// a side by the crate's tie rule.
    pub side: i8,
}

impl Cuts {
    /// Nearest point of the cut within a distance, and the side on which `point` lies there.
    ///
    /// Sides of one stroke agree with each other as long as the strip is not twisted by half a turn;
    /// beyond the end of a cut they are those of its continued end.
    #[must_use]
    pub fn nearest(&self, point: DVec3, within: f64) -> Option<NearestCut> {
        let mut near = Vec::new();
        self.faces_in(&Bounds::of(&[point]).grown(within), |triangle| {
            near.push(triangle);
        });
        near.sort_unstable();
        let mut best: Option<(f64, f64, u32, DVec3)> = None;
        for triangle in near {
            let corners = self.triangle(triangle as usize);
            let at = nearest_on_triangle(corners, point);
            let distance = at.distance(point);
            if distance > within {
                continue;
            }
            // Of several triangles that share the nearest point the one seen most from above
            // decides: near an edge the others are seen from behind.
            let normal = self.normal(triangle as usize);
            let height = (point - at).normalize_or_zero().dot(normal).abs();
            let nearer = best.is_none_or(|(d, h, _, _)| {
                let tie = 1e-12 * (d + distance);
                distance < d - tie || (distance <= d + tie && height > h)
            });
            if nearer {
                best = Some((distance, height, triangle, at));
            }
        }
        best.map(|(distance, _, triangle, at)| {
            let [p, q, r] = self.triangle(triangle as usize);
            NearestCut {
                triangle,
                point: at,
                distance,
                side: if above(p, q, r, point) { 1 } else { -1 },
            }
        })
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
