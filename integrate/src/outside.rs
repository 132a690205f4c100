//! Which triangle of a body's outside a point lies on.

use std::collections::HashMap;

use glam::DVec3;

/// How far a point may lie off its triangle, over the triangle's size.
const OFF_TRIANGLE: f64 = 0.3;

/// Triangles of a body's outside, at each of their corners; none where nodes are mere points.
#[derive(Debug, Clone, Default)]
pub struct Outside {
    at: HashMap<u32, Vec<[u32; 3]>>,
}

impl Outside {
    /// Of triangles that are nodes of the body.
    #[must_use]
    pub fn new(triangles: &[[u32; 3]]) -> Self {
        let mut at: HashMap<u32, Vec<[u32; 3]>> = HashMap::new();
        for triangle in triangles {
            for corner in triangle {
                at.entry(*corner).or_default().push(*triangle);
            }
        }
        Self { at }
    }

    /// The triangle on which a point (m, at rest) lies, of those all of whose corners are among `seen`; `None` if it is
    /// farther from all of them than 0.3 of their size.
    ///
    /// # Panics
    /// If `rest` (m) has no position of a corner.
    ///
    /// ```
    /// use phyxel_integrate::{Outside, glam::DVec3};
    ///
    /// let rest = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ONE];
    /// let outside = Outside::new(&[[0, 1, 2], [1, 3, 2]]);
    /// let x = DVec3::new(0.3, 0.3, 0.01);
    /// assert_eq!(outside.triangle(&rest, x, &[0, 1, 2, 3]), Some([0, 1, 2]));
    /// assert_eq!(outside.triangle(&rest, x, &[0, 1]), None);
    /// assert_eq!(outside.triangle(&rest, x + DVec3::Z, &[0, 1, 2]), None);
    /// ```
    #[must_use]
    pub fn triangle(&self, rest: &[DVec3], x: DVec3, seen: &[u32]) -> Option<[u32; 3]> {
        let around = seen.iter().filter_map(|node| self.at.get(node)).flatten();
        let seen = around.filter(|corners| corners.iter().all(|corner| seen.contains(corner)));
        let inside = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|node| rest[node as usize]);
            let normal = (b - a).cross(c - a);
            let least = [(a, b), (b, c), (c, a)]
                .map(|(a, b)| (b - a).cross(x - a).dot(normal) / normal.length_squared())
                .into_iter()
                .fold(f64::INFINITY, f64::min);
            let height = (x - a).dot(normal.normalize_or_zero()).abs();
            least - height / normal.length().sqrt()
        };
        let best = seen.max_by(|a, b| inside(a).total_cmp(&inside(b)))?;
        (inside(best) > -OFF_TRIANGLE).then_some(*best)
    }
}
