//! The energy that the front of a cut would release if it moved on.

use glam::{DMat3, DVec3};

use crate::model::Elastic;

/// Steps along the front at which the weight of its domain is summed.
const STEPS: u32 = 32;

/// A place of the front of a cut, in material coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrackFront {
    /// Its position (m).
    pub at: DVec3,
    /// Unit vector in the cut's surface in which the front moves, out of what is cut; need not be square to it.
    pub ahead: DVec3,
    /// Unit vector along the front.
    pub along: DVec3,
}

impl Elastic {
    /// Energy release rate `G` (J/m²) at the state last evaluated: what a front would release per area if it moved straight on.
    ///
    /// The J-integral over a domain (Shih, Moran and Nakamura 1986, International Journal of Fracture 30, 79–102), at finite strain:
    ///
    /// `G |d × t| ∫ q ds = Σ_i V_i [(P_i ∇q_i)·(F_i − F̄) d − (W_i − W̄) d·∇q_i]`,
    ///
    /// with `d` ahead, `t` along the front, `q = (1 − r²/R²)²` in a ball about the place, and `∫ q ds` along the front in the body.
    /// Means over the ball, `F̄` and `W̄`, add nothing to the integral where forces balance; to its sum over nodes they would.
    /// Not in it are inertia, gravity, steps of the modulus and faces across the front within the ball.
    /// The front and the cut behind it are taken for straight there.
    ///
    /// # Arguments
    /// * `front` -- a place of the front.
    /// * `radius` -- of the ball (m), some four spacings: nodes about the front feel it smeared over two.
    /// * `inside` -- whether a material point (m) lies in the uncut body.
    ///
    /// Negative where the front is pressed; 0 where no node is near. Nodes that carry no strain energy of their own are left out.
    #[must_use]
    pub fn energy_release_rate(
        &self,
        front: &CrackFront,
        radius: f64,
        inside: impl Fn(DVec3) -> bool,
    ) -> f64 {
        let (model, viscosity) = (&self.model, self.state.viscosity.as_ref());
        let arm = |node: usize| (model.rest[node] - front.at) / radius;
        let is_near =
            |node: &usize| model.elastic_volumes[*node] > 0.0 && arm(*node).length_squared() < 1.0;
        let near: Vec<usize> = (0..self.node_count()).filter(is_near).collect();
        let held = |node: usize| {
            let f = self.deformation_gradient(node);
            let (energy, _) = model.energy_and_stress(viscosity, node, f);
            // What mean pressure holds, as if it rose evenly.
            let pressed = 0.5 * self.mean_pressure(node) * (f.determinant() - 1.0);
            (model.elastic_volumes[node], f, energy + pressed)
        };
        let zero = (0.0, DMat3::ZERO, 0.0);
        let sums = near.iter().fold(zero, |sums, &node| {
            let (volume, f, energy) = held(node);
            (
                sums.0 + volume,
                sums.1 + f * volume,
                sums.2 + energy * volume,
            )
        });
        let share = sums.0.max(f64::MIN_POSITIVE).recip();
        let (mean, mean_energy) = (sums.1 * share, sums.2 * share);
        let of_node = |&node: &usize| {
            let ((volume, f, energy), arm) = (held(node), arm(node));
            let slope = arm * (-4.0 * (1.0 - arm.length_squared()) / radius);
            let pulled = self.first_piola_kirchhoff(node) * slope;
            let work = pulled.dot((f - mean) * front.ahead);
            volume * (work - (energy - mean_energy) * front.ahead.dot(slope))
        };
        let released: f64 = near.iter().map(of_node).sum();
        let step = |k: u32| -1.0 + (2.0 * f64::from(k) + 1.0) / f64::from(STEPS);
        let weight = (0..STEPS).map(step).map(|s| {
            let is_in = inside(front.at + front.along * (s * radius));
            (1.0 - s * s).powi(2) * f64::from(u8::from(is_in))
        });
        // Of a front that is not square to where it looks, what it gains counts.
        let square = match front.ahead.cross(front.along).length() {
            0.0 => 1.0,
            square => square,
        };
        let length = weight.sum::<f64>() * square * 2.0 * radius / f64::from(STEPS);
        if length > 0.0 { released / length } else { 0.0 }
    }
}
