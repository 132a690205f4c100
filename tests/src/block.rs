//! A box of nodes with tetrahedra, volumes and conservative gradient stencils.
//!
//! An oracle of its own: written from the formulas, for clarity rather than speed, so that a crate
//! can be tested without the other crates, and they against it. The stencils satisfy
//! `sum_j X_ij g_ij^T = I` per node and `sum_i V_i g_ij = b_j` (self terms included) over all, the
//! second up to the tolerance of a conjugate-gradient solve.

use glam::{DMat3, DVec3};

use crate::kuhn;
use crate::solve::conjugate_gradients;

/// A body ready for nodal mechanics; what is made of its stencils is empty until they are solved.
#[derive(Debug, Clone, Default)]
pub struct Block {
    /// Node positions (m), x fastest.
    pub positions: Vec<DVec3>,
    /// Nodal volumes (m³), a quarter of each adjacent tetrahedron.
    pub volumes: Vec<f64>,
    /// Area vectors `b_i` (m²): a third of each adjacent boundary triangle, outward.
    pub boundary_vectors: Vec<DVec3>,
    /// Positively oriented tetrahedra.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Outward boundary triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Starts of the rows of the edge graph.
    pub offsets: Vec<u32>,
    /// Its neighbours, ascending in each row.
    pub indices: Vec<u32>,
    /// `w_ij = 1 / r²` (1/m²), to the digits of an f32.
    pub weights: Vec<f64>,
    /// `B_i` of the factored form `g_ij = w_ij [B_i X_ij + s_i (μ_j - μ_i)]`.
    pub matrices: Vec<DMat3>,
    /// `s_i`; empty for plain moving least squares.
    pub scales: Vec<f64>,
    /// `μ_i`; empty for plain moving least squares.
    pub multipliers: Vec<DVec3>,
    /// `g_ij` (1/m).
    pub gradients: Vec<DVec3>,
    /// `g_ii = -sum_j g_ij` (1/m).
    pub self_gradients: Vec<DVec3>,
    /// Largest violation of `sum_i V_i g_ij = b_j` (m²) that the solve left.
    pub residual: f64,
}

fn id(value: usize) -> u32 {
    u32::try_from(value).expect("test bodies are small")
}

/// `a bᵀ`.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

impl Block {
    /// Box `[0, size]` of `cells`, each split into six mirrored right-angled tetrahedra. Nodes move
    /// by up to `jitter` cell sizes per axis, boundary nodes within their faces and edges.
    #[must_use]
    pub fn new(cells: [usize; 3], size: DVec3, jitter: f64, seed: u64) -> Self {
        kuhn::mirrored_block(cells, size, jitter, seed).solved()
    }

    /// A body of any tetrahedra, with stencils solved to round-off.
    #[must_use]
    pub fn from_tetrahedra(positions: Vec<DVec3>, tetrahedra: Vec<[u32; 4]>) -> Self {
        kuhn::from_tetrahedra(positions, tetrahedra).solved()
    }

    fn solved(mut self) -> Self {
        self.set_weights();
        self.solve_stencils();
        self
    }

    /// Lattice of `n` nodes per axis along a Morton curve, each joined to the 18 nodes up to
    /// `sqrt(2)` spacings away (16.4 on average at 18³), with plain MLS gradients: a body for
    /// measuring speed at any size, cheap to build.
    #[must_use]
    pub fn eighteen(n: [usize; 3], spacing: f64) -> Self {
        let mut cells: Vec<[usize; 3]> = (0..n[2])
            .flat_map(|k| (0..n[1]).flat_map(move |j| (0..n[0]).map(move |i| [i, j, k])))
            .collect();
        cells.sort_by_key(|&at| morton(at));
        let number = |at: [usize; 3]| at[0] + n[0] * (at[1] + n[1] * at[2]);
        let mut rank = vec![0_u32; cells.len()];
        for (order, &at) in cells.iter().enumerate() {
            rank[number(at)] = id(order);
        }
        let mut offsets = vec![0_u32];
        let mut indices = Vec::new();
        for &at in &cells {
            let start = indices.len();
            for step in 0..27 {
                let shift = [step % 3, step / 3 % 3, step / 9];
                let far = shift.iter().filter(|&&s| s != 1).count();
                let to = [0, 1, 2].map(|a| (at[a] + shift[a]).wrapping_sub(1));
                if (1..=2).contains(&far) && (0..3).all(|a| to[a] < n[a]) {
                    indices.push(rank[number(to)]);
                }
            }
            indices[start..].sort_unstable();
            offsets.push(id(indices.len()));
        }
        let position = |at: &[usize; 3]| DVec3::from_array(at.map(|k| k as f64)) * spacing;
        let positions: Vec<DVec3> = cells.iter().map(position).collect();
        let mut body = Self {
            volumes: vec![spacing.powi(3); positions.len()],
            boundary_vectors: vec![DVec3::ZERO; positions.len()],
            positions,
            offsets,
            indices,
            ..Self::default()
        };
        body.set_weights();
        body.use_plain_gradients();
        body
    }

