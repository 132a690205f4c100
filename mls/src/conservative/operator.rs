//! The system for μ: its matrix-free product.
//!
//! `(Eᵀ D E) μ = r` with `(E μ)_ij = e_ij(μ)`, `D_ij = V_i² w_ij` on rows of rank 3 and 0 on the
//! others, and `r_j = b_j − Σ_i V_i g0_ij`. The product is two gathers: per row `H_i`, then
//! `y_j = Σ_i D_ij e_ij − Σ_k D_jk e_jk`; the third term of `Eᵀ` vanishes because
//! `Σ_j w_ij e_ij X_ijᵀ = 0`. The null space holds the affine fields of every connected piece.

use std::hint::black_box;

use glam::{DMat3, DVec3};
use pulp::{Arch, Simd, WithSimd};

use super::Setup;
use crate::Neighborhoods;
use crate::parallel::{ROWS_PER_TASK, SUM_CHUNK, map, share_out};

/// The operator `Eᵀ D E` on one cloud.
pub(super) struct Operator<'a> {
    pub(super) positions: &'a [DVec3],
    pub(super) neighborhoods: &'a Neighborhoods,
    pub(super) weights: &'a [f64],
    /// `w_ji` at the position of pair (i, j).
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
pub(super) struct Workspace {
    states: Vec<State>,
    terms: Vec<RowTerm>,
    arch: Arch,
}

impl<'a> Operator<'a> {
    pub(super) fn new(setup: &Setup<'a>) -> Self {
        let (positions, neighborhoods) = (setup.positions, setup.neighborhoods);
        let weights = setup.weights;
        let scale = setup.scales().iter().map(|v| v * v).collect();
        let first_moments = map(positions.len(), ROWS_PER_TASK, |i| {
            let parts = setup.row(i);
            let parts = parts.pairs().map(|(_, x, w)| x * w);
            parts.fold(DVec3::ZERO, |sum, part| sum + part)
        });
        let reverse = setup.reverse;
        let back = |pair| weights[reverse[pair] as usize];
        Self {
            positions,
            neighborhoods,
            weights,
            back_weights: map(reverse.len(), 4 * SUM_CHUNK, back),
            moment_inverses: setup.inverses,
            scale,
            first_moments,
        }
    }

    pub(super) fn workspace(&self) -> Workspace {
        let state = |(x, scale): (&DVec3, &f64)| State([0.0, 0.0, 0.0, *scale, x.x, x.y, x.z, 0.0]);
        Workspace {
            states: self.positions.iter().zip(&self.scale).map(state).collect(),
            terms: vec![RowTerm([[0.0; 4]; 3]); self.positions.len()],
            arch: Arch::new(),
        }
    }

    /// `y = Eᵀ D E μ`.
    pub(super) fn apply(&self, mu: &[DVec3], work: &mut Workspace, y: &mut [DVec3]) {
        let Workspace {
            states,
            terms,
            arch,
        } = work;
        let parts = states.chunks_mut(SUM_CHUNK).zip(mu.chunks(SUM_CHUNK));
        share_out(parts, |_, (states, mu)| {
            for (state, mu) in states.iter_mut().zip(mu) {
                [state.0[0], state.0[1], state.0[2]] = mu.to_array();
            }
        });
        let states: &[State] = states;
        share_out(terms.chunks_mut(ROWS_PER_TASK), |chunk, terms| {
            arch.dispatch(Terms {
                operator: self,
                states,
                first: chunk * ROWS_PER_TASK,
                terms,
            });
        });
        let terms: &[RowTerm] = terms;
        share_out(y.chunks_mut(ROWS_PER_TASK), |chunk, y| {
            arch.dispatch(Product {
                operator: self,
                states,
                terms,
                first: chunk * ROWS_PER_TASK,
                y,
            });
        });
    }

    /// Reciprocal diagonal of `Eᵀ D E`, 0 where there is none: `V_j² (W_j − m_jᵀ A_j⁻¹ m_j) + Σ_i V_i² w_ij (1 − w_ij X_ijᵀ A_i⁻¹ X_ij)`.
    pub(super) fn inverse_diagonal(&self) -> Vec<f64> {
        map(self.positions.len(), ROWS_PER_TASK, |j| {
            let m = self.first_moments[j];
            let mut total = 0.0;
            let mut others = 0.0;
            for (pair, i) in self.neighborhoods.entries(j) {
                total += self.weights[pair];
                let w = self.back_weights[pair];
                let x = self.positions[j] - self.positions[i];
                let own = w * x.dot(self.moment_inverses[i] * x);
                others += self.scale[i] * w * (1.0 - own).max(0.0);
            }
            let row = total - m.dot(self.moment_inverses[j] * m);
            let inverse = (self.scale[j] * row.max(0.0) + others).recip();
            if inverse.is_finite() { inverse } else { 0.0 }
        })
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
                let factor = w * other[3];
                for k in 0..4 {
                    direct[k] += factor * d[k];
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
