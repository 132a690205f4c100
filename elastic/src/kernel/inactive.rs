//! Nodes of which nothing needs to be computed, because nothing near them can move.

use std::ops::Range;

use crate::kernel::pairs::{Pair, Pairs};
use crate::kernel::storage::{BLOCK, CHUNK, bytes_of};
use crate::kernel::worst::Watch;

/// What is left to compute for each node; empty where nothing is held.
#[derive(Debug, Clone, Default)]
pub(crate) struct Inactive(Vec<Resting>);

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Resting {
    /// It or a neighbour may move.
    Moving,
    /// Neither it nor a neighbour moves: no strain.
    Unstrained,
    /// No neighbour has strain either: no force.
    Unloaded,
}

impl Inactive {
    pub(crate) fn new(pairs: &Pairs, held: &[u32]) -> Self {
        if held.is_empty() {
            return Self::default();
        }
        let node_count = pairs.node_count();
        let mut still = vec![Resting::Moving; node_count];
        for &node in held {
            still[node as usize] = Resting::Unstrained;
        }
        // Twice inwards from what moves: once along rows, once against them.
        let inner = |seen: &[Resting], node: usize, others: &[Pair]| {
            let is_still = |node: usize| seen[node] > Resting::Moving;
            is_still(node) && others.iter().all(|pair| is_still(pair.to as usize))
        };
        let unstrained: Vec<Resting> = (0..node_count)
            .map(|node| match inner(&still, node, pairs.row(node)) {
                true => Resting::Unstrained,
                false => Resting::Moving,
            })
            .collect();
        for (node, rest) in still.iter_mut().enumerate() {
            let inner = inner(&unstrained, node, pairs.incoming(node));
            *rest = if inner {
                Resting::Unloaded
            } else {
                unstrained[node]
            };
        }
        Self(still)
    }

    #[inline(always)]
    pub(crate) fn is_unstrained(&self, node: usize) -> bool {
        self.0.get(node).is_some_and(|rest| *rest > Resting::Moving)
    }

    /// Whether all nodes of a range are unstrained.
    pub(crate) fn are_unstrained(&self, nodes: Range<usize>) -> bool {
        let rests = self.0.get(nodes);
        rests.is_some_and(|rests| rests.iter().all(|rest| *rest > Resting::Moving))
    }

    #[inline(always)]
    pub(crate) fn is_unloaded(&self, node: usize) -> bool {
        self.0
            .get(node)
            .is_some_and(|rest| *rest == Resting::Unloaded)
    }

    pub(crate) fn bytes(&self) -> usize {
        bytes_of(&self.0)
    }
}

/// Blocks of a chunk of which an evaluation would find what the one before it found: all of their nodes are
/// unstrained, and had neither energy nor force nor anything to record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asleep {
    /// One bit per block.
    blocks: u16,
    /// What was seen of them.
    pub(crate) watch: Watch,
}

const _: () = assert!(CHUNK / BLOCK == 16, "one bit per block");

impl Asleep {
    pub(crate) const NONE: Self = Self {
        blocks: 0,
        watch: Watch::NOTHING,
    };

    #[inline(always)]
    pub(crate) fn holds(&self, block: usize) -> bool {
        self.blocks >> block & 1 > 0
    }

    pub(crate) fn add(&mut self, block: usize, watch: Watch) {
        self.blocks |= 1 << block;
        self.watch = self.watch.and(watch);
    }
}
