//! The dissertation's one-shot forms of the inverse map, for comparison.

use glam::{DMat3, DVec3};

use super::frame::MapFrame;

impl MapFrame<'_> {
    /// Aras 2014, eq. (62), once: `X = (Σ w_i F_i)⁻¹ Σ w_i (x − u_i + ∇u_i X_i)` with the weights
    /// `w(|x − X_i| / h_i)` as printed, the world point standing in for the unknown X. Far off once
    /// the body has moved; `None` where no support in the rest frame holds the point.
    #[must_use]
    pub fn one_shot_rest_weights(&self, world: DVec3) -> Option<DVec3> {
        self.one_shot(world, &self.map.rest_positions)
    }

    /// Eq. (62) once with the weights `w(|x − x_i| / h_i)` of the current positions: a good first
    /// guess, not a solution of eq. (61).
    #[must_use]
    pub fn one_shot_current_weights(&self, world: DVec3) -> Option<DVec3> {
        self.one_shot(world, self.positions)
    }

    fn one_shot(&self, world: DVec3, centres: &[DVec3]) -> Option<DVec3> {
        let map = self.map;
        let mut matrix = DMat3::ZERO;
        let mut rhs = DVec3::ZERO;
        for (i, &centre) in centres.iter().enumerate() {
            let q = (world - centre).length() / map.support_radii[i];
            let w = map.settings.kernel.value(q);
            if w > 0.0 && w.is_finite() {
                let rest = map.rest_positions[i];
                let u = self.positions[i] - rest;
                let slope = self.gradients[i] - DMat3::IDENTITY;
                matrix += self.gradients[i] * w;
                rhs += (world - u + slope * rest) * w;
            }
        }
        let inverse = matrix.inverse();
        (matrix.determinant() != 0.0 && inverse.is_finite()).then(|| inverse * rhs)
    }

    /// Aras 2014, eq. (63), as printed: displacement averaged over the k nearest nodes with weights
    /// that *grow* with the distance.
    #[must_use]
    pub fn distance_weighted(&self, world: DVec3) -> DVec3 {
        self.displacement_average(world, |distance| distance)
    }

    /// Eq. (63) with inverse distances; a node at the point itself decides alone.
    #[must_use]
    pub fn inverse_distance_weighted(&self, world: DVec3) -> DVec3 {
        self.displacement_average(world, f64::recip)
    }

    fn displacement_average(&self, world: DVec3, weight: impl Fn(f64) -> f64) -> DVec3 {
        let mut near = Vec::new();
        let count = self.map.settings.fallback_nodes;
        self.runs
            .nearest_into(self.positions, world, count, &mut near);
        let mut total = 0.0;
        let mut sum = DVec3::ZERO;
        for (squared, node) in near {
            let i = node as usize;
            let u = self.positions[i] - self.map.rest_positions[i];
            let w = weight(squared.sqrt());
            if w.is_infinite() {
                return world - u;
            }
            total += w;
            sum += u * w;
        }
        if total > 0.0 {
            world - sum / total
        } else {
            world
        }
    }
}
