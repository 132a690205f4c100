//! The two loops over pairs, once per precision. Everything else is linear in the number of nodes.
//!
//! A pair carries six numbers `z_ij = (g_ij, y_ij)` and a weight, a node a 3×6 matrix. Six f64 fill
//! three two-lane registers of baseline x86-64 without waste; eight f32 (six and the weight) two of
//! four lanes. The loops are not inlined and hand back whole lanes: told to return sums over lanes,
//! the compiler pairs axes instead and shuffles in every step (52 against 94 instructions a pair).

use std::fmt::Debug;

use glam::{DMat3, DVec3};

pub(crate) mod double;
pub(crate) mod single;

/// Displacement of a node and, in the last place, its coefficient `c_i` of zero-energy control.
pub(crate) type Move = [f64; 4];

/// How pairs and node matrices are stored, and the loops over them.
pub(crate) trait Lanes: Copy + Debug + Send + Sync + 'static {
    /// Relative difference up to which weights of one pair count as equal.
    const WEIGHT_TOLERANCE: f64;
    /// Displacements (m) below this count as none.
    const LEAST_DISPLACEMENT: f64;
    /// `z_ij` in a row.
    type Pair: Copy + Debug + Send + Sync;
    /// `z_ji` and `w_ij` in the reversed copy.
    type Incoming: Copy + Debug + Send + Sync;
    /// 3×6 matrix of a node: first what multiplies `g`, then what multiplies `y`.
    type Matrix: Copy + Debug + Send + Sync;

    fn pair(gradient: DVec3, offset: DVec3) -> Self::Pair;
    fn incoming(gradient: DVec3, offset: DVec3, weight: f64) -> Self::Incoming;
    /// From the transposes of both halves: their columns are the rows stored.
    fn matrix(on_gradient: DMat3, on_offset: DMat3) -> Self::Matrix;
    fn pair_gradient(pair: &Self::Pair) -> DVec3;
    fn pair_offset(pair: &Self::Pair) -> DVec3;
    fn incoming_gradient(pair: &Self::Incoming) -> DVec3;
    fn incoming_offset(pair: &Self::Incoming) -> DVec3;
    fn weight(pair: &Self::Incoming) -> f64;

    /// `(sum_j u_ij ⊗ g_ij)ᵀ` and `(sum_j u_ij ⊗ y_ij)ᵀ` of one node.
    fn gather_gradient(
        own: &Move,
        indices: &[u32],
        pairs: &[Self::Pair],
        moves: &[Move],
    ) -> (DMat3, DMat3);

    /// `sum_j [ M_j z_ji + (c_i + c_j) w_ij u_ij ]` of one node.
    fn gather_force(
        own: &Move,
        indices: &[u32],
        incoming: &[Self::Incoming],
        moves: &[Move],
        matrices: &[Self::Matrix],
    ) -> DVec3;
}
