//! Enforcing `Σ_i V_i g_ij = b_j`: attainable boundary vectors, the solve for μ, and the rows of it.

use glam::DVec3;
use rayon::prelude::*;

use super::coarse::CoarseSpace;
use super::iteration::{Preconditioner, conjugate_gradients, largest};
use super::operator::Operator;
use super::pieces::{make_solvable, pieces};
use super::{ConservativeStencils, SolveReport};
use crate::neighborhoods::Neighborhoods;
use crate::parallel::ROWS_PER_TASK;

impl ConservativeStencils {
    /// `b_j − Σ_i V_i g_ij` for the current stencils, self terms included.
    pub(super) fn defect(&self, neighborhoods: &Neighborhoods) -> Vec<DVec3> {
        let indices = neighborhoods.indices();
        (0..self.volumes.len())
            .into_par_iter()
            .with_min_len(ROWS_PER_TASK)
            .map(|j| {
                let mut sum = self.boundary_vectors[j] - self.self_gradients[j] * self.volumes[j];
                for pair in neighborhoods.pairs(j) {
                    let back = self.reverse[pair] as usize;
                    sum -= self.pair_gradients[back] * self.volumes[indices[pair] as usize];
                }
                sum
            })
            .collect()
    }

    /// Largest violation `max_j |Σ_i V_i g_ij − b_j|` (m²) for the current stencils.
    ///
    /// # Panics
    /// If the neighbourhoods are not those of the set-up or the pair gradients were forgotten.
    #[must_use]
    pub fn conservation_error(&self, neighborhoods: &Neighborhoods) -> f64 {
        self.assert_not_forgotten();
        assert_eq!(
            neighborhoods.pair_count(),
            self.weights.len(),
            "the graph of the set-up"
        );
        largest(&self.defect(neighborhoods))
    }

    fn active_defect(&self, neighborhoods: &Neighborhoods, active: &[bool]) -> Vec<DVec3> {
        let mut defect = self.defect(neighborhoods);
        keep_active(&mut defect, active);
        defect
    }

    /// Makes `b` attainable on every piece of at least `smallest` nodes, solves for μ starting from
    /// the μ at hand, and rebuilds the rows. The change of `b` is put on the nodes of `spread`
    /// first.
    pub(super) fn enforce(
        &mut self,
        positions: &[DVec3],
        neighborhoods: &Neighborhoods,
        spread: &[bool],
        smallest: usize,
    ) {
        let given = self.boundary_vectors.clone();
        let pieces = pieces(neighborhoods, &self.weights);
        let mut active = vec![false; positions.len()];
        // The part of the defect outside the range of the operator does not depend on μ.
        let mut defect = self.defect(neighborhoods);
        for piece in pieces.iter().filter(|piece| piece.len() >= smallest) {
            for &node in piece {
                active[node as usize] = true;
            }
            let shift = make_solvable(positions, piece, spread, &mut defect);
            for (&node, shift) in piece.iter().zip(shift) {
                self.boundary_vectors[node as usize] -= shift;
            }
        }
        keep_active(&mut defect, &active);
        let start = largest(&defect);
        let scale = largest(&self.boundary_vectors);
        let face = |most: f64, v: &f64| most.max(v.cbrt() * v.cbrt());
        let reference = if scale > 0.0 {
            scale
        } else {
            self.volumes.iter().fold(0.0, face)
        };
        let mut iterations = 0;
        if start > self.settings.tolerance * reference {
            let operator = Operator::new(self, positions, neighborhoods, &active);
            let bound = self.settings.tolerance * reference;
            let inverse = operator.inverse_diagonal();
            let coarse = if self.settings.coarse_space {
                let takes_part: Vec<bool> = inverse.iter().map(|&d| d > 0.0).collect();
                CoarseSpace::new(&operator, &takes_part, &pieces)
            } else {
                None
            };
            let preconditioner = Preconditioner { inverse, coarse };
            let limit = self.settings.iteration_limit;
            let (change, made) =
                conjugate_gradients(&operator, preconditioner, defect, bound, limit);
            iterations = made;
            drop(operator);
            let before = self.multipliers.clone();
            let after = before.iter().zip(change).map(|(mu, change)| *mu + change);
            self.take_multipliers(after.collect(), positions, neighborhoods);
            let remaining = self.active_defect(neighborhoods, &active);
            if largest(&remaining) > start {
                self.take_multipliers(before, positions, neighborhoods);
            }
        }
        let remaining = self.active_defect(neighborhoods, &active);
        let residual = largest(&remaining) / reference;
        let shifted = given
            .iter()
            .zip(&self.boundary_vectors)
            .map(|(a, b)| (*a - *b).length());
        self.report = SolveReport {
            iterations,
            residual,
            boundary_shift: shifted.fold(0.0, f64::max) / reference,
            converged: residual <= 4.0 * self.settings.tolerance,
        };
    }
}

/// Sets the values of nodes that take no part to zero.
fn keep_active(values: &mut [DVec3], active: &[bool]) {
    for (value, active) in values.iter_mut().zip(active) {
        if !active {
            *value = DVec3::ZERO;
        }
    }
}
