//! Connected pieces of a cut body.

/// Nodes by connected piece.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
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
    let entries = offsets.len();
    assert!(entries > 0, "offsets have one entry more than nodes");
    assert_eq!(indices.len(), factors.len(), "one factor per pair");
    let nodes = entries - 1;
    // The lowest node of a piece stands for it; on the path to it every second link is shortened.
    let mut lower: Vec<u32> = (0..crate::index32(nodes)).collect();
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
                lower[high] = crate::index32(low);
            }
        }
    }
    let mut piece = vec![0; nodes];
    let mut sizes = Vec::new();
    for node in 0..nodes {
        let first = lowest(&mut lower, node);
        piece[node] = if first == node {
            sizes.push(0);
            crate::index32(sizes.len() - 1)
        } else {
            piece[first]
        };
        sizes[piece[node] as usize] += 1;
    }
    Pieces { piece, sizes }
}

/// Whether some nodes of one piece, all pairs between which a cut has severed, are in several now.
///
/// A walk begins at every node and goes one neighbour farther at a time, until all that began in a
/// piece have met or but one of them still finds new nodes: near a cut's front that is around the front,
/// so that the time follows the cut, and where a piece comes off the size of the smaller one.
///
/// # Arguments
/// * `offsets`, `indices`, `factors` -- as for [`connected_pieces`], after the cut.
/// * `touched` -- nodes that include both ends of every pair whose factor became 0.
/// * `piece` -- the pieces of before.
///
/// # Panics
/// If the slices do not fit each other or a node is out of range.
#[must_use]
pub fn is_parted(
    offsets: &[u32],
    indices: &[u32],
    factors: &[f64],
    touched: &[u32],
    piece: &[u32],
) -> bool {
    assert_eq!(indices.len(), factors.len(), "one factor per pair");
    let mut starts: Vec<(u32, u32)> = (touched.iter())
        .map(|&node| (piece[node as usize], node))
        .collect();
    starts.sort_unstable();
    let is_parted = |starts: &[(u32, u32)]| {
        let nodes: Vec<u32> = starts.iter().map(|start| start.1).collect();
        let mut walks = Walks::new(piece.len());
        walks.begin(&nodes);
        walks.stay_apart(|node, reach| {
            for pair in offsets[node as usize] as usize..offsets[node as usize + 1] as usize {
                if factors[pair] > 0.0 {
                    reach(indices[pair]);
                }
            }
        })
    };
    starts.chunk_by(|a, b| a.0 == b.0).any(is_parted)
}

/// Walks from nodes, which become one where they meet.
pub(crate) struct Walks {
    /// Walk that reached a node, counted from one; 0 for none.
    of_node: Vec<u32>,
    /// The walk that each became part of, itself if none.
    into: Vec<u32>,
    /// Nodes that each walk reached last; empty where it became part of another.
    ends: Vec<Vec<u32>>,
}

impl Walks {
    /// None yet, in a graph of so many nodes.
    pub(crate) fn new(nodes: usize) -> Self {
        Self {
            of_node: vec![0; nodes],
            into: vec![0],
            ends: vec![Vec::new()],
        }
    }

    /// Begins walks at those of some nodes that none has reached; whether there are any.
    pub(crate) fn begin(&mut self, nodes: &[u32]) -> bool {
        let before = self.into.len();
        for &node in nodes {
            if self.of_node[node as usize] == 0 {
                let walk = crate::index32(self.into.len());
                self.of_node[node as usize] = walk;
                self.into.push(walk);
                self.ends.push(vec![node]);
            }
        }
        self.into.len() > before
    }

    /// Nodes that walks have reached, ascending.
    pub(crate) fn reached(&self) -> impl Iterator<Item = u32> + '_ {
        let nodes = (0_u32..).zip(&self.of_node);
        nodes.filter(|(_, walk)| **walk != 0).map(|(node, _)| node)
    }

    /// The walk that reached a node, 0 for none.
    pub(crate) fn walk_of(&self, node: u32) -> u32 {
        let mut walk = self.of_node[node as usize];
        while self.into[walk as usize] != walk {
            walk = self.into[walk as usize];
        }
        walk
    }

    /// Whether the walk that reached a node has not seen all there is.
    pub(crate) fn is_open(&self, node: u32) -> bool {
        !self.ends[self.walk_of(node) as usize].is_empty()
    }

    /// Continues until all have met, or all but one have seen all there is; whether several are left.
    /// `neighbors` calls back with each node that a node is joined to.
    pub(crate) fn stay_apart(&mut self, neighbors: impl Fn(u32, &mut dyn FnMut(u32))) -> bool {
        while self.ends.iter().filter(|ends| !ends.is_empty()).count() > 1 {
            // Every walk goes one neighbour farther.
            for walk in 1..self.into.len() {
                for node in std::mem::take(&mut self.ends[walk]) {
                    neighbors(node, &mut |other| self.reach(walk, other));
                }
            }
        }
        let left = (1..self.into.len()).filter(|&walk| self.into[walk] as usize == walk);
        left.count() > 1
    }

    fn root(&mut self, mut walk: u32) -> u32 {
        while self.into[walk as usize] != walk {
            let next = self.into[walk as usize];
            self.into[walk as usize] = self.into[next as usize];
            walk = next;
        }
        walk
    }

    fn reach(&mut self, walk: usize, node: u32) {
        let own = self.root(crate::index32(walk));
        match self.of_node[node as usize] {
            0 => {
                self.of_node[node as usize] = own;
                self.ends[own as usize].push(node);
            }
            other => {
                let other = self.root(other);
                if other != own {
                    let [low, high] = [own.min(other), own.max(other)];
                    self.into[high as usize] = low;
                    let moved = std::mem::take(&mut self.ends[high as usize]);
                    self.ends[low as usize].extend(moved);
                }
            }
        }
    }
}
