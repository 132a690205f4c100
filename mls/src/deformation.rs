//! Deformation gradients from stencils, with the fallbacks of degenerate neighbourhoods.

use glam::{DMat3, DQuat, DVec3};

use crate::stencil::StencilRank;
use crate::symmetric::outer;

/// Deformation gradient `F_i = ∂x/∂X` at one node from `S = Σ_j (x_j − x_i) ⊗ g_ij`.
///
/// * rank 3: `F = S`;
/// * rank 2 (neighbours in a plane of normal n): `F = S (I − n nᵀ) + n' nᵀ` with n' the unit normal
///   of the deformed plane: a membrane without strain through its thickness;
/// * rank 1 (neighbours on a line t): `F = (S t) tᵀ + R (I − t tᵀ)` with R the smallest rotation
///   that takes t to the deformed line;
/// * rank 0: `F = I`.
///
/// In every case `Fᵀ F` is unchanged by a rigid motion: a rotated body of any rank has no strain.
/// Where a deformed plane or line has collapsed to nothing, the undeformed normal or direction
/// stands in for the missing one.
#[must_use]
pub fn deformation_gradient(sum: DMat3, rank: &StencilRank) -> DMat3 {
    match rank.rank {
        3 => sum,
        2 => {
            let n = rank.axis;
            let (first, second) = n.any_orthonormal_pair();
            let deformed = (sum * first).cross(sum * second);
            let oriented = if first.cross(second).dot(n) < 0.0 {
                -deformed
            } else {
                deformed
            };
            let normal = oriented.try_normalize().unwrap_or(n);
            sum * (DMat3::IDENTITY - outer(n, n)) + outer(normal, n)
        }
        1 => {
            let t = rank.axis;
            let stretched = sum * t;
            let direction = stretched.try_normalize().unwrap_or(t);
            let rotation = DMat3::from_quat(DQuat::from_rotation_arc(t, direction));
            outer(stretched, t) + rotation * (DMat3::IDENTITY - outer(t, t))
        }
        _ => DMat3::IDENTITY,
    }
}

/// `Σ_j (x_j − x_i) ⊗ g_ij` over one row.
///
/// # Panics
/// If the slices differ in length or an index is out of range.
#[must_use]
pub fn gradient_sum(
    positions: &[DVec3],
    node: usize,
    row: &[u32],
    pair_gradients: &[DVec3],
) -> DMat3 {
    assert_eq!(
        row.len(),
        pair_gradients.len(),
        "one gradient per neighbour"
    );
    let mut sum = DMat3::ZERO;
    for (&j, &g) in row.iter().zip(pair_gradients) {
        sum += outer(positions[j as usize] - positions[node], g);
    }
    sum
}
