//! Gradient stencils that are conservative and consistent at once: see [`GradientStencils::conservative`];
//! μ comes from one symmetric positive semidefinite system per cloud, see [`operator`].

mod coarse;
mod iteration;
mod operator;
mod pieces;
#[cfg(test)]
mod tests;

use glam::{DMat3, DVec3};

use crate::parallel::{ROWS_PER_TASK, fill_rows, map};
use crate::stencil::{Row, checked_weights, moments};
use crate::{GradientStencils, Neighborhoods, SolveReport, StencilError, StencilRank};
use coarse::CoarseSpace;
use iteration::{Preconditioner, conjugate_gradients, largest};
use operator::Operator;
use pieces::{make_solvable, pieces};

/// How [`GradientStencils::conservative`] builds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConservativeSettings {
    /// Eigenvalues of a moment matrix below `rank_tolerance · λ_max` count as zero.
    pub rank_tolerance: f64,
    /// The solve ends when `|Σ_i V_i g_ij − b_j|` is below `tolerance` times the largest `|b_j|`
    /// (of a node's face, `V^(2/3)`, where all b are zero) for every node.
    pub tolerance: f64,
    /// Most iterations of the solve.
    pub iteration_limit: usize,
    /// Whether a coarse space of splines speeds the solve up. Without it the iterations grow with
    /// the square of the nodes per side; the result is the same within the tolerance.
    pub coarse_space: bool,
}

impl Default for ConservativeSettings {
    /// Rank tolerance 1e-3, tolerance 1e-11, 5,000 iterations, coarse space.
    fn default() -> Self {
        Self {
            rank_tolerance: 1e-3,
            tolerance: 1e-11,
            iteration_limit: 5000,
            coarse_space: true,
        }
    }
}

impl ConservativeSettings {
    /// For bodies that will be cut: rank tolerance 0.03.
    ///
    /// A cut leaves surface nodes with three or four neighbours almost in a plane. Their gradients across
    /// it would be twenty times too large, so a direction spanned this weakly counts as not seen.
    #[must_use]
    pub fn for_cutting() -> Self {
        Self {
            rank_tolerance: 0.03,
            ..Self::default()
        }
    }
}

impl GradientStencils {
    /// Conservative and consistent stencils: moment matrices, then one matrix-free solve.
    ///
    /// `g_ij = g0_ij + V_i w_ij [(μ_j − μ_i) − H_i X_ij]` with `g0` of [`GradientStencils::plain`] and
    /// `H_i = Σ_k (μ_k − μ_i) g0_ikᵀ` is the stencil nearest to `g0` (in `Σ |g − g0|² / w`) with
    /// `Σ_i V_i g_ij = b_j` and `Σ_j X_ij g_ijᵀ = I` (Chiu, Wang, Hu, Jameson 2012; Chen et al. 2001).
    /// The solve is by conjugate gradients, preconditioned by Jacobi and one multigrid cycle over
    /// quadratic B-splines; its iterations do not grow with the cloud.
    ///
    /// # Arguments
    /// * `positions` -- rest positions X (m), shape `(n)`.
    /// * `volumes` -- nodal volumes V (m³), shape `(n)`, positive.
    /// * `boundary_vectors` -- boundary area vectors b (m²), shape `(n)`, outward; zero inside.
    ///   A closed surface gives `Σ b = 0` and `Σ b ⊗ X = (Σ V) I`, which is what a solution needs;
    ///   what is missing is spread evenly and reported as [`SolveReport::boundary_shift`].
    /// * `neighborhoods` -- symmetric graph.
    /// * `weights` -- `w_ij ≥ 0`, shape `(pairs)`; [`crate::inverse_square_weights`] for graphs.
    ///
    /// # Errors
    /// [`StencilError`] for a list of the wrong length and for the first bad position, volume, boundary
    /// vector, weight, or pair without counterpart.
    ///
    /// # Numerics
    /// Linear fields are exact to about `condition · ε` on rows of rank 3. Rows of lower rank keep
    /// `g0` on their span and take no part in the correction. A solve that stops short is an error of
    /// [`GradientStencils::converged`] only. The result does not depend on the number of threads. The
    /// solve needs about 900 bytes per node and 36 per pair while it runs.
    pub fn conservative(
        positions: &[DVec3],
        volumes: &[f64],
        boundary_vectors: &[DVec3],
        neighborhoods: &Neighborhoods,
        weights: Vec<f64>,
        settings: &ConservativeSettings,
    ) -> Result<Self, StencilError> {
        neighborhoods.check_nodes("volumes", volumes.len())?;
        neighborhoods.check_nodes("boundary vectors", boundary_vectors.len())?;
        let weights = checked_weights(positions, neighborhoods, weights)?;
        validate_nodes(volumes, boundary_vectors)?;
        let reverse = neighborhoods.reverse_pairs()?;
        let rank_tolerance = settings.rank_tolerance;
        let (inverses, ranks) = moments(positions, neighborhoods, &weights, rank_tolerance);
        let setup = Setup {
            positions,
            neighborhoods,
            weights: &weights,
            volumes,
            inverses: &inverses,
            ranks: &ranks,
            reverse: &reverse,
        };
        let mut boundary_vectors = boundary_vectors.to_vec();
        let (multipliers, report) = setup.solve(&mut boundary_vectors, settings);
        let scales = setup.scales();
        let corrections = setup.corrections(&multipliers);
        let corrected = inverses.iter().zip(&corrections).zip(&scales);
        Ok(Self {
            matrices: corrected.map(|((a, h), v)| *a - *h * *v).collect(),
            scales,
            base_weights: weights.clone(),
            weights,
            multipliers,
            ranks,
            volumes: volumes.to_vec(),
            boundary_vectors,
            report: Some(report),
            rank_tolerance,
        })
    }
}

