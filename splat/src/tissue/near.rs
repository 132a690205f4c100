//! The part of a cut that may lie in a body.

use crate::tissue::triangle_area;
use glam::DVec3;

/// Least fraction of a triangle near the body for which all of it is sampled.
const LEAST_SHARE: f64 = 0.25;

/// The part of a cut's triangles (m) near a body: of those that come within `reach` (m) of it by its signed distance,
/// what lies in its box from `low` to `high`, grown by half its size along each axis; all of a triangle of which that
/// is a quarter or more.
///
/// A blade may reach any way beyond a body, which may be a thousand times as long as it is thick, and
/// [`crate::Tissue::cut`] looks for skin by area.
pub fn triangles_near(
    triangles: &[[DVec3; 3]],
    [low, high]: [DVec3; 2],
    reach: f64,
    distance: impl Fn(DVec3) -> f64,
) -> Vec<[DVec3; 3]> {
    let near = triangles.iter().filter(|[a, b, c]| {
        let middle = (*a + *b + *c) / 3.0;
        let sizes = [a, b, c].map(|corner| corner.distance(middle));
        distance(middle) < sizes.into_iter().fold(0.0, f64::max) + reach
    });
    near.flat_map(|triangle| within(*triangle, low, high))
        .collect()
}

fn within(triangle: [DVec3; 3], low: DVec3, high: DVec3) -> Vec<[DVec3; 3]> {
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
        let near = |triangle, high: DVec3, reach| {
            let distance = |p: DVec3| (p - 0.5 * high).length() - 1.0;
            triangles_near(&[triangle], [low, high], reach, distance)
        };
        assert_eq!(near(small, high, 0.0), [small], "as it is");
        // A plane through the middle: what is left is the section of the grown box.
        let large = [(-1e3, -1e3), (3e3, -1e3), (-1e3, 3e3)].map(|(x, y)| DVec3::new(x, y, 0.5));
        let found = area(&near(large, high, 0.0));
        assert!((found / 4.0 - 1.0).abs() < 1e-9, "{found}");
        // A needle of a body: its section counts, not its length.
        let needle = DVec3::new(0.1, 0.1, 1e4);
        let found = area(&near(large, needle, 1e4));
        assert!((found / 0.04 - 1.0).abs() < 1e-9, "{found}");
        let none = [[DVec3::ZERO; 3]; 0];
        let beyond = large.map(|p| p + 10.0 * DVec3::Z);
        assert_eq!(near(beyond, high, 0.0), none, "nothing near the body");
        let beside = small.map(|p| p + 1.4 * DVec3::Z);
        assert_eq!(near(beside, high, 0.0), [beside], "in its box");
        assert_eq!(near(beside, high, -1.0), none, "out of reach");
    }
}
