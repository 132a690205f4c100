//! The two loops over pairs. Everything else is linear in the number of nodes.
//!
//! A pair carries six numbers `z_ij = (g_ij, y_ij)`, `y_ij = w_ij X_ij`; six f64 fill three
//! two-lane registers of baseline x86-64 without waste, as do the rows of the 3×6 matrices.
#![allow(
    clippy::needless_range_loop,
    reason = "lanes and axes are walked in step over several arrays"
)]

/// Lanes of a pair.
pub(crate) const LANES: usize = 6;

/// `z_ij = (g_ij, w_ij X_ij)`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(16))]
pub(crate) struct PairRow(pub(crate) [f64; LANES]);

/// A 3×6 matrix by rows: first what multiplies `g`, then what multiplies `y`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(16))]
pub(crate) struct NodeRows(pub(crate) [[f64; LANES]; 3]);

/// Displacement of a node and, in the last place, its coefficient `c_i` of zero-energy control.
pub(crate) type Move = [f64; 4];

/// `sum_j u_ij ⊗ z_ij` of one node.
#[inline]
pub(crate) fn gather_gradient(
    own: &Move,
    indices: &[u32],
    pairs: &[PairRow],
    moves: &[Move],
) -> [[f64; LANES]; 3] {
    let mut sum = [[0.0; LANES]; 3];
    for (&j, z) in indices.iter().zip(pairs) {
        let other = &moves[j as usize];
        for r in 0..3 {
            let d = other[r] - own[r];
            for k in 0..LANES {
                sum[r][k] += d * z.0[k];
            }
        }
    }
    sum
}

/// `M_i z_ii + sum_j [ M_j z_ji + (c_i + c_j) w_ij u_ij ]` of one node.
#[inline]
pub(crate) fn gather_force(
    own: &Move,
    own_rows: &NodeRows,
    own_pair: &PairRow,
    indices: &[u32],
    reversed: &[PairRow],
    weights: &[f64],
    moves: &[Move],
    rows: &[NodeRows],
) -> [f64; 3] {
    let mut sum = [[0.0; 2]; 3];
    let mut direct = [0.0; 3];
    for r in 0..3 {
        for k in 0..LANES {
            sum[r][k % 2] += own_rows.0[r][k] * own_pair.0[k];
        }
    }
    for ((&j, z), &w) in indices.iter().zip(reversed).zip(weights) {
        let j = j as usize;
        let (other, m) = (&moves[j], &rows[j]);
        let stiffness = (own[3] + other[3]) * w;
        for r in 0..3 {
            let row = &m.0[r];
            for lane in 0..2 {
                sum[r][lane] += row[lane] * z.0[lane]
                    + row[lane + 2] * z.0[lane + 2]
                    + row[lane + 4] * z.0[lane + 4];
            }
            direct[r] += stiffness * (other[r] - own[r]);
        }
    }
    [
        sum[0][0] + sum[0][1] + direct[0],
        sum[1][0] + sum[1][1] + direct[1],
        sum[2][0] + sum[2][1] + direct[2],
    ]
}
