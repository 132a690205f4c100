//! Connected pieces of a cut body.

/// Nodes by connected piece.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pieces {
    /// Piece of each node; pieces are numbered by their lowest node.
    pub piece: Vec<u32>,
    /// Number of nodes of each piece.
    pub sizes: Vec<u32>,
}

/// Finds the pieces that pairs with a factor above 0 hold together.
///
/// # Arguments
/// * `offsets`, `indices` -- the graph's rows, shape `(n + 1)` and `(pairs)`; symmetric.
/// * `factors` -- one per pair.
///
/// # Panics
/// If the slices do not fit each other.
#[must_use]
pub fn connected_pieces(offsets: &[u32], indices: &[u32], factors: &[f64]) -> Pieces {
    assert!(
        !offsets.is_empty(),
        "offsets have one entry more than nodes"
    );
    assert_eq!(indices.len(), factors.len(), "one factor per pair");
    let nodes = offsets.len() - 1;
    let mut piece = vec![u32::MAX; nodes];
    let mut sizes = Vec::new();
    let mut stack = Vec::new();
    for start in 0..nodes {
        if piece[start] != u32::MAX {
            continue;
        }
        let number = crate::obstacle::index32(sizes.len());
        let mut size = 0;
        piece[start] = number;
        stack.push(start);
        while let Some(node) = stack.pop() {
            size += 1;
            for pair in offsets[node] as usize..offsets[node + 1] as usize {
                let next = indices[pair] as usize;
                if factors[pair] > 0.0 && piece[next] == u32::MAX {
                    piece[next] = number;
                    stack.push(next);
                }
            }
        }
        sizes.push(size);
    }
    Pieces { piece, sizes }
}
