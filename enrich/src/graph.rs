//! Who is coupled with whom, and how far.

use std::ops::Range;

use glam::DVec3;

use crate::index::Bounds;
use crate::obstacle::index32;
use crate::rule::Rule;

/// Nodes and pairs of a body, as their owner has them.
#[derive(Debug, Clone, Copy)]
pub struct Graph<'a> {
    /// Rest positions (m), shape `(n)`, finite.
    pub positions: &'a [DVec3],
    /// Start of each row, shape `(n + 1)`.
    pub offsets: &'a [u32],
    /// Neighbours, shape `(pairs)`; rows sorted, symmetric, without self.
    pub indices: &'a [u32],
}

impl Graph<'_> {
    /// Positions of a node's pairs in the indices.
    pub(crate) fn pairs(&self, node: usize) -> Range<usize> {
        self.offsets[node] as usize..self.offsets[node + 1] as usize
    }

    /// Neighbours of a node.
    pub(crate) fn row(&self, node: usize) -> &[u32] {
        &self.indices[self.pairs(node)]
    }

    /// The pair from one node to another.
    pub(crate) fn pair(&self, node: u32, neighbor: u32) -> usize {
        let place = self.row(node as usize).binary_search(&neighbor);
        self.offsets[node as usize] as usize + place.expect("checked to be symmetric when built")
    }

    /// # Panics
    /// If the slices are not as stated.
    pub(crate) fn check(&self) {
        let (nodes, offsets) = (self.positions.len(), self.offsets);
        assert_eq!(offsets.len(), nodes + 1, "one row per node, and the end");
        assert_eq!(
            offsets[nodes] as usize,
            self.indices.len(),
            "rows fill the indices"
        );
        for i in 0..nodes {
            assert!(
                offsets[i] <= offsets[i + 1],
                "row {i} ends before it starts"
            );
            let row = self.row(i);
            assert!(
                row.windows(2).all(|w| w[0] < w[1]),
                "row {i} is not sorted or has a neighbour twice"
            );
            for &j in row {
                assert!(
                    (j as usize) < nodes && j as usize != i,
                    "row {i} names node {j}"
                );
                assert!(
                    self.row(j as usize).binary_search(&index32(i)).is_ok(),
                    "pair ({i}, {j}) has no opposite"
                );
            }
        }
    }
}

/// Coupling distance of a node; that of a pair is the mean of its two nodes'.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reach {
    /// This multiple of the mean length of the node's pairs.
    Neighbors(f64),
    /// The same length (m) for all nodes.
    Length(f64),
}

impl Reach {
    /// Coupling distance (m) of one node.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn of(self, graph: &Graph<'_>, node: usize) -> f64 {
        let scale = match self {
            Self::Neighbors(scale) => scale,
            Self::Length(length) => return length,
        };
        let (x, row) = (graph.positions[node], graph.row(node));
        let total: f64 = row
            .iter()
            .map(|&j| x.distance(graph.positions[j as usize]))
            .sum();
        #[allow(clippy::cast_precision_loss, reason = "a row is short")]
        let count = row.len().max(1) as f64;
        scale * total / count
    }

    /// Coupling distance (m) of the pair between two nodes.
    pub(crate) fn of_pair(self, graph: &Graph<'_>, i: usize, j: usize) -> f64 {
        0.5 * (self.of(graph, i) + self.of(graph, j))
    }
}

/// Boxes round runs of consecutive nodes and round what their pairs ask of a cut: the pairs near a
/// new piece are found through them without a word per node.
///
/// About `4 √n` boxes over runs of `√n / 4` nodes: a search looks at all boxes and at the nodes of
/// the few that it meets. Where consecutive nodes are far from each other it looks at every node;
/// it is exact in any order.
#[derive(Debug, Clone)]
pub(crate) struct Runs {
    nodes: usize,
    length: usize,
    runs: Vec<Run>,
}

#[derive(Debug, Clone, Copy)]
struct Run {
    /// Box round the nodes.
    bounds: Bounds,
    /// Distance (m) from each of these nodes beyond which a piece can change none of its pairs.
    span: f64,
}

impl Runs {
    pub(crate) fn new(graph: &Graph<'_>, reach: Reach) -> Self {
        let nodes = graph.positions.len();
        let reaches: Vec<f64> = (0..nodes).map(|node| reach.of(graph, node)).collect();
        let length = (nodes.isqrt() / 4).max(8);
        let runs = (0..nodes)
            .step_by(length)
            .map(|first| {
                let end = (first + length).min(nodes);
                let mut span = 0.0_f64;
                for i in first..end {
                    for &j in graph.row(i) {
                        let j = j as usize;
                        let length = graph.positions[i].distance(graph.positions[j]);
                        let around = 0.5 * length + Rule::MARGIN * 0.5 * (reaches[i] + reaches[j]);
                        span = span.max(around).max(length);
                    }
                }
                let bounds = Bounds::of(&graph.positions[first..end]);
                Run { bounds, span }
            })
            .collect();
        Self {
            nodes,
            length,
            runs,
        }
    }

    /// Calls `f` for every node that is not too far from the box for a piece in it to change a pair.
    pub(crate) fn for_nodes(&self, graph: &Graph<'_>, near: &Bounds, mut f: impl FnMut(usize)) {
        for (k, run) in self.runs.iter().enumerate() {
            if !run.bounds.grown(run.span).meets(near) {
                continue;
            }
            let first = k * self.length;
            for node in first..(first + self.length).min(self.nodes) {
                if near.distance(graph.positions[node]) <= run.span {
                    f(node);
                }
            }
        }
    }

    /// Number of nodes.
    pub(crate) fn node_count(&self) -> usize {
        self.nodes
    }

    /// Bytes held on the heap.
    pub(crate) fn bytes(&self) -> usize {
        self.runs.capacity() * size_of::<Run>()
    }
}
