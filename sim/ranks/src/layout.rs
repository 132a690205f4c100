//! Who has which nodes, and what a rank needs to know of others'.

use std::ops::Range;

use phyxel_integrate::SHARED_NODES;

/// Ranges of nodes, one per rank, cut at multiples of [`SHARED_NODES`]; ranks beyond the number of such
/// chunks have none.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Layout {
    /// Starts of the ranges, and the number of nodes.
    starts: Vec<usize>,
}

/// Nodes of one rank and those around them, by their numbers in the body, ascending.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Halo {
    /// In the rows of the rank's own nodes, or with one of these in their row.
    pub(crate) first: Vec<u32>,
    /// In the rows of those, and not among the others.
    pub(crate) second: Vec<u32>,
}

impl Layout {
    /// As even as chunks allow.
    pub(crate) fn new(node_count: usize, ranks: usize) -> Self {
        let chunks = node_count.div_ceil(SHARED_NODES);
        let start = |rank: usize| (rank * chunks / ranks * SHARED_NODES).min(node_count);
        Self {
            starts: (0..=ranks).map(start).collect(),
        }
    }

    pub(crate) fn ranks(&self) -> usize {
        self.starts.len() - 1
    }

    pub(crate) fn range(&self, rank: usize) -> Range<usize> {
        self.starts[rank]..self.starts[rank + 1]
    }

    /// How many chunks of nodes each rank has.
    pub(crate) fn chunks(&self) -> Vec<usize> {
        let all = 0..self.ranks();
        all.map(|rank| self.range(rank).len().div_ceil(SHARED_NODES))
            .collect()
    }

    /// Whose a node is.
    pub(crate) fn rank_of(&self, node: usize) -> usize {
        // Of ranks that start at the same node the last has it: the others have none.
        self.starts[..self.ranks()].partition_point(|&start| start <= node) - 1
    }

    /// The halos of all ranks, by the rows of the graph.
    pub(crate) fn halos<'a>(&self, row: impl Fn(usize) -> &'a [u32]) -> Vec<Halo> {
        let node_count = self.starts[self.ranks()];
        let mut halos = vec![Halo::default(); self.ranks()];
        for (node, at) in (0_u32..).zip(0..node_count) {
            let mine = self.rank_of(at);
            for &other in row(at) {
                let theirs = self.rank_of(other as usize);
                if theirs != mine {
                    halos[mine].first.push(other);
                    halos[theirs].first.push(node);
                }
            }
        }
        for (rank, halo) in halos.iter_mut().enumerate() {
            let own = self.range(rank);
            rise(&mut halo.first);
            let rows = halo.first.iter().flat_map(|&node| row(node as usize));
            let mut second: Vec<u32> = rows.copied().collect();
            rise(&mut second);
            second.retain(|node| {
                !own.contains(&(*node as usize)) && halo.first.binary_search(node).is_err()
            });
            halo.second = second;
        }
        halos
    }
}

fn rise(nodes: &mut Vec<u32>) {
    nodes.sort_unstable();
    nodes.dedup();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_whole_chunks_and_every_node_has_one_rank() {
        for nodes in [0, 1, 1023, 1024, 1025, 6023, 50_000] {
            for ranks in [1, 2, 3, 4, 7, 64] {
                let layout = Layout::new(nodes, ranks);
                assert_eq!(layout.ranks(), ranks);
                let mut next = 0;
                for rank in 0..ranks {
                    let range = layout.range(rank);
                    assert_eq!(range.start, next, "{nodes} on {ranks}");
                    assert!(range.is_empty() || range.start.is_multiple_of(SHARED_NODES));
                    for node in range.clone().step_by(97) {
                        assert_eq!(layout.rank_of(node), rank, "{node} of {nodes} on {ranks}");
                    }
                    next = range.end;
                }
                assert_eq!(next, nodes);
            }
        }
    }

    /// A chain of nodes, each in the rows of its two neighbours, and one one-way pair.
    #[test]
    fn two_layers_are_what_forces_need() {
        let n = 3 * SHARED_NODES;
        let rows: Vec<Vec<u32>> = (0..n as u32)
            .map(|i| match i {
                0 => vec![1, 2500],
                i if i as usize == n - 1 => vec![i - 1],
                i => vec![i - 1, i + 1],
            })
            .collect();
        let halos = Layout::new(n, 3).halos(|node| &rows[node]);
        assert_eq!(halos[0].first, [1024, 2500], "what it reads");
        assert_eq!(halos[0].second, [1025, 2499, 2501]);
        assert_eq!(halos[1].first, [1023, 2048]);
        assert_eq!(halos[1].second, [1022, 2049]);
        assert_eq!(halos[2].first, [0, 2047], "who reads it");
        assert_eq!(halos[2].second, [1, 2046]);
    }
}
