//! Bodies that lie in one another although nothing keeps them apart.

use glam::DVec3;

use crate::vector::bounds_of;

/// Nodes so deep in a body at rest, in its spacings, are inside of it for sure, and what comes half as near to them is so
/// too.
const DEEP: f64 = 1.0;
const NEAR: f64 = 0.5;

/// A body as [`Occupied::meets`] sees it.
#[derive(Debug, Clone, Copy)]
pub struct Occupied<'a, F> {
    /// Rest positions (m) of its nodes.
    pub rest: &'a [DVec3],
    /// Where they are (m).
    pub positions: &'a [DVec3],
    /// Mean distance (m) between neighbouring nodes.
    pub spacing: f64,
    /// Signed distance (m) of a point from its surface at rest, negative inside.
    pub distance: F,
}

impl<F: Fn(DVec3) -> f64> Occupied<'_, F> {
    /// Whether the bodies lie in one another: a node well inside of one is nearer than half of its spacing to a node of the
    /// other. Positions that are not finite are near to nothing.
    ///
    /// ```
    /// use phyxel_integrate::{Occupied, glam::DVec3};
    ///
    /// let rest = [0.0, 0.1, 0.2].map(|x| DVec3::X * x); // of a bar from -0.05 to 0.25 m
    /// let meets = |by: f64| {
    ///     let moved = rest.map(|x| x + DVec3::X * by);
    ///     let distance = |x: DVec3| (x.x - 0.1).abs() - 0.15;
    ///     let body = Occupied { rest: &rest, positions: &rest, spacing: 0.1, distance };
    ///     body.meets(&Occupied { positions: &moved, ..body })
    /// };
    /// assert!(meets(0.13));
    /// assert!(!meets(0.17), "only ends are near to each other");
    /// ```
    #[must_use]
    pub fn meets<G: Fn(DVec3) -> f64>(&self, other: &Occupied<'_, G>) -> bool {
        let margin = NEAR * self.spacing.max(other.spacing);
        let [a, b] = [self.positions, other.positions].map(bounds_of);
        let (low, high) = (a[0].max(b[0]), a[1].min(b[1]));
        if !low.cmple(high).all() {
            return false;
        }
        let near = |x: &DVec3| x.cmpge(low - margin).all() && x.cmple(high + margin).all();
        let within = |positions: &[DVec3]| -> Vec<(usize, DVec3)> {
            let places = positions.iter().copied().enumerate();
            places.filter(|(_, x)| near(x)).collect()
        };
        // Along the longest side a window of the others' places is narrowest.
        let axis = (high - low).max_position();
        let mut others = within(other.positions);
        others.sort_by(|(_, a), (_, b)| a[axis].total_cmp(&b[axis]));
        within(self.positions).into_iter().any(|(node, x)| {
            let from = others.partition_point(|(_, y)| y[axis] < x[axis] - margin);
            let window = others[from..].iter();
            let mut window = window.take_while(|(_, y)| y[axis] <= x[axis] + margin);
            window.any(|&(theirs, y)| {
                let distance = x.distance(y);
                distance < NEAR * self.spacing && self.is_deep(node)
                    || distance < NEAR * other.spacing && other.is_deep(theirs)
            })
        })
    }

    fn is_deep(&self, node: usize) -> bool {
        (self.distance)(self.rest[node]) < -DEEP * self.spacing
    }
}
