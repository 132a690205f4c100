//! Connected pieces of a cloud, and right-hand sides that each of them can answer.

use glam::{DMat3, DVec3};

use crate::Neighborhoods;
use crate::parallel::to_u32;
use crate::symmetric::{SymmetricEigen, outer};

/// Connected pieces over the pairs with positive weight, each an ascending list of nodes.
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
            for (pair, j) in neighborhoods.entries(node) {
                if weights[pair] > 0.0 && !seen[j] {
                    seen[j] = true;
                    piece.push(to_u32(j));
                }
            }
        }
        piece.sort_unstable();
        pieces.push(piece);
    }
    pieces
}

/// Centroid of a piece and its inertia `Σ (X − c)(X − c)ᵀ` about it; the reciprocal of its node count first.
pub(super) fn centred(positions: &[DVec3], piece: &[u32]) -> (f64, DVec3, SymmetricEigen) {
    let inverse_count = (piece.len() as f64).recip();
    let at = |node: u32| positions[node as usize];
    let centre = piece.iter().fold(DVec3::ZERO, |sum, &node| sum + at(node)) * inverse_count;
    let mut inertia = DMat3::ZERO;
    for &node in piece {
        inertia += outer(at(node) - centre, at(node) - centre);
    }
    (inverse_count, centre, SymmetricEigen::new(&inertia))
}

/// Takes an affine field off `r` so that `Σ r = 0` and `Σ r ⊗ X = 0` over the piece. Returns what was
/// taken off.
pub(super) fn make_solvable(positions: &[DVec3], piece: &[u32], r: &mut [DVec3]) -> Vec<DVec3> {
    let mut taken = vec![DVec3::ZERO; piece.len()];
    let (inverse_count, centre, eigen) = centred(positions, piece);
    let inverse = eigen.truncated_inverse(eigen.rank(1e-6));
    // The second round removes the round-off of the first.
    for _ in 0..2 {
        let mut sum = DVec3::ZERO;
        let mut moment = DMat3::ZERO;
        for &node in piece {
            let value = r[node as usize];
            sum += value;
            moment += outer(value, positions[node as usize] - centre);
        }
        let constant = sum * inverse_count;
        let linear = moment * inverse;
        for (&node, taken) in piece.iter().zip(&mut taken) {
            let part = constant + linear * (positions[node as usize] - centre);
            r[node as usize] -= part;
            *taken += part;
        }
    }
    taken
}
