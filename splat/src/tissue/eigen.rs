//! Eigenvalues of symmetric 3×3 matrices.

use glam::{DMat3, DVec3};

/// Sweeps of Jacobi rotations; convergence is quadratic, five suffice for f64.
const SWEEPS: usize = 8;

/// Eigenvalues in ascending order and the eigenvectors (columns) of a symmetric matrix, by cyclic
/// Jacobi rotations: exact to round-off for near-singular matrices too, where closed forms are not.
#[allow(
    clippy::needless_range_loop,
    reason = "rows and columns are turned in step"
)]
pub(crate) fn symmetric_eigen(matrix: DMat3) -> (DVec3, DMat3) {
    let mut a = matrix.to_cols_array_2d();
    let mut v = DMat3::IDENTITY.to_cols_array_2d();
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = a[p][q];
            if off.abs() <= f64::MIN_POSITIVE {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * off);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let s = t * c;
            for k in 0..3 {
                let (x, y) = (a[k][p], a[k][q]);
                (a[k][p], a[k][q]) = (c * x - s * y, s * x + c * y);
            }
            for k in 0..3 {
                let (x, y) = (a[p][k], a[q][k]);
                (a[p][k], a[q][k]) = (c * x - s * y, s * x + c * y);
            }
            let (vp, vq) = (v[p], v[q]);
            for k in 0..3 {
                v[p][k] = c * vp[k] - s * vq[k];
                v[q][k] = s * vp[k] + c * vq[k];
            }
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    let values = DVec3::from_array(order.map(|i| a[i][i]));
    let [x, y, z] = order.map(|i| DVec3::from_array(v[i]));
    (values, DMat3::from_cols(x, y, z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use testkit::strategies;

    proptest! {
        #[test]
        fn eigenvectors_diagonalise(
            turn in strategies::rotation(),
            values in strategies::vector(3.0),
            flat in proptest::bool::ANY,
        ) {
            let values = if flat { DVec3::new(0.0, values.y, values.z) } else { values };
            let r = DMat3::from_quat(turn);
            let m = r * DMat3::from_diagonal(values) * r.transpose();
            let (found, v) = symmetric_eigen(m);
            prop_assert!(found.x <= found.y && found.y <= found.z);
            let back = v * DMat3::from_diagonal(found) * v.transpose();
            prop_assert!(back.abs_diff_eq(m, 1e-13), "{back} against {m}");
            prop_assert!((v.transpose() * v).abs_diff_eq(DMat3::IDENTITY, 1e-13));
        }
    }
}
