//! Sums of pass one into lanes.

use crate::kernel::fixed::Fixed;
use crate::kernel::gather::{Sums, sums};
use crate::kernel::lanes::Block;
use crate::kernel::nodes::Model;
use crate::kernel::storage::{Move, at};
use crate::law::arithmetic::Arithmetic;

/// Sums of one node into a lane.
#[inline(always)]
pub(crate) fn gather<A: Arithmetic, const L: usize>(
    model: &Model,
    fixed: Fixed<'_, L>,
    moves: &[Move],
    node: usize,
    lane: usize,
    block: &mut Block<L>,
) {
    // Mean pressures reach nodes without strain, whose own row then counts.
    let found: Sums<L> = if model.inactive.is_unstrained(node) && model.means.is_none() {
        [[0.0; L]; 4]
    } else {
        let row = model.pairs.row(node);
        sums::<A, L>(node, row, fixed.anchors, moves)
    };
    block.take(lane, &found, at(fixed.anchors, node), &moves[node]);
}
