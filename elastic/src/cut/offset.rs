//! Deformation gradients that are kept over a rebuild of rows.
//!
//! A row of full support does not see its own node's hourglass displacement; the one-sided row that
//! a cut leaves reads it as strain, and energy appears out of nothing. So a rebuilt row keeps the
//! deformation gradient that the node had: `F = F(u) (I + A)`, `A = F_after⁻¹ F_before - I`, and `A`
//! decays. The factor stands on the side of the material: a rotation `Q` of the whole makes
//! `Q F(u) (I + A)`, so forces `V P (I + A)ᵀ g` keep the angular momentum, which those of a sum
//! `F(u) + D` do not. The energy that the decay adds or takes is `∫ V P : F(u) dA`, by the trapezoidal
//! rule over a step.

use glam::{DMat3, DVec3};

use crate::kernel::fixed::Tables;
use crate::kernel::nodes::Model;
use crate::kernel::prestrain::Pull;
use crate::law::tensor::outer;

/// Entries of an offset below this are dropped: a strain of `1e-5` is a stress of `1e-5` of the
/// modulus, and what dropping it adds to the energy is counted like the decay.
pub(crate) const SMALLEST_OFFSET: f64 = 1e-5;
/// Largest `|I + A|` and `|(I + A)⁻¹|` (Frobenius). The first multiplies what a node adds to the stiffness by its
/// square: a row that sees the body all but flat where it was not cannot keep its gradient. Nor can one that sees it
/// blown up, by the second: the decay would do that as work (a node of a strand drawn out 60-fold, read with det F 51,
/// got 22 J where the body stored 12). Of 2, 3, 5 and 8 for the first (no change is 1.7), 3 exceeded the fewest limits in
/// `benches -- matrix` (13 scenes of 48; 2: 18, 5: 16) and none in `random --seed 4045 --count 24` (8: one scene not ended).
const LARGEST_FACTOR: f64 = 3.0;
/// Nodes whose work a thread finds at least: some 10 µs.
pub(crate) const NODES_PER_TASK: usize = 64;

/// Keeps the pulls of some nodes, ascending; whether all of them are there.
pub(crate) fn of_same_nodes(pulls: &mut Vec<(u32, Pull)>, nodes: &[u32]) -> bool {
    let mut next = nodes.iter().peekable();
    pulls.retain(|(node, _)| next.next_if_eq(&node).is_some());
    pulls.len() == nodes.len()
}

/// `I + A` by which a row that gives `now` keeps `before`; `None` where it is too large.
pub(crate) fn factor_between(now: DMat3, before: DMat3) -> Option<DMat3> {
    let factor = now.inverse() * before;
    let is_small = |m: DMat3| {
        let square: f64 = m.to_cols_array().iter().map(|v| v * v).sum();
        square <= LARGEST_FACTOR * LARGEST_FACTOR
    };
    (factor.determinant() > 0.0 && is_small(factor) && is_small(factor.inverse())).then_some(factor)
}

/// `I + sum_j u_ij ⊗ g_ij` of a node with a full row, without its offset.
pub(crate) fn gradient_at(
    model: &Model,
    tables: &Tables,
    node: usize,
    positions: &[DVec3],
) -> DMat3 {
    let displacement = |i: usize| positions[i] - model.rest[i];
    let own = displacement(node);
    let row = tables.row(node, model.pairs.row(node));
    row.fold(DMat3::IDENTITY, |f, (j, _, _, g)| {
        f + outer(displacement(j as usize) - own, g)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_are_kept_by_rows_that_see_much_the_same() {
        let before =
            DMat3::from_diagonal(DVec3::new(60.0, 0.13, 0.13)) * DMat3::from_rotation_z(0.4);
        let seen = |by: DVec3| factor_between(before * DMat3::from_diagonal(by), before);
        let kept = seen(DVec3::new(1.2, 0.8, 0.9)).expect("kept");
        let expected = DVec3::new(1.2, 0.8, 0.9).recip();
        assert!((kept - DMat3::from_diagonal(expected)).abs_diff_eq(DMat3::ZERO, 1e-12));
        for (axis, by) in [(2, 0.3), (0, 3.0), (1, 0.0), (2, -1.0)] {
            let mut lost = DVec3::ONE;
            lost[axis] = by;
            assert_eq!(seen(lost), None, "{lost}");
        }
    }
}
