//! Forces again after a few rows changed, at a cost that follows the change.

use glam::DVec3;

use crate::kernel::inactive::Asleep;
use crate::kernel::storage::{CHUNK, Move, bytes_of, moved};
use crate::kernel::subset::Subset;

/// What is not as the last evaluation of forces left it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Stale {
    /// Everything may have changed.
    pub(crate) all: bool,
    /// Nodes whose rows, control, strain energy or offset changed, in any order.
    pub(crate) nodes: Vec<u32>,
    /// Nodes whose records a product wrote over.
    pub(crate) records: Vec<u32>,
    /// Nodes whose displacements it wrote over.
    moves: Vec<u32>,
}

impl Stale {
    pub(crate) fn everything() -> Self {
        Self {
            all: true,
            ..Self::default()
        }
    }

    pub(crate) fn add(&mut self, nodes: &[u32]) {
        if !self.all {
            self.nodes.extend_from_slice(nodes);
        }
    }

    /// After a product within a part, which with mean dilatation is one of the whole.
    pub(crate) fn add_part(&mut self, part: &Subset, mean: bool) {
        if mean {
            *self = Self::everything();
        } else if !self.all && !self.records.ends_with(&part.rows) {
            self.records.extend_from_slice(&part.rows);
            self.moves.extend_from_slice(&part.seen);
        }
    }

    /// Whether anything is.
    pub(crate) fn is_some(&self) -> bool {
        self.all || !self.nodes.is_empty()
    }

    /// Wakes chunks of which something changed.
    pub(crate) fn wake(&self, asleep: &mut [Asleep]) {
        if self.all {
            asleep.fill(Asleep::NONE);
        }
        for &node in self.nodes.iter().chain(&self.records) {
            asleep[node as usize / CHUNK] = Asleep::NONE;
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        bytes_of(&self.nodes) + bytes_of(&self.records) + bytes_of(&self.moves)
    }

    /// Whether what is kept of the last evaluation is one at these positions.
    pub(crate) fn is_at(&self, rest: &[DVec3], moves: &[Move], positions: &[DVec3]) -> bool {
        let mut overwritten = vec![false; moves.len()];
        for &node in &self.moves {
            overwritten[node as usize] = true;
        }
        let same = |node: usize| {
            let u = DVec3::from_array(moved(positions[node], rest[node]));
            u == DVec3::from_array(moves[node])
        };
        (0..moves.len()).all(|node| overwritten[node] || same(node))
    }
}
