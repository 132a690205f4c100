//! Nodes of which nothing needs to be computed, because nothing near them can move.

use crate::pairs::{Pair, Pairs};

/// What is left to compute for each node; empty where nothing is held.
#[derive(Debug, Clone, Default)]
pub(crate) struct Still(Vec<Rest>);

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rest {
    /// It or a neighbour may move.
    Moving,
    /// Neither it nor a neighbour moves: no strain.
    Unstrained,
    /// No neighbour has strain either: no force.
    Unloaded,
}

impl Still {
    pub(crate) fn new(pairs: &Pairs, held: &[u32]) -> Self {
        if held.is_empty() {
            return Self::default();
        }
        let node_count = pairs.node_count();
        let mut still = vec![Rest::Moving; node_count];
        for &node in held {
            still[node as usize] = Rest::Unstrained;
        }
        // Twice inwards from what moves: once along rows, once against them.
        let inner = |seen: &[Rest], node: usize, others: &[Pair]| {
            let all = others
                .iter()
                .all(|pair| seen[pair.to as usize] > Rest::Moving);
            seen[node] > Rest::Moving && all
        };
        let unstrained: Vec<Rest> = (0..node_count)
            .map(|node| match inner(&still, node, pairs.row(node)) {
                true => Rest::Unstrained,
                false => Rest::Moving,
            })
            .collect();
        for (node, rest) in still.iter_mut().enumerate() {
            let inner = inner(&unstrained, node, pairs.incoming(node));
            *rest = if inner {
                Rest::Unloaded
            } else {
                unstrained[node]
            };
        }
        Self(still)
    }

    #[inline(always)]
    pub(crate) fn is_unstrained(&self, node: usize) -> bool {
        self.0.get(node).is_some_and(|rest| *rest > Rest::Moving)
    }

    #[inline(always)]
    pub(crate) fn is_unloaded(&self, node: usize) -> bool {
        self.0.get(node).is_some_and(|rest| *rest == Rest::Unloaded)
    }

    /// Heap bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.0.capacity() * size_of::<Rest>()
    }
}
