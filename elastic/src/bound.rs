//! Bounds on stiffness: a cheap one on the largest eigenvalue, and the cap for nodes near a cut.

use crate::model::Elastic;

impl Elastic {
    /// Upper bound on the largest eigenvalue (1/s²) of `M⁻¹ K` at rest, without iterations.
    ///
    /// Row sums (Gershgorin) of the block norms `|K_jk| <= sum_i V_i (lambda + 2 mu) |g_ij| |g_ik|`
    /// plus those of the graph Laplacian that bounds zero-energy control. The explicit step
    /// `2 / sqrt(bound)` is stable at small strain; strong stretch or compression stiffens a body,
    /// so a run should estimate the eigenvalue again with [`Elastic::tangent_product_into`].
    ///
    /// # Panics
    /// If `masses` (kg) is not as long as there are nodes.
    #[must_use]
    pub fn eigenvalue_bound(&self, masses: &[f64]) -> f64 {
        assert_eq!(masses.len(), self.node_count(), "one mass per node");
        let length = |z: &[f64; 6]| (z[0] * z[0] + z[1] * z[1] + z[2] * z[2]).sqrt();
        let strength: Vec<f64> = (0..self.node_count())
            .map(|node| {
                let (_, pairs) = self.rows.row(node);
                let around: f64 = pairs.iter().map(|z| length(&z.0)).sum();
                let reach = around + length(&self.own_pairs[node].0);
                self.elastic_volumes[node] * self.material(node).modulus_bound() * reach
            })
            .collect();
        let mut bound: f64 = 0.0;
        for (node, &mass) in masses.iter().enumerate() {
            let mut sum = strength[node] * length(&self.own_pairs[node].0);
            let (indices, reversed, weights) = self.rows.incoming(node);
            for ((&j, z), &w) in indices.iter().zip(reversed).zip(weights) {
                let j = j as usize;
                sum += strength[j] * length(&z.0);
                sum += 2.0 * (self.control(node) + self.control(j)) * w;
            }
            bound = bound.max(sum / mass);
        }
        bound
    }
}

/// Reference stiffness of the uncut body, for [`Elastic::cap_stiffness`].
#[derive(Debug, Clone, PartialEq)]
pub struct StiffnessCap {
    inverse_masses: Vec<f64>,
    reference: f64,
}

impl StiffnessCap {
    /// Measures the stiffest node of a body that is not cut yet.
    ///
    /// # Panics
    /// If `masses` (kg) is not as long as there are nodes.
    #[must_use]
    pub fn new(uncut: &Elastic, masses: &[f64]) -> Self {
        assert_eq!(masses.len(), uncut.node_count(), "one mass per node");
        let mut cap = Self {
            inverse_masses: masses.iter().map(|m| m.recip()).collect(),
            reference: 0.0,
        };
        cap.reference = (0..masses.len())
            .map(|node| cap.stiffness(uncut, node))
            .fold(0.0, f64::max);
        cap
    }

    /// `q_ref`: the largest `q_i` (1/s²) of the uncut body.
    #[must_use]
    pub fn reference(&self) -> f64 {
        self.reference
    }

    pub(crate) fn node_count(&self) -> usize {
        self.inverse_masses.len()
    }

    /// `q_i` (1/s²) of a node's present row, with its full volume.
    pub(crate) fn stiffness(&self, model: &Elastic, node: usize) -> f64 {
        let square = |z: &[f64; 6]| z[0] * z[0] + z[1] * z[1] + z[2] * z[2];
        let (indices, pairs) = model.rows.row(node);
        let mut sum = square(&model.own_pairs[node].0) * self.inverse_masses[node];
        for (&j, z) in indices.iter().zip(pairs) {
            sum += square(&z.0) * self.inverse_masses[j as usize];
        }
        sum * model.volumes[node] * model.material(node).modulus_bound()
    }
}
