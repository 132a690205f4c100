//! Which nodes of a body a rank has, and by what numbers.

use std::ops::Range;

use phyxel::Body;
use phyxel_elastic::WATCHED_NODES;

use crate::layout::Halo;

/// Nodes of a rank, by their numbers in the body.
#[derive(Debug)]
pub(crate) struct Locals {
    /// Own nodes.
    pub(super) own: Range<usize>,
    /// Others, ascending, and how many of them come before the own ones.
    pub(super) ghosts: Vec<u32>,
    below: usize,
    /// Those of them whose rows are cut off, ascending.
    cut_off: Vec<u32>,
}

impl Locals {
    pub(super) fn new(own: Range<usize>, halo: Halo) -> Self {
        let mut ghosts: Vec<u32> = halo.first.iter().chain(&halo.second).copied().collect();
        ghosts.sort_unstable();
        Self {
            below: ghosts.partition_point(|&node| (node as usize) < own.start),
            ghosts,
            own,
            cut_off: halo.second,
        }
    }

    /// Local number of the first own node.
    pub(super) fn first(&self) -> usize {
        self.below.next_multiple_of(WATCHED_NODES)
    }

    pub(super) fn padding(&self) -> usize {
        self.first() - self.below
    }

    /// All but the padding, ascending.
    pub(super) fn nodes(&self) -> Vec<u32> {
        let own = self.own.clone().map(number);
        let (below, above) = self.ghosts.split_at(self.below);
        let below = below.iter().copied();
        below.chain(own).chain(above.iter().copied()).collect()
    }

    /// Values of all, `padding` for what is none; none of a list without any.
    pub(super) fn pick<T: Copy>(&self, list: &[T], padding: T) -> Vec<T> {
        let nodes = self.nodes();
        let values = nodes.iter().filter_map(|node| list.get(*node as usize));
        let padding = vec![padding; if list.is_empty() { 0 } else { self.padding() }];
        padding.into_iter().chain(values.copied()).collect()
    }

    /// The same, with `none` for what is cut off as well.
    pub(super) fn pick_whole<T: Copy>(&self, list: &[T], none: T) -> Vec<T> {
        let mut all = self.pick(list, none);
        if !all.is_empty() {
            for local in self.cut_off.iter().filter_map(|node| self.local_of(*node)) {
                all[local as usize] = none;
            }
        }
        all
    }

    /// Local number of the ghost at a position among them.
    pub(super) fn ghost(&self, at: usize) -> usize {
        if at < self.below {
            self.padding() + at
        } else {
            self.first() + self.own.len() + at - self.below
        }
    }

    /// Local number of a node, if it has one; of a larger node a larger one.
    pub(super) fn local_of(&self, node: u32) -> Option<u32> {
        let at = node as usize;
        if self.own.contains(&at) {
            return Some(number(self.first() + at - self.own.start));
        }
        let at = self.ghosts.binary_search(&node).ok()?;
        Some(number(self.ghost(at)))
    }

    /// The same of a node whose row is whole here.
    pub(super) fn whole(&self, node: u32) -> Option<u32> {
        self.local_of(node).filter(|_| !self.is_cut_off(node))
    }

    /// Whether a row is cut off: it sees nothing, and nobody reads what it gives.
    pub(super) fn is_cut_off(&self, node: u32) -> bool {
        self.cut_off.binary_search(&node).is_ok()
    }

    /// Own ones of nodes that rank 0 sees in every step.
    pub(super) fn watched(&self, watched: &[u32]) -> Vec<(u32, u32)> {
        let own = (0_u32..)
            .zip(watched)
            .filter(|(_, node)| self.own.contains(&(**node as usize)));
        own.map(|(place, &node)| (number(node as usize - self.own.start), place))
            .collect()
    }
}

/// Neighbours of a node that a rank has, by their local numbers, and their pairs in the body.
pub(super) fn row<'a>(
    body: &'a Body,
    locals: &'a Locals,
    node: u32,
) -> impl Iterator<Item = (u32, usize)> + 'a {
    let graph = &body.neighborhoods;
    let all = graph.row(node as usize).iter();
    all.zip(graph.pairs(node as usize))
        .filter_map(|(&other, pair)| Some((locals.local_of(other)?, pair)))
}

/// What a list by nodes of the body says of those nodes of a rank whose rows are whole there, of some.
pub(super) fn of_rank<T>(
    list: impl IntoIterator<Item = (u32, T)>,
    locals: &Locals,
    some: impl Fn(u32) -> bool,
) -> Vec<(u32, T)> {
    let list = list.into_iter().filter(|(node, _)| some(*node));
    list.filter_map(|(node, value)| Some((locals.whole(node)?, value)))
        .collect()
}

/// A count as the graph has it.
pub(crate) fn number(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}
