//! The system for μ: matrix-free product and conjugate gradients.
//!
//! `(Eᵀ D E) μ = r` with `(E μ)_ij = e_ij(μ)`, `D_ij = V_i² w_ij` on rows of rank 3 and 0 on the
//! others, and `r_j = b_j − Σ_i V_i g0_ij`. The product is two gathers: per row `H_i`, then
//! `y_j = Σ_i D_ij e_ij − Σ_k D_jk e_jk`; the third term of `Eᵀ` vanishes because
//! `Σ_j w_ij e_ij X_ijᵀ = 0`. The null space holds the affine fields of every connected piece.

#![allow(
    clippy::needless_range_loop,
    reason = "lanes and axes are walked in step over several arrays"
)]

use std::hint::black_box;

use glam::{DMat3, DVec3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::coarse::CoarseSpace;
use super::pieces::{make_solvable, pieces};
use super::{ConservativeStencils, SolveReport};
use crate::neighborhoods::Neighborhoods;
use crate::parallel::{ROWS_PER_TASK, SUM_CHUNK, ordered_sum};

/// The operator `Eᵀ D E` on one cloud.
pub(super) struct Operator<'a> {
    pub(super) positions: &'a [DVec3],
    pub(super) neighborhoods: &'a Neighborhoods,
    pub(super) weights: &'a [f64],
    /// `w_ji` at the place of pair (i, j).
    back_weights: Vec<f64>,
    pub(super) moment_inverses: &'a [DMat3],
    /// `V_i²`, zero on rows that take no part.
    pub(super) scale: Vec<f64>,
    /// `m_i = Σ_j w_ij X_ij`.
    first_moments: Vec<DVec3>,
}

/// `μ_i`, `V_i²`, `X_i`, zero: what a neighbour reads of a node, one cache line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
struct State([f64; 8]);

/// Per row: three rows of `V_i² H_i`, and in the last lane the row's own term `Σ_k D_ik e_ik`.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
struct RowTerm([[f64; 4]; 3]);

/// What a product needs besides its input and output.
struct Workspace {
    states: Vec<State>,
    terms: Vec<RowTerm>,
    arch: Arch,
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
        let weights = &stencils.weights;
        let back = |&pair: &u32| weights[pair as usize];
        let back_weights = stencils.reverse.par_iter().with_min_len(4 * SUM_CHUNK);
        Self {
            positions,
            neighborhoods,
            weights,
            back_weights: back_weights.map(back).collect(),
            moment_inverses: &stencils.moment_inverses,
            scale,
            first_moments,
        }
    }

    fn workspace(&self) -> Workspace {
        let state = |(x, scale): (&DVec3, &f64)| State([0.0, 0.0, 0.0, *scale, x.x, x.y, x.z, 0.0]);
        Workspace {
            states: self.positions.iter().zip(&self.scale).map(state).collect(),
            terms: vec![RowTerm([[0.0; 4]; 3]); self.positions.len()],
            arch: Arch::new(),
        }
    }

    /// `y = Eᵀ D E μ`.
    fn apply(&self, mu: &[DVec3], work: &mut Workspace, y: &mut [DVec3]) {
        let Workspace {
            states,
            terms,
            arch,
        } = work;
        states
            .par_iter_mut()
            .zip(mu)
            .with_min_len(SUM_CHUNK)
            .for_each(|(state, mu)| [state.0[0], state.0[1], state.0[2]] = mu.to_array());
        let states: &[State] = states;
        terms
            .par_chunks_mut(ROWS_PER_TASK)
            .enumerate()
            .for_each(|(chunk, terms)| {
                arch.dispatch(Terms {
                    operator: self,
                    states,
                    first: chunk * ROWS_PER_TASK,
                    terms,
                });
            });
        let terms: &[RowTerm] = terms;
        y.par_chunks_mut(ROWS_PER_TASK)
            .enumerate()
            .for_each(|(chunk, y)| {
                arch.dispatch(Product {
                    operator: self,
                    states,
                    terms,
                    first: chunk * ROWS_PER_TASK,
                    y,
                });
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
                    let w = self.back_weights[pair];
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

/// First half of a product for some rows.
struct Terms<'a> {
    operator: &'a Operator<'a>,
    states: &'a [State],
    first: usize,
    terms: &'a mut [RowTerm],
}

impl WithSimd for Terms<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let operator = self.operator;
        for (i, term) in (self.first..).zip(self.terms) {
            let scale = operator.scale[i];
            if scale == 0.0 {
                *term = RowTerm([[0.0; 4]; 3]);
                continue;
            }
            let own = self.states[i].0;
            // Σ w (μ_j − μ_i) (X_ij, 1)ᵀ
            let mut sum = [[0.0; 4]; 3];
            let weights = &operator.weights[operator.neighborhoods.pairs(i)];
            for (&j, &w) in operator.neighborhoods.row(i).iter().zip(weights) {
                let other = &self.states[j as usize].0;
                let z = [
                    w * (other[4] - own[4]),
                    w * (other[5] - own[5]),
                    w * (other[6] - own[6]),
                    w,
                ];
                for r in 0..3 {
                    let d = other[r] - own[r];
                    for k in 0..4 {
                        sum[r][k] += d * z[k];
                    }
                }
            }
            let m = operator.first_moments[i];
            for (row, [x, y, z, total]) in term.0.iter_mut().zip(black_box(sum)) {
                let h = operator.moment_inverses[i] * (DVec3::new(x, y, z) * scale);
                *row = [h.x, h.y, h.z, total * scale - h.dot(m)];
            }
        }
    }
}

/// Second half of a product for some rows.
struct Product<'a> {
    operator: &'a Operator<'a>,
    states: &'a [State],
    terms: &'a [RowTerm],
    first: usize,
    y: &'a mut [DVec3],
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let operator = self.operator;
        for (j, y) in (self.first..).zip(self.y) {
            let own = self.states[j].0;
            let mut bent = [[0.0; 4]; 3];
            let mut direct = [0.0; 4];
            let weights = &operator.back_weights[operator.neighborhoods.pairs(j)];
            for (&i, &w) in operator.neighborhoods.row(j).iter().zip(weights) {
                let (other, term) = (&self.states[i as usize].0, &self.terms[i as usize].0);
                let mut d = [0.0; 8];
                for k in 0..8 {
                    d[k] = own[k] - other[k];
                }
                for r in 0..3 {
                    for k in 0..4 {
                        bent[r][k] += term[r][k] * (w * d[4 + k]);
                    }
                }
                let share = w * other[3];
                for k in 0..4 {
                    direct[k] += share * d[k];
                }
            }
            let (bent, direct) = black_box((bent, direct));
            let part = |r: usize| {
                let [a, b, c, _] = bent[r];
                direct[r] - ((a + b) + c) - self.terms[j].0[r][3]
            };
            *y = DVec3::new(part(0), part(1), part(2));
        }
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
    let mut work = operator.workspace();
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
        operator.apply(&direction, &mut work, &mut product);
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
