//! Some nodes and what products with their stiffness read.

use crate::kernel::pairs::{Pair, Pairs};

/// Some nodes that may move while all others are fixed.
#[derive(Debug, Clone)]
pub(crate) struct Subset {
    /// The nodes, ascending.
    pub(crate) nodes: Vec<u32>,
    /// They and all nodes whose rows they appear in, ascending.
    pub(crate) rows: Vec<u32>,
    /// Those and all their neighbours.
    pub(crate) seen: Vec<u32>,
}

impl Subset {
    pub(crate) fn new(pairs: &Pairs, nodes: &[u32]) -> Self {
        let mut marks = Marks::new(pairs.node_count());
        for &node in nodes {
            marks.add(node);
        }
        let nodes = marks.rising();
        for &node in &nodes {
            marks.add_ends(pairs.incoming(node as usize));
        }
        let rows = marks.rising();
        for &node in &rows {
            marks.add_ends(pairs.row(node as usize));
        }
        let seen = marks.rising();
        Self { nodes, rows, seen }
    }
}

/// Position of a node among some that ascend.
pub(crate) fn place_among(nodes: &[u32], node: u32) -> Option<u32> {
    let found = nodes.binary_search(&node).ok();
    found.and_then(|at| u32::try_from(at).ok())
}

/// A set of nodes, one bit each: neighbours of neighbours name a node dozens of times.
struct Marks {
    words: Vec<u64>,
    /// How many they are.
    count: usize,
}

impl Marks {
    fn new(node_count: usize) -> Self {
        Self {
            words: vec![0; node_count.div_ceil(64)],
            count: 0,
        }
    }

    fn add(&mut self, node: u32) {
        let (word, bit) = (&mut self.words[node as usize / 64], 1 << (node % 64));
        self.count += usize::from(*word & bit == 0);
        *word |= bit;
    }

    fn add_ends(&mut self, pairs: &[Pair]) {
        for pair in pairs {
            self.add(pair.to);
        }
    }

    fn rising(&self) -> Vec<u32> {
        let mut nodes = Vec::with_capacity(self.count);
        for (first, word) in (0_u32..).step_by(64).zip(&self.words) {
            let mut left = *word;
            while left != 0 {
                nodes.push(first + left.trailing_zeros());
                left &= left - 1;
            }
        }
        nodes
    }
}

#[cfg(test)]
mod tests {
    use super::Marks;

    proptest::proptest! {
        #[test]
        fn marks_are_the_set_in_order(nodes in proptest::collection::vec(0_u32..200, 0..300)) {
            let mut marks = Marks::new(200);
            for &node in &nodes {
                marks.add(node);
            }
            let expected: Vec<u32> = std::collections::BTreeSet::from_iter(nodes).into_iter().collect();
            let found = marks.rising();
            proptest::prop_assert_eq!(found.capacity(), expected.len());
            proptest::prop_assert_eq!(found, expected);
        }
    }
}
