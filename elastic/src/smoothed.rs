//! Displacements as they are read: the field whose gradient the stencils' gradient is.

use glam::{DMat3, DVec3};

use crate::kernel::row::inverse_moment;
use crate::kernel::storage::{CHUNK, parallel, share_out};
use crate::law::tensor::outer;
use crate::model::Elastic;

impl Elastic {
    /// Positions (m) of the smoothed field: rest positions plus displacements `û`, of which the stencils' gradient
    /// is the gradient to fourth order.
    ///
    /// `û_i = u_i + θ_i sum_j w_ij (u_ij - H_i X_ij) / m0`, `θ_i = 3/5 m0 m4 / m2²`, with the moments
    /// `m_k = sum_j w_ij |X_ij|^k` of the row and `H_i = (sum_j w_ij u_ij ⊗ X_ij) A_i⁻¹`.
    ///
    /// # Derivation
    /// Stencils are fitted to a linear field, so nodal values are coefficients, as those of any moving least
    /// squares are (Belytschko 1996). On a row with the moments of a sphere, `A = m2/3 I` and
    /// `sum_j w_ij X_a X_b X_c X_d = m4/15 (δ_ab δ_cd + δ_ac δ_bd + δ_ad δ_bc)`, Taylor's series of `u` gives
    ///
    /// * `H = ∇u + m4/(10 m2) ∇Δu`, which is the gradient of `u + m4/(10 m2) Δu`;
    /// * `sum_j w_ij (u_ij - H X_ij) = m2/6 Δu`.
    ///
    /// The second gives the `Δu` of the first, and `m4/(10 m2) · 6/m2 = θ/m0`.
    ///
    /// Affine displacements stay as they are, and a body that is turned and moved has a field that is turned and
    /// moved. Cut pairs weigh as they do in rows. Nodes whose row does not see three dimensions, and
    /// deficient ones, stay where they are.
    ///
    /// One gather, for whoever asks; forces and energy are those of `positions`, not of the field.
    ///
    /// # Panics
    /// If there is not one position per node.
    #[must_use]
    pub fn smoothed_positions(&self, positions: &[DVec3]) -> Vec<DVec3> {
        let n = self.node_count();
        assert_eq!(positions.len(), n, "one position per node");
        let mut smoothed = positions.to_vec();
        share_out(parallel(n), smoothed.chunks_mut(CHUNK), |chunk, nodes| {
            for (node, x) in (chunk * CHUNK..).zip(nodes) {
                *x += self.leftover(node, positions);
            }
        });
        smoothed
    }

    /// `θ_i sum_j w_ij (u_ij - H_i X_ij) / m0` (m).
    fn leftover(&self, node: usize, positions: &[DVec3]) -> DVec3 {
        let (model, zero) = (&self.model, DVec3::ZERO);
        if model.ranks[node] < 3 || model.elastic_volumes[node] == 0.0 {
            return zero;
        }
        let (rest, own) = (model.rest[node], positions[node] - model.rest[node]);
        let (mut m4, mut offsets, mut moves) = (0.0, zero, zero);
        let (mut moment, mut moved) = (DMat3::ZERO, DMat3::ZERO);
        for pair in model.pairs.row(node) {
            let (j, w) = (pair.to as usize, f64::from(pair.weight));
            let x = model.rest[j] - rest;
            let u = positions[j] - model.rest[j] - own;
            m4 += w * x.length_squared().powi(2);
            offsets += x * w;
            moves += u * w;
            moment += outer(x * w, x);
            moved += outer(u * w, x);
        }
        let Some([xx, yy, zz, yz, zx, xy]) = inverse_moment(moment) else {
            return zero;
        };
        let inverse = DMat3::from_cols_array(&[xx, xy, zx, xy, yy, yz, zx, yz, zz]);
        let m2 = moment.x_axis.x + moment.y_axis.y + moment.z_axis.z;
        // θ's m0 is that of the mean.
        (moves - moved * (inverse * offsets)) * (0.6 * m4 / (m2 * m2))
    }
}
