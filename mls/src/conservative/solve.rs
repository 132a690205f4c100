//! The system for μ: matrix-free product and conjugate gradients.
//!
//! `(Eᵀ D E) μ = r` with `(E μ)_ij = e_ij(μ)`, `D_ij = V_i² w_ij` on rows of rank 3 and 0 on the
//! others, and `r_j = b_j − Σ_i V_i g0_ij`. The product is two gathers: per row `H_i`, then
//! `y_j = Σ_i D_ij e_ij − Σ_k D_jk e_jk`; the third term of `Eᵀ` vanishes because
//! `Σ_j w_ij e_ij X_ijᵀ = 0`. The null space holds the affine fields of every connected piece.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::coarse::CoarseSpace;
use super::pieces::{make_solvable, pieces};
use super::{ConservativeStencils, SolveReport};
use crate::neighborhoods::Neighborhoods;
use crate::parallel::{ROWS_PER_TASK, SUM_CHUNK, ordered_sum};
use crate::symmetric::outer;

/// The operator `Eᵀ D E` on one cloud.
pub(super) struct Operator<'a> {
    pub(super) positions: &'a [DVec3],
    pub(super) neighborhoods: &'a Neighborhoods,
    pub(super) weights: &'a [f64],
    reverse: &'a [u32],
    pub(super) moment_inverses: &'a [DMat3],
    /// `V_i²`, zero on rows that take no part.
    pub(super) scale: Vec<f64>,
    /// `m_i = Σ_j w_ij X_ij`.
    first_moments: Vec<DVec3>,
}

/// Per row: `V_i² H_i` and the row's own term `Σ_k D_ik e_ik`.
#[derive(Clone, Copy)]
struct RowTerm {
    tensor: DMat3,
    own: DVec3,
}

impl<'a> Operator<'a> {
    fn new(
        stencils: &'a ConservativeStencils,
        positions: &'a [DVec3],
        neighborhoods: &'a Neighborhoods,
        active: &[bool],
    ) -> Self {
        let scale = (0..positions.len())
            .map(|i| {
                let taking_part = active[i] && stencils.ranks[i].rank == 3;
                if taking_part {
                    stencils.volumes[i] * stencils.volumes[i]
                } else {
                    0.0
                }
            })
            .collect();
        let first_moments = (0..positions.len())
            .into_par_iter()
            .with_min_len(ROWS_PER_TASK)
            .map(|i| {
                let mut sum = DVec3::ZERO;
                for pair in neighborhoods.pairs(i) {
                    let j = neighborhoods.indices()[pair] as usize;
                    sum += (positions[j] - positions[i]) * stencils.weights[pair];
                }
                sum
            })
            .collect();
        Self {
            positions,
            neighborhoods,
            weights: &stencils.weights,
            reverse: &stencils.reverse,
            moment_inverses: &stencils.moment_inverses,
            scale,
            first_moments,
        }
    }

    /// `y = Eᵀ D E μ`.
    fn apply(&self, mu: &[DVec3], terms: &mut [RowTerm], y: &mut [DVec3]) {
        let indices = self.neighborhoods.indices();
        terms
            .par_iter_mut()
            .enumerate()
            .with_min_len(ROWS_PER_TASK)
            .for_each(|(i, term)| {
                if self.scale[i] == 0.0 {
                    *term = RowTerm {
                        tensor: DMat3::ZERO,
                        own: DVec3::ZERO,
                    };
                    return;
                }
                let mut tensor = DMat3::ZERO;
                let mut sum = DVec3::ZERO;
                for pair in self.neighborhoods.pairs(i) {
                    let j = indices[pair] as usize;
                    let wd = (mu[j] - mu[i]) * self.weights[pair];
                    tensor += outer(wd, self.positions[j] - self.positions[i]);
                    sum += wd;
                }
                let tensor = tensor * self.moment_inverses[i] * self.scale[i];
                *term = RowTerm {
                    tensor,
                    own: sum * self.scale[i] - tensor * self.first_moments[i],
                };
            });
        let terms: &[RowTerm] = terms;
        y.par_iter_mut()
            .enumerate()
            .with_min_len(ROWS_PER_TASK)
            .for_each(|(j, y)| {
                let mut sum = -terms[j].own;
                for pair in self.neighborhoods.pairs(j) {
                    let i = indices[pair] as usize;
                    let w = self.weights[self.reverse[pair] as usize];
                    let x = self.positions[j] - self.positions[i];
                    let e = (mu[j] - mu[i]) * self.scale[i] - terms[i].tensor * x;
                    sum += e * w;
                }
                *y = sum;
            });
    }

