//! Products with the stiffness of a part of the body, at a cost that follows the part.

use glam::{DMat3, DVec3};

use crate::cut::bond::PartBond;
use crate::cut::front::PartFront;
use crate::kernel::fixed::{Either, set_gradient};
use crate::kernel::nodes::State;
use crate::kernel::pairs::{Pair, Pairs};
use crate::kernel::stale::Stale;
use crate::kernel::tangent;
use crate::model::Elastic;

/// Nodes that may move while all others are held; made by [`Elastic::part`].
#[derive(Debug, Clone)]
pub struct Part {
    /// The nodes, ascending.
    pub(crate) nodes: Vec<u32>,
    /// They and all nodes whose rows they appear in, ascending.
    pub(crate) rows: Vec<u32>,
    /// Those and all their neighbours.
    pub(crate) seen: Vec<u32>,
    /// Bonds that its nodes are in.
    pub(crate) bonds: Vec<PartBond>,
    /// Fronts that its nodes are in.
    pub(crate) fronts: Vec<PartFront>,
    /// Where both end, ascending.
    pub(crate) ends: Vec<u32>,
}

impl Part {
    /// The nodes, ascending.
    #[must_use]
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Nodes whose deformation gradients products within the part read, ascending.
    #[must_use]
    pub fn rows(&self) -> &[u32] {
        &self.rows
    }

    /// Nodes whose positions they read, ascending: where bonds of deficient nodes end, and pairs of nodes beside a cut's front.
    #[must_use]
    pub fn ends(&self) -> &[u32] {
        &self.ends
    }

    fn with_ends(mut self, state: &State) -> Self {
        let mut ends = state.bonds.ends_of(&self.bonds);
        ends.extend(state.fronts.ends_of(&self.fronts));
        ends.sort_unstable();
        ends.dedup();
        self.ends = ends;
        self
    }

    /// A place in the order of [`Part::ends`], by its node.
    fn end(&self, node: u32) -> Option<usize> {
        self.ends.binary_search(&node).ok()
    }

    fn new(pairs: &Pairs, nodes: &[u32]) -> Self {
        let mut marks = Marks::new(pairs.node_count());
        for &node in nodes {
            marks.add(node);
        }
        let nodes = marks.rising();
        for &node in &nodes {
            marks.add_ends(pairs.incoming(node as usize));
        }
        let reading = marks.rising();
        for &node in &reading {
            marks.add_ends(pairs.row(node as usize));
        }
        let seen = marks.rising();
        Self {
            nodes,
            rows: reading,
            seen,
            bonds: Vec::new(),
            fronts: Vec::new(),
            ends: Vec::new(),
        }
    }
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

impl Elastic {
    /// Prepares products with the stiffness of some nodes, in any order, while all others are held.
    ///
    /// # Panics
    /// If a node does not exist.
    #[must_use]
    pub fn part(&self, nodes: &[u32]) -> Part {
        Part::new(&self.model.pairs, nodes)
            .with_bonds(&self.state)
            .with_fronts(&self.state.fronts)
            .with_ends(&self.state)
    }

    /// Takes over what products within a part read, as another model of the same nodes evaluated it:
    /// deformation gradients of [`Part::rows`] and positions (m) of [`Part::ends`]. What was evaluated here
    /// before is no longer of one state, until the next [`Elastic::forces_into`]. What mean dilatation and
    /// viscous materials need besides is not told.
    ///
    /// # Panics
    /// If a slice is not as long as there are such nodes, or the part is another model's.
    pub fn set_part_state(&mut self, part: &Part, gradients: &[DMat3], positions: &[DVec3]) {
        assert_eq!(gradients.len(), part.rows.len(), "one gradient per row");
        assert_eq!(positions.len(), part.ends.len(), "one place per end");
        for (&node, &gradient) in part.rows.iter().zip(gradients) {
            set_gradient(&mut self.tables.deformation, node as usize, gradient);
        }
        let place = |node: u32| part.end(node).map_or(DVec3::ZERO, |at| positions[at]);
        self.state.bonds.set_part(&part.bonds, place);
        let rest = &self.model.rest;
        let displacement = |node: u32| place(node) - rest[node as usize];
        self.state.fronts.set_part(&part.fronts, displacement);
        self.scratch.stale = Stale::everything();
    }

    /// Writes the part's rows of `K v`, see [`Elastic::tangent_product_into`], with `v` zero outside of
    /// the part. The largest eigenvalue of what this gives is never above that of the whole.
    ///
    /// The time follows the part, but for a body with mean dilatation, where it is that of the whole.
    ///
    /// # Panics
    /// If a slice is not as long as there are nodes in the part, or the part is another model's.
    pub fn tangent_product_within(&mut self, part: &Part, vector: &[DVec3], product: &mut [DVec3]) {
        assert_eq!(vector.len(), part.nodes.len(), "one vector per node");
        assert_eq!(product.len(), part.nodes.len(), "one product per node");
        let parts = (&self.model, &self.state, &mut self.scratch);
        match self.tables.split() {
            Either::Plain(table) => tangent::product_within(parts, table, part, vector, product),
            Either::Corrected(table) => {
                tangent::product_within(parts, table, part, vector, product);
            }
        }
        let fronts = &self.state.fronts;
        fronts.add_product_within(&part.fronts, vector, product);
        self.scratch
            .stale
            .add_part(part, self.model.means.is_some());
        self.state
            .bonds
            .add_product_within(&part.bonds, vector, product);
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
