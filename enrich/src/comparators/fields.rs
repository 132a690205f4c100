//! Fields of single pieces of a cut to compare with.

use glam::{DVec2, DVec3};

use crate::face::nearest_on_triangle;

/// Enrichment by one plane segment in its own frame: `φ = s / d2` (Aras 2014, eqs. (34)–(37)).
///
/// 1 to the left of the segment, −1 to the right, smooth around its ends; 1 on the segment itself.
///
/// # Examples
/// ```
/// use phyxel_enrich::glam::DVec2;
/// let phi = phyxel_enrich::segment_enrichment([DVec2::ZERO, DVec2::X], DVec2::new(1.3, 0.4));
/// assert!((phi - 0.8).abs() < 1e-15);
/// ```
#[must_use]
pub fn segment_enrichment(segment: [DVec2; 2], point: DVec2) -> f64 {
    let [a, b] = segment;
    let length = a.distance(b);
    if length <= 0.0 {
        return 1.0;
    }
    let along = (b - a) / length;
    let (t, s) = (along.dot(point - a), along.perp_dot(point - a));
    let d_s = (t - 0.5 * length).abs() - 0.5 * length; // eq. (35)
    let d_1 = 0.5 * (d_s + d_s.abs()); // eq. (36)
    ratio(s, d_1)
}

/// Enrichment by one triangle in its own frame: `φ = s / d3` (Aras 2014, eqs. (47)–(48)).
#[must_use]
pub fn triangle_enrichment(triangle: [DVec3; 3], point: DVec3) -> f64 {
    let [p, q, r] = triangle;
    let normal = (q - p).cross(r - p).normalize_or_zero();
    let s = normal.dot(point - p);
    let projected = point - s * normal;
    ratio(
        s,
        nearest_on_triangle(triangle, projected).distance(projected),
    )
}

fn ratio(s: f64, d_plus: f64) -> f64 {
    let d = d_plus.hypot(s);
    if d > 0.0 { s / d } else { 1.0 }
}

/// Product of `(1 + φ_l) / 2` over consecutive segments (Aras 2014, eq. (38)), which the
/// dissertation's fig. 23 shows to be wrong: it falls with every subdivision of the cut.
#[must_use]
pub fn product_of_segments(polyline: &[DVec2], point: DVec2) -> f64 {
    polyline
        .windows(2)
        .map(|w| 0.5 * (1.0 + segment_enrichment([w[0], w[1]], point)))
        .product()
}
