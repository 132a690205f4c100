//! Connected pieces of a cloud, and right-hand sides that each of them can answer.

use glam::{DMat3, DVec3};

use crate::neighborhoods::Neighborhoods;
use crate::parallel::to_u32;
use crate::symmetric::{SymmetricEigen, outer};

/// Connected pieces over the pairs with positive weight, each a rising list of nodes.
pub(super) fn pieces(neighborhoods: &Neighborhoods, weights: &[f64]) -> Vec<Vec<u32>> {
    let count = neighborhoods.node_count();
    let mut seen = vec![false; count];
    let mut pieces = Vec::new();
    for start in 0..count {
        if seen[start] {
            continue;
        }
        seen[start] = true;
        let mut piece = vec![to_u32(start)];
        let mut next = 0;
        while next < piece.len() {
            let node = piece[next] as usize;
            next += 1;
            for pair in neighborhoods.pairs(node) {
                let j = neighborhoods.indices()[pair];
                if weights[pair] > 0.0 && !seen[j as usize] {
                    seen[j as usize] = true;
                    piece.push(j);
                }
            }
        }
        piece.sort_unstable();
        pieces.push(piece);
    }
    pieces
}

/// Takes an affine field off `r` so that `Σ r = 0` and `Σ r ⊗ X = 0` over the piece: first on the
/// nodes of `spread`, then, for what they cannot carry, on all. Returns what was taken off.
pub(super) fn make_solvable(
    positions: &[DVec3],
    piece: &[u32],
    spread: &[bool],
    r: &mut [DVec3],
) -> Vec<DVec3> {
    let mut taken = vec![DVec3::ZERO; piece.len()];
    let touched: Vec<usize> = (0..piece.len())
        .filter(|&k| spread[piece[k] as usize])
        .collect();
    let all: Vec<usize> = (0..piece.len()).collect();
    // The second round on all nodes also removes the round-off of the first.
    for carriers in [&touched, &all] {
        take_affine_part(positions, piece, carriers, r, &mut taken);
    }
    taken
}

/// One round of [`make_solvable`] on the given members of the piece.
#[allow(clippy::cast_precision_loss, reason = "node counts are far below 2^53")]
fn take_affine_part(
    positions: &[DVec3],
    piece: &[u32],
    carriers: &[usize],
    r: &mut [DVec3],
    taken: &mut [DVec3],
) {
    if carriers.is_empty() {
        return;
    }
    let share = (carriers.len() as f64).recip();
    let at = |k: usize| positions[piece[k] as usize];
    let centre = carriers.iter().fold(DVec3::ZERO, |sum, &k| sum + at(k)) * share;
    let mut inertia = DMat3::ZERO;
    for &k in carriers {
        inertia += outer(at(k) - centre, at(k) - centre);
    }
    let eigen = SymmetricEigen::new(&inertia);
    let inverse = eigen.truncated_inverse(eigen.rank(1e-6));
    let mut sum = DVec3::ZERO;
    let mut moment = DMat3::ZERO;
    for k in 0..piece.len() {
        let value = r[piece[k] as usize];
        sum += value;
        moment += outer(value, at(k) - centre);
    }
    let constant = sum * share;
    let linear = moment * inverse;
    for &k in carriers {
        let part = constant + linear * (at(k) - centre);
        r[piece[k] as usize] -= part;
        taken[k] += part;
    }
}
