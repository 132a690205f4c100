//! Eigenvalues of symmetric 3×3 matrices and the truncated inverse of moment matrices.

use glam::{DMat3, DVec3};

/// Sweeps after which the cyclic Jacobi iteration has converged for any 3×3 matrix.
const SWEEPS: usize = 12;

/// Eigenvalues and eigenvectors of a symmetric 3×3 matrix, largest eigenvalue first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SymmetricEigen {
    /// Eigenvalues, falling.
    pub(crate) values: [f64; 3],
    /// Unit eigenvectors, orthogonal, `vectors[k]` belongs to `values[k]`.
    pub(crate) vectors: [DVec3; 3],
}

impl SymmetricEigen {
    /// Cyclic Jacobi iteration: `A = Σ_k λ_k v_k v_kᵀ`.
    ///
    /// Exact to round-off also for rank 1, rank 2 and equal eigenvalues, where closed forms fail.
    /// Only the lower triangle is read. Non-finite input gives non-finite eigenvalues.
    #[must_use]
    pub(crate) fn new(matrix: &DMat3) -> Self {
        let mut a = [
            [matrix.x_axis.x, matrix.x_axis.y, matrix.x_axis.z],
            [matrix.x_axis.y, matrix.y_axis.y, matrix.y_axis.z],
            [matrix.x_axis.z, matrix.y_axis.z, matrix.z_axis.z],
        ];
        let mut v = [DVec3::X, DVec3::Y, DVec3::Z];
        for _ in 0..SWEEPS {
            let off = a[0][1].abs() + a[0][2].abs() + a[1][2].abs();
            let size = a[0][0].abs() + a[1][1].abs() + a[2][2].abs();
            if off <= f64::EPSILON * 1e-3 * size {
                break;
            }
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                rotate(&mut a, &mut v, p, q);
            }
        }
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| a[j][j].total_cmp(&a[i][i]));
        Self {
            values: order.map(|k| a[k][k]),
            vectors: order.map(|k| v[k]),
        }
    }

    /// Number of eigenvalues above `tolerance · λ_max`; 0 if the largest is not positive.
    #[must_use]
    pub(crate) fn rank(&self, tolerance: f64) -> usize {
        let bound = self.values[0] * tolerance;
        if self.values[0] > 0.0 {
            self.values.iter().filter(|&&value| value > bound).count()
        } else {
            0
        }
    }

    /// `λ_max / λ_min`; infinite if the smallest is not positive.
    #[must_use]
    pub(crate) fn condition(&self) -> f64 {
        if self.values[2] > 0.0 {
            self.values[0] / self.values[2]
        } else {
            f64::INFINITY
        }
    }

    /// Inverse on the span of the `rank` largest eigenvalues, zero on the rest.
    #[must_use]
    pub(crate) fn truncated_inverse(&self, rank: usize) -> DMat3 {
        let mut inverse = DMat3::ZERO;
        for (value, vector) in self.values.iter().zip(&self.vectors).take(rank) {
            inverse += outer(*vector / *value, *vector);
        }
        inverse
    }
}

/// One Jacobi rotation that makes `a[p][q]` zero.
fn rotate(a: &mut [[f64; 3]; 3], v: &mut [DVec3; 3], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    let r = 3 - p - q;
    let (apq, arp, arq) = (a[p][q], a[r][p], a[r][q]);
    a[p][p] -= t * apq;
    a[q][q] += t * apq;
    a[p][q] = 0.0;
    a[q][p] = 0.0;
    a[r][p] = c * arp - s * arq;
    a[p][r] = a[r][p];
    a[r][q] = s * arp + c * arq;
    a[q][r] = a[r][q];
    let (vp, vq) = (v[p], v[q]);
    v[p] = vp * c - vq * s;
    v[q] = vp * s + vq * c;
}

/// `a bᵀ`.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use testkit::strategies::{rotation, scale};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn reconstructs_any_rank(q in rotation(), s in scale(), a in 0.0..1.0_f64, b in 0.0..1.0_f64, zeros in 0_usize..3) {
            let r = DMat3::from_quat(q);
            let values = [1.0, if zeros > 1 { 0.0 } else { a }, if zeros > 0 { 0.0 } else { b }];
            let m = r * DMat3::from_diagonal(DVec3::from_array(values) * s) * r.transpose();
            let eigen = SymmetricEigen::new(&m);
            let mut back = DMat3::ZERO;
            for k in 0..3 {
                back += outer(eigen.vectors[k] * eigen.values[k], eigen.vectors[k]);
                for l in 0..3 {
                    let unit = if k == l { 1.0 } else { 0.0 };
                    prop_assert!((eigen.vectors[k].dot(eigen.vectors[l]) - unit).abs() < 1e-14);
                }
            }
            let error = (back - m).to_cols_array().iter().fold(0.0_f64, |e, x| e.max(x.abs()));
            prop_assert!(error <= 8.0 * f64::EPSILON * s, "error {error:e} at scale {s:e}");
            prop_assert!(eigen.values[0] >= eigen.values[1] && eigen.values[1] >= eigen.values[2]);
        }
    }
}
