//! Linear systems.

use glam::DVec3;

/// `x` of `A x = b` by conjugate gradients, preconditioned by a diagonal `D`; `apply` writes `A v`.
///
/// It ends once the square `rᵀ D⁻¹ r` of the residual is no more than `least` of its first.
///
/// # Errors
/// `x` as far as `most` products bring it, and the square over its first.
///
/// # Panics
/// If `diagonal` is shorter than `b`.
pub fn conjugate_gradients(
    mut apply: impl FnMut(&[DVec3], &mut [DVec3]),
    b: Vec<DVec3>,
    diagonal: &[f64],
    least: f64,
    most: usize,
) -> Result<Vec<DVec3>, (Vec<DVec3>, f64)> {
    let mut residual = b;
    let n = residual.len();
    let square = |r: &[DVec3]| (0..n).map(|i| r[i].dot(r[i] / diagonal[i])).sum::<f64>();
    let mut x = vec![DVec3::ZERO; n];
    let mut product = x.clone();
    let mut direction: Vec<DVec3> = (0..n).map(|i| residual[i] / diagonal[i]).collect();
    let first = square(&residual);
    let mut left = first;
    for _ in 0..most {
        if left <= first * least {
            return Ok(x);
        }
        apply(&direction, &mut product);
        let along = direction.iter().zip(&product).map(|(d, p)| d.dot(*p));
        let step = left / along.sum::<f64>();
        for i in 0..n {
            x[i] += direction[i] * step;
            residual[i] -= product[i] * step;
        }
        let next = square(&residual);
        for i in 0..n {
            direction[i] = residual[i] / diagonal[i] + direction[i] * (next / left);
        }
        left = next;
    }
    Err((x, left / first))
}