    /// Number of nodes.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.positions.len()
    }

    /// Pairs of a node.
    #[must_use]
    pub fn row(&self, node: usize) -> std::ops::Range<usize> {
        self.offsets[node] as usize..self.offsets[node + 1] as usize
    }

    /// `X_ij` of pair `p` in row `i`.
    #[must_use]
    pub fn offset(&self, i: usize, p: usize) -> DVec3 {
        self.positions[self.indices[p] as usize] - self.positions[i]
    }

    /// Plain MLS rows `g0_ij = w_ij A_i⁻¹ X_ij` of the present weights, without conservation.
    #[must_use]
    pub fn plain_gradients(&self) -> Vec<DVec3> {
        let inverses = self.inverse_moments();
        self.rows_of(|i, p| inverses[i] * self.offset(i, p) * self.weights[p])
    }

    /// Something of every pair.
    fn rows_of<T>(&self, value: impl Fn(usize, usize) -> T) -> Vec<T> {
        let mut values = Vec::with_capacity(self.indices.len());
        for i in 0..self.node_count() {
            values.extend(self.row(i).map(|p| value(i, p)));
        }
        values
    }

    fn inverse_moments(&self) -> Vec<DMat3> {
        let moment = |i: usize| {
            let terms = self.row(i).map(|p| {
                let x = self.offset(i, p);
                outer(x, x) * self.weights[p]
            });
            terms.fold(DMat3::ZERO, |sum, term| sum + term)
        };
        (0..self.node_count())
            .map(|i| moment(i).inverse())
            .collect()
    }

    /// Replaces gradients by the plain MLS rows.
    pub fn use_plain_gradients(&mut self) {
        self.matrices = self.inverse_moments();
        self.scales.clear();
        self.multipliers.clear();
        self.gradients = self.plain_gradients();
        self.finish_gradients();
    }

    /// Sets the gradients of some rows to what their factors give.
    pub fn set_gradients_from_factors(&mut self, nodes: impl IntoIterator<Item = usize>) {
        for i in nodes {
            let scale = self.scales.get(i).copied().unwrap_or(0.0);
            let mut sum = DVec3::ZERO;
            for p in self.row(i) {
                let mut g = self.matrices[i] * self.offset(i, p);
                if let Some(own) = self.multipliers.get(i) {
                    g += (self.multipliers[self.indices[p] as usize] - *own) * scale;
                }
                self.gradients[p] = g * self.weights[p];
                sum += self.gradients[p];
            }
            self.self_gradients[i] = -sum;
        }
    }

    #[allow(clippy::cast_possible_truncation, reason = "rounding is meant")]
    fn set_weights(&mut self) {
        self.weights = self.rows_of(|i, p| {
            let weight = self.offset(i, p).length_squared().recip() as f32;
            f64::from(weight)
        });
    }

    fn finish_gradients(&mut self) {
        self.self_gradients = (0..self.node_count())
            .map(|i| -self.row(i).map(|p| self.gradients[p]).sum::<DVec3>())
            .collect();
        let mut miss = self.boundary_vectors.clone();
        for i in 0..self.node_count() {
            miss[i] -= self.self_gradients[i] * self.volumes[i];
            for p in self.row(i) {
                miss[self.indices[p] as usize] -= self.gradients[p] * self.volumes[i];
            }
        }
        self.residual = miss.iter().fold(0.0, |most, m| m.length().max(most));
    }

    /// `e_ij(mu) = (mu_j - mu_i) - H_i(mu) X_ij`, `H_i = sum_k (mu_k - mu_i) g0_ikᵀ`.
    fn bracket(&self, g0: &[DVec3], mu: &[DVec3]) -> Vec<DVec3> {
        let mut e = vec![DVec3::ZERO; g0.len()];
        for i in 0..self.node_count() {
            let mut h = DMat3::ZERO;
            for p in self.row(i) {
                h += outer(mu[self.indices[p] as usize] - mu[i], g0[p]);
            }
            for p in self.row(i) {
                e[p] = mu[self.indices[p] as usize] - mu[i] - h * self.offset(i, p);
            }
        }
        e
    }

    fn solve_stencils(&mut self) {
        let n = self.node_count();
        let g0 = self.plain_gradients();
        let mut missing = self.boundary_vectors.clone();
        let mut diagonal = vec![0.0; n];
        for i in 0..n {
            for p in self.row(i) {
                let j = self.indices[p] as usize;
                missing[j] -= g0[p] * self.volumes[i];
                missing[i] += g0[p] * self.volumes[i];
                let c = self.volumes[i] * self.volumes[i] * self.weights[p];
                diagonal[i] += c;
                diagonal[j] += c;
            }
        }
        let apply = |mu: &[DVec3], y: &mut [DVec3]| {
            let e = self.bracket(&g0, mu);
            y.fill(DVec3::ZERO);
            for i in 0..n {
                for p in self.row(i) {
                    let c = e[p] * (self.volumes[i] * self.volumes[i] * self.weights[p]);
                    y[self.indices[p] as usize] += c;
                    y[i] -= c;
                }
            }
        };
        let solved = conjugate_gradients(apply, missing, &diagonal, 1e-30, 10 * n);
        // What the solve left is in `residual`.
        let mu = solved.unwrap_or_else(|(mu, _)| mu);
        let e = self.bracket(&g0, &mu);
        self.matrices = self.inverse_moments();
        self.gradients.clone_from(&g0);
        for i in 0..n {
            let mut h = DMat3::ZERO;
            for p in self.row(i) {
                h += outer(mu[self.indices[p] as usize] - mu[i], g0[p]);
                self.gradients[p] = g0[p] + e[p] * (self.volumes[i] * self.weights[p]);
            }
            self.matrices[i] -= h * self.volumes[i];
        }
        self.scales.clone_from(&self.volumes);
        self.multipliers = mu;
        self.finish_gradients();
    }
}

/// Interleaved bits of a cell's position.
fn morton(at: [usize; 3]) -> usize {
    (0..20).fold(0, |code, bit| {
        (0..3).fold(code, |code, axis| {
            code | ((at[axis] >> bit & 1) << (3 * bit + axis))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stencils_satisfy_both_conditions() {
        let size = DVec3::new(1.0, 0.7, 0.4);
        let block = Block::new([5, 4, 3], size, 0.25, 3);
        let total: f64 = block.volumes.iter().sum();
        assert!((total - 0.28).abs() < 1e-14, "volume {total}");
        assert!(block.residual < 1e-13, "residual {}", block.residual);
        for i in 0..block.node_count() {
            let m = block
                .row(i)
                .map(|p| outer(block.offset(i, p), block.gradients[p]))
                .fold(DMat3::ZERO, |a, b| a + b);
            assert!(m.abs_diff_eq(DMat3::IDENTITY, 1e-12), "row {i}: {m}");
        }
        let mut again = block.clone();
        again.set_gradients_from_factors(0..block.node_count());
        for (g, of_factors) in block.gradients.iter().zip(&again.gradients) {
            assert!(g.abs_diff_eq(*of_factors, 1e-11), "{g} {of_factors}");
        }
    }
}