    /// Diagonal of `Eᵀ D E`: `V_j² (W_j − m_jᵀ A_j⁻¹ m_j) + Σ_i V_i² w_ij (1 − w_ij X_ijᵀ A_i⁻¹ X_ij)`.
    fn diagonal(&self) -> Vec<f64> {
        let indices = self.neighborhoods.indices();
        (0..self.positions.len())
            .into_par_iter()
            .with_min_len(ROWS_PER_TASK)
            .map(|j| {
                let m = self.first_moments[j];
                let mut total = 0.0;
                let mut others = 0.0;
                for pair in self.neighborhoods.pairs(j) {
                    total += self.weights[pair];
                    let i = indices[pair] as usize;
                    let w = self.weights[self.reverse[pair] as usize];
                    let x = self.positions[j] - self.positions[i];
                    let own = w * x.dot(self.moment_inverses[i] * x);
                    others += self.scale[i] * w * (1.0 - own).max(0.0);
                }
                let row = total - m.dot(self.moment_inverses[j] * m);
                self.scale[j] * row.max(0.0) + others
            })
            .collect()
    }
}

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
    /// If the neighbourhoods are not those of the set-up.
    #[must_use]
    pub fn conservation_error(&self, neighborhoods: &Neighborhoods) -> f64 {
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
            let coarse = if self.settings.coarse_space {
                CoarseSpace::new(&operator, &pieces)
            } else {
                None
            };
            let limit = self.settings.iteration_limit;
            let (change, made) =
                conjugate_gradients(&operator, coarse.as_ref(), defect, bound, limit);
            iterations = made;
            drop(operator);
            let before = self.multipliers.clone();
            for (mu, change) in self.multipliers.iter_mut().zip(change) {
                *mu += change;
            }
            self.rebuild_all(positions, neighborhoods);
            let remaining = self.active_defect(neighborhoods, &active);
            if largest(&remaining) > start {
                self.multipliers = before;
                self.rebuild_all(positions, neighborhoods);
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

/// Length of the longest vector; NaN counts as infinite.
fn largest(values: &[DVec3]) -> f64 {
    values.iter().fold(0.0_f64, |most, value| {
        let length = value.length();
        if length.is_nan() {
            f64::INFINITY
        } else {
            most.max(length)
        }
    })
}

/// Conjugate gradients for three right-hand sides at once, preconditioned by Jacobi plus the coarse
/// space where there is one.
///
/// Returns the iterate of smallest residual and the number of iterations; stops when
/// `max |residual| ≤ bound`, at the limit, when all three directions have broken down, and when the
/// residual has grown or stood still for long: a right-hand side outside the operator's range makes
/// the iterates grow without bound.
fn conjugate_gradients(
    operator: &Operator<'_>,
    coarse: Option<&CoarseSpace>,
    mut residual: Vec<DVec3>,
    bound: f64,
    limit: usize,
) -> (Vec<DVec3>, usize) {
    let count = residual.len();
    let inverse: Vec<f64> = operator
        .diagonal()
        .iter()
        .map(|&d| {
            if d > 0.0 && d.recip().is_finite() {
                d.recip()
            } else {
                0.0
            }
        })
        .collect();
    let precondition = |residual: &[DVec3], out: &mut [DVec3]| {
        out.par_iter_mut()
            .zip(residual.par_iter().zip(inverse.par_iter()))
            .with_min_len(SUM_CHUNK)
            .for_each(|(z, (r, d))| *z = *r * *d);
        if let Some(coarse) = coarse {
            coarse.add_correction(residual, out);
        }
    };
    let mut solution = vec![DVec3::ZERO; count];
    let mut conditioned = vec![DVec3::ZERO; count];
    precondition(&residual, &mut conditioned);
    let mut direction = conditioned.clone();
    let mut product = vec![DVec3::ZERO; count];
    let mut terms = vec![
        RowTerm {
            tensor: DMat3::ZERO,
            own: DVec3::ZERO
        };
        count
    ];
    let mut energy = ordered_sum(count, |i| residual[i] * conditioned[i]);
    let mut best = Best {
        size: largest(&residual),
        at: 0,
        solution: solution.clone(),
    };
    for iteration in 0..limit {
        let size = largest(&residual);
        if size <= bound {
            return (solution, iteration);
        }
        if size < best.size * WORTH_KEEPING {
            best = Best {
                size,
                at: iteration,
                solution: solution.clone(),
            };
        }
        if size > best.size * HOPELESS_GROWTH || iteration > best.at + PATIENCE {
            return (best.solution, iteration);
        }
        operator.apply(&direction, &mut terms, &mut product);
        let curvature = ordered_sum(count, |i| direction[i] * product[i]);
        let alpha = ratio(energy, curvature);
        if alpha == DVec3::ZERO {
            return (best.solution, iteration);
        }
        solution
            .par_iter_mut()
            .zip(residual.par_iter_mut())
            .zip(direction.par_iter().zip(product.par_iter()))
            .with_min_len(SUM_CHUNK)
            .for_each(|((x, r), (p, q))| {
                *x += alpha * *p;
                *r -= alpha * *q;
            });
        precondition(&residual, &mut conditioned);
        let next = ordered_sum(count, |i| residual[i] * conditioned[i]);
        let beta = ratio(next, energy);
        energy = next;
        direction
            .par_iter_mut()
            .zip(conditioned.par_iter())
            .with_min_len(SUM_CHUNK)
            .for_each(|(p, z)| *p = *z + beta * *p);
    }
    (best.solution, limit)
}

/// The best iterate so far.
struct Best {
    size: f64,
    at: usize,
    solution: Vec<DVec3>,
}

/// Factor by which a residual must fall for its iterate to be kept.
const WORTH_KEEPING: f64 = 0.8;

/// Growth of the residual over the best one that ends the iteration. The residual of a solvable
/// system swings by far less: up to 1e3 was seen on graded clouds.
const HOPELESS_GROWTH: f64 = 1e5;

/// Iterations without a better iterate that end the iteration.
const PATIENCE: usize = 400;

/// Componentwise quotient, 0 where the divisor is not positive.
fn ratio(a: DVec3, b: DVec3) -> DVec3 {
    let part = |a: f64, b: f64| {
        if b > 0.0 && (a / b).is_finite() {
            a / b
        } else {
            0.0
        }
    };
    DVec3::new(part(a.x, b.x), part(a.y, b.y), part(a.z, b.z))
}
