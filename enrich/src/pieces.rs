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
/// * `offsets`, `indices` -- the graph's rows, shape `(n + 1)` and `(pairs)`.
/// * `factors` -- one per pair; weights that the factors are in do as well. A pair holds if it does in
///   either direction.
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
    // The lowest node of a piece stands for it; on the way to it every second link is shortened.
    let mut lower: Vec<u32> = (0..crate::obstacle::index32(nodes)).collect();
    let lowest = |lower: &mut [u32], mut node: usize| {
        while lower[node] as usize != node {
            lower[node] = lower[lower[node] as usize];
            node = lower[node] as usize;
        }
        node
    };
    for node in 0..nodes {
        for pair in offsets[node] as usize..offsets[node + 1] as usize {
            if factors[pair] > 0.0 {
                let ends = [node, indices[pair] as usize].map(|end| lowest(&mut lower, end));
                let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
                lower[high] = crate::obstacle::index32(low);
            }
        }
    }
    let mut piece = vec![0; nodes];
    let mut sizes = Vec::new();
    for node in 0..nodes {
        let first = lowest(&mut lower, node);
        piece[node] = if first == node {
            sizes.push(0);
            crate::obstacle::index32(sizes.len() - 1)
        } else {
            piece[first]
        };
        sizes[piece[node] as usize] += 1;
    }
    Pieces { piece, sizes }
}

/// Finds those of some nodes whose piece has fewer than `limit` nodes, by a walk from each of them that
/// ends at the limit: the time does not depend on the size of the body.
///
/// # Arguments
/// * `offsets`, `indices`, `factors` -- as for [`connected_pieces`].
/// * `nodes` -- the nodes to look at.
/// * `limit` -- meant to be small; the time of a walk grows with its square.
///
/// # Panics
/// If the slices do not fit each other or a node is out of range.
#[must_use]
pub fn nodes_in_small_pieces(
    offsets: &[u32],
    indices: &[u32],
    factors: &[f64],
    nodes: &[u32],
    limit: usize,
) -> Vec<u32> {
    assert_eq!(indices.len(), factors.len(), "one factor per pair");
    let mut reached = Vec::new();
    let mut is_small = |start: u32| {
        reached.clear();
        reached.push(start);
        let mut next = 0;
        while next < reached.len() && reached.len() < limit {
            let node = reached[next] as usize;
            next += 1;
            for pair in offsets[node] as usize..offsets[node + 1] as usize {
                if factors[pair] > 0.0 && !reached.contains(&indices[pair]) {
                    reached.push(indices[pair]);
                }
            }
        }
        reached.len() < limit
    };
    nodes
        .iter()
        .copied()
        .filter(|&node| is_small(node))
        .collect()
}
