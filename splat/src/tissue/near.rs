//! The part of a cut that may lie in a body.

use crate::tissue::triangle_area;
use glam::DVec3;

/// Least fraction of a triangle near the body for which all of it is sampled.
const LEAST_SHARE: f64 = 0.25;

/// The part of a cut's triangle (m) near a body, as triangles: what lies in the body's box from `low` to `high`,
/// grown by half its size along each axis; all of the triangle if that is a quarter of it or more.
///
/// A blade may reach any way beyond a body, which may be a thousand times as long as it is thick, and
/// [`crate::Tissue::cut`] looks for skin by area.
#[must_use]
pub fn triangle_near_box(triangle: [DVec3; 3], low: DVec3, high: DVec3) -> Vec<[DVec3; 3]> {
    let margin = 0.5 * (high - low);
    let mut polygon = triangle.to_vec();
    for axis in 0..3 {
        let (least, most) = (low[axis] - margin[axis], high[axis] + margin[axis]);
        polygon = clip(&polygon, |p| p[axis] - least);
        polygon = clip(&polygon, |p| most - p[axis]);
    }
    let part: Vec<[DVec3; 3]> = (2..polygon.len())
        .map(|k| [polygon[0], polygon[k - 1], polygon[k]])
        .collect();
    if area(&part) < LEAST_SHARE * area(&[triangle]) {
        part
    } else {
        vec![triangle]
    }
}

fn area(triangles: &[[DVec3; 3]]) -> f64 {
    triangles.iter().map(triangle_area).sum()
}

/// The part of a convex polygon where a linear function is not negative.
fn clip(polygon: &[DVec3], depth: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (k, &to) in polygon.iter().enumerate() {
        let from = polygon[(k + polygon.len() - 1) % polygon.len()];
        let (a, b) = (depth(from), depth(to));
        if (a < 0.0) != (b < 0.0) {
            kept.push(from.lerp(to, a / (a - b)));
        }
        if b >= 0.0 {
            kept.push(to);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_triangle_is_clipped_to_the_body() {
        let (low, high) = (DVec3::ZERO, DVec3::ONE);
        let small = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert_eq!(triangle_near_box(small, low, high), [small], "as it is");
        // A plane through the middle: what is left is the section of the grown box.
        let large = [(-1e3, -1e3), (3e3, -1e3), (-1e3, 3e3)].map(|(x, y)| DVec3::new(x, y, 0.5));
        let found = area(&triangle_near_box(large, low, high));
        assert!((found / 4.0 - 1.0).abs() < 1e-9, "{found}");
        // A needle of a body: its section counts, not its length.
        let needle = DVec3::new(0.1, 0.1, 1e4);
        let found = area(&triangle_near_box(large, low, needle));
        assert!((found / 0.04 - 1.0).abs() < 1e-9, "{found}");
        let beyond = large.map(|p| p + 10.0 * DVec3::Z);
        let found = triangle_near_box(beyond, low, high);
        assert_eq!(found, [[DVec3::ZERO; 3]; 0], "nothing near the body");
    }
}
