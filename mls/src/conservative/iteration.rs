//! Preconditioned conjugate gradients for the system for μ.

use glam::DVec3;

use super::coarse::CoarseSpace;
use super::operator::Operator;
use crate::parallel::{SUM_CHUNK, ordered_sum, share_out};

/// Length of the longest vector; NaN counts as infinite.
pub(super) fn largest(values: &[DVec3]) -> f64 {
    values.iter().fold(0.0_f64, |most, value| {
        let length = value.length();
        if length.is_nan() {
            f64::INFINITY
        } else {
            most.max(length)
        }
    })
}

/// Jacobi plus the coarse space where there is one.
pub(super) struct Preconditioner {
    /// Reciprocal diagonal.
    pub(super) inverse: Vec<f64>,
    pub(super) coarse: Option<CoarseSpace>,
}

impl Preconditioner {
    fn apply(&mut self, residual: &[DVec3], out: &mut [DVec3]) {
        let factors = residual
            .chunks(SUM_CHUNK)
            .zip(self.inverse.chunks(SUM_CHUNK));
        share_out(out.chunks_mut(SUM_CHUNK).zip(factors), |_, (z, (r, d))| {
            for (z, (r, d)) in z.iter_mut().zip(r.iter().zip(d)) {
                *z = *r * *d;
            }
        });
        if let Some(coarse) = &mut self.coarse {
            coarse.add_correction(residual, out);
        }
    }
}

/// Conjugate gradients for three right-hand sides at once, preconditioned by Jacobi plus the coarse
/// space where there is one.
///
/// Returns the iterate of smallest residual and the number of iterations; stops when
/// `max |residual| ≤ bound`, at the limit, when all three directions have broken down, and when the
/// residual has grown or stood still for long: a right-hand side outside the operator's range makes
/// the iterates grow without bound.
pub(super) fn conjugate_gradients(
    operator: &Operator<'_>,
    mut preconditioner: Preconditioner,
    mut residual: Vec<DVec3>,
    bound: f64,
    limit: usize,
) -> (Vec<DVec3>, usize) {
    let count = residual.len();
    let [mut solution, mut conditioned, mut product] = [(); 3].map(|()| vec![DVec3::ZERO; count]);
    preconditioner.apply(&residual, &mut conditioned);
    let mut direction = conditioned.clone();
    let mut work = operator.workspace();
    let mut energy = ordered_sum(count, |i| residual[i] * conditioned[i]);
    let (size, at) = (largest(&residual), 0);
    let mut best = Best {
        size,
        at,
        solution: solution.clone(),
    };
    for iteration in 0..limit {
        let size = largest(&residual);
        if size <= bound {
            return (solution, iteration);
        }
        if size < best.size * IMPROVEMENT {
            (best.size, best.at) = (size, iteration);
            best.solution.clone_from(&solution);
        }
        if size > best.size * DIVERGENCE || iteration > best.at + STALL_LIMIT {
            return (best.solution, iteration);
        }
        operator.apply(&direction, &mut work, &mut product);
        let curvature = ordered_sum(count, |i| direction[i] * product[i]);
        let alpha = ratio(energy, curvature);
        if alpha == DVec3::ZERO {
            return (best.solution, iteration);
        }
        let iterates = solution
            .chunks_mut(SUM_CHUNK)
            .zip(residual.chunks_mut(SUM_CHUNK));
        let steps = direction.chunks(SUM_CHUNK).zip(product.chunks(SUM_CHUNK));
        share_out(iterates.zip(steps), |_, ((x, r), (p, q))| {
            for ((x, r), (p, q)) in x.iter_mut().zip(r).zip(p.iter().zip(q)) {
                *x += alpha * *p;
                *r -= alpha * *q;
            }
        });
        preconditioner.apply(&residual, &mut conditioned);
        let next = ordered_sum(count, |i| residual[i] * conditioned[i]);
        let beta = ratio(next, energy);
        energy = next;
        let steps = direction.chunks_mut(SUM_CHUNK);
        share_out(steps.zip(conditioned.chunks(SUM_CHUNK)), |_, (p, z)| {
            for (p, z) in p.iter_mut().zip(z) {
                *p = *z + beta * *p;
            }
        });
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
const IMPROVEMENT: f64 = 0.8;

/// Growth of the residual over the best one that ends the iteration. The residual of a solvable
/// system swings by far less: up to 1e3 was seen on graded clouds.
const DIVERGENCE: f64 = 1e5;

/// Iterations without a better iterate that end the iteration.
const STALL_LIMIT: usize = 400;

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