/// A cloud whose μ is solved for.
struct Setup<'a> {
    positions: &'a [DVec3],
    neighborhoods: &'a Neighborhoods,
    weights: &'a [f64],
    volumes: &'a [f64],
    /// `A_i⁻¹`, truncated where the rank is below 3.
    inverses: &'a [DMat3],
    ranks: &'a [StencilRank],
    /// For every pair the position of its counterpart.
    reverse: &'a [u32],
}

impl Setup<'_> {
    /// `V_i` on rows of rank 3, 0 on those that take no part.
    fn scales(&self) -> Vec<f64> {
        let rows = self.volumes.iter().zip(self.ranks);
        rows.map(|(&volume, rank)| if rank.rank == 3 { volume } else { 0.0 })
            .collect()
    }

    fn row(&self, node: usize) -> Row<'_> {
        Row::new(self.positions, self.neighborhoods, self.weights, node)
    }

    /// `H_i`, zero on rows that take no part.
    fn corrections(&self, multipliers: &[DVec3]) -> Vec<DMat3> {
        let row = |node: usize| {
            if self.ranks[node].rank < 3 {
                return DMat3::ZERO;
            }
            self.row(node).correction(multipliers, &self.inverses[node])
        };
        map(self.volumes.len(), ROWS_PER_TASK, row)
    }

    /// `g_ij` by the sum of `g0_ij` and its correction, shape `(pairs)`.
    fn gradients(&self, multipliers: &[DVec3]) -> Vec<DVec3> {
        let corrections = self.corrections(multipliers);
        let mut gradients = vec![DVec3::ZERO; self.weights.len()];
        fill_rows(self.neighborhoods, &mut gradients, |node, out| {
            for ((j, x, w), g) in self.row(node).pairs().zip(out) {
                *g = self.inverses[node] * (x * w);
                if self.ranks[node].rank == 3 {
                    let e = multipliers[j] - multipliers[node] - corrections[node] * x;
                    *g += e * (self.volumes[node] * w);
                }
            }
        });
        gradients
    }

    /// `b_j − Σ_i V_i g_ij`, self terms included.
    fn defect(&self, boundary_vectors: &[DVec3], multipliers: &[DVec3]) -> Vec<DVec3> {
        let gradients = self.gradients(multipliers);
        map(self.volumes.len(), ROWS_PER_TASK, |j| {
            let pairs = self.neighborhoods.pairs(j);
            let own = gradients[pairs].iter().fold(DVec3::ZERO, |own, g| own - *g);
            let mut sum = boundary_vectors[j] - own * self.volumes[j];
            for (pair, i) in self.neighborhoods.entries(j) {
                sum -= gradients[self.reverse[pair] as usize] * self.volumes[i];
            }
            sum
        })
    }

    /// Makes `b` attainable on every connected piece and solves `Σ_i V_i g_ij = b_j` for μ.
    fn solve(
        &self,
        boundary_vectors: &mut [DVec3],
        settings: &ConservativeSettings,
    ) -> (Vec<DVec3>, SolveReport) {
        let given = boundary_vectors.to_vec();
        let pieces = pieces(self.neighborhoods, self.weights);
        let mut multipliers = vec![DVec3::ZERO; self.volumes.len()];
        let mut defect = self.defect(boundary_vectors, &multipliers);
        for piece in &pieces {
            let shift = make_solvable(self.positions, piece, &mut defect);
            for (&node, shift) in piece.iter().zip(shift) {
                boundary_vectors[node as usize] -= shift;
            }
        }
        let start = largest(&defect);
        let scale = largest(boundary_vectors);
        let face = |most: f64, v: &f64| most.max(v.cbrt() * v.cbrt());
        let reference = if scale > 0.0 {
            scale
        } else {
            self.volumes.iter().fold(0.0, face)
        };
        let bound = settings.tolerance * reference;
        let mut iterations = 0;
        if start > bound {
            let operator = Operator::new(self);
            let inverse = operator.inverse_diagonal();
            let coarse = settings.coarse_space.then(|| {
                let takes_part: Vec<bool> = inverse.iter().map(|&d| d > 0.0).collect();
                CoarseSpace::new(&operator, &takes_part, &pieces)
            });
            let preconditioner = Preconditioner {
                inverse,
                coarse: coarse.flatten(),
            };
            let limit = settings.iteration_limit;
            let (found, made) =
                conjugate_gradients(&operator, preconditioner, defect, bound, limit);
            iterations = made;
            if largest(&self.defect(boundary_vectors, &found)) <= start {
                multipliers = found;
            }
        }
        let residual = largest(&self.defect(boundary_vectors, &multipliers)) / reference;
        let shifted = given.iter().zip(&*boundary_vectors);
        let shifted = shifted.map(|(a, b)| (*a - *b).length());
        let report = SolveReport {
            iterations,
            residual,
            boundary_shift: shifted.fold(0.0, f64::max) / reference,
            converged: residual <= 4.0 * settings.tolerance,
        };
        (multipliers, report)
    }
}

/// Refuses volumes and boundary vectors that are not finite, and volumes that are not positive.
fn validate_nodes(volumes: &[f64], boundary_vectors: &[DVec3]) -> Result<(), StencilError> {
    if let Some(node) = volumes.iter().position(|&v| !(v > 0.0 && v.is_finite())) {
        let value = volumes[node];
        return Err(StencilError::Volume { node, value });
    }
    if let Some(node) = boundary_vectors.iter().position(|b| !b.is_finite()) {
        return Err(StencilError::BoundaryVector { node });
    }
    Ok(())
}
