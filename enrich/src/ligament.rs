//! Ligaments that nodes do not resolve: what a cut leaves uncut between two parts, thinner than their distance.

use std::collections::BTreeMap;

use crate::factors::PairFactors;
use crate::graph::Graph;
use crate::pieces::Walks;

/// Parts by the number of a walk.
type Ties = BTreeMap<(u32, u32), f64>;

impl PairFactors {
    /// Severs the pairs that alone join two parts of the body, if a cut crosses all of them: they are bent around its
    /// front, and no pair passes through what is left ahead of it, which is thinner than a node spacing. Left to
    /// themselves such pairs, with a fraction of a whole one each, hold what hangs on them and stretch without end.
    ///
    /// A part is what pairs that no cut crosses hold together. One of fewer than `smallest` nodes stays with the part that its
    /// crossed pairs join it to most strongly, by the sum of their factors. `touched` is what the last
    /// [`PairFactors::update`] gave; nodes of pairs that are severed are added to it. The time follows the nodes near the
    /// touched ones, and where a part comes off the size of the smaller one.
    ///
    /// # Panics
    /// If the graph has other numbers of nodes and pairs than that of the start.
    pub(crate) fn sever_ligaments(
        &mut self,
        graph: &Graph<'_>,
        touched: &mut Vec<u32>,
        smallest: usize,
    ) {
        self.check_same(graph);
        if touched.is_empty() {
            return;
        }
        let mut walks = Walks::new(graph.positions.len());
        walks.begin(touched);
        walks.begin(&self.bent_to(graph, touched));
        loop {
            if !walks.stay_apart(|node, reach| self.whole_pairs(graph, node, reach)) {
                return;
            }
            // What is known as a whole may hang on parts that were not looked at.
            let known = walks.reached().filter(|&node| !walks.is_open(node));
            let known: Vec<u32> = known.collect();
            if !walks.begin(&self.bent_to(graph, &known)) {
                break;
            }
        }
        let (mut sizes, mut ties, mut bent) = (BTreeMap::new(), Ties::new(), Vec::new());
        for node in walks.reached() {
            let part = walks.walk_of(node);
            let size = sizes.entry(part).or_insert(0_usize);
            let is_open = walks.is_open(node);
            *size = if is_open { usize::MAX } else { *size + 1 };
            for (pair, factor) in self.crossed_in(graph, node as usize) {
                let there = walks.walk_of(graph.indices[pair]);
                if factor > 0.0 && there != 0 && there != part {
                    *ties.entry((part, there)).or_default() += factor;
                    bent.push(([part, there], node, pair));
                }
            }
        }
        let group = groups(sizes, &ties, smallest);
        for (parts, node, pair) in bent {
            if group[&parts[0]] != group[&parts[1]] {
                self.sever(pair);
                touched.push(node);
            }
        }
        touched.sort_unstable();
        touched.dedup();
    }

    /// Ends of the pairs of a node that no cut crosses.
    fn whole_pairs(&self, graph: &Graph<'_>, node: u32, reach: &mut dyn FnMut(u32)) {
        let mut crossed = self.crossed_in(graph, node as usize).peekable();
        for pair in graph.pairs(node as usize) {
            if crossed.next_if(|&(known, _)| known == pair).is_none() {
                reach(graph.indices[pair]);
            }
        }
    }

    /// Nodes that pairs which are bent around a front join some nodes to, ascending.
    fn bent_to(&self, graph: &Graph<'_>, nodes: &[u32]) -> Vec<u32> {
        let pairs = |&node: &u32| self.crossed_in(graph, node as usize);
        let crossed = nodes.iter().flat_map(pairs);
        let bent = crossed.filter(|(_, factor)| *factor > 0.0);
        let mut ends: Vec<u32> = bent.map(|(pair, _)| graph.indices[pair]).collect();
        ends.sort_unstable();
        ends.dedup();
        ends
    }
}

/// The part that each stays with: those of fewer than `smallest` nodes go to what they hang on most.
fn groups(mut sizes: BTreeMap<u32, usize>, ties: &Ties, smallest: usize) -> BTreeMap<u32, u32> {
    let mut group: BTreeMap<u32, u32> = sizes.keys().map(|&part| (part, part)).collect();
    loop {
        let mut between = Ties::new();
        for ((from, to), factor) in ties {
            let (from, to) = (group[from], group[to]);
            if from != to && sizes[&from] < smallest {
                *between.entry((from, to)).or_default() += factor;
            }
        }
        let ties = between.iter();
        let strongest = ties.max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(a.0)));
        let Some((&(from, to), _)) = strongest else {
            return group;
        };
        for group in group.values_mut().filter(|group| **group == from) {
            *group = to;
        }
        sizes.insert(to, sizes[&to].saturating_add(sizes[&from]));
    }
}
