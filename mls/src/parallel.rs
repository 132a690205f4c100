//! Parallel loops whose results do not depend on the number of threads.
//!
//! Loops over nodes write disjoint outputs; sums run over chunks of a fixed length that are added
//! in order, so that one thread and many give bitwise identical results.

use glam::DVec3;
use rayon::prelude::*;

use crate::neighborhoods::Neighborhoods;

/// Length of the chunks over which sums are formed.
pub(crate) const SUM_CHUNK: usize = 1024;

/// Fewest rows given to one task; below this, starting a task costs more than it saves.
pub(crate) const ROWS_PER_TASK: usize = 256;

/// Runs `fill(node, slots of its pairs)` for all nodes in parallel.
pub(crate) fn fill_rows<T: Send>(
    neighborhoods: &Neighborhoods,
    mut slots: &mut [T],
    fill: impl Fn(usize, &mut [T]) + Sync,
) {
    let count = neighborhoods.node_count();
    let mut tasks = Vec::with_capacity(count.div_ceil(ROWS_PER_TASK));
    for first in (0..count).step_by(ROWS_PER_TASK) {
        let nodes = first..(first + ROWS_PER_TASK).min(count);
        let start = neighborhoods.pairs(first).start;
        let (head, tail) = slots.split_at_mut(neighborhoods.pairs(nodes.end - 1).end - start);
        tasks.push((nodes, start, head));
        slots = tail;
    }
    tasks.into_par_iter().for_each(|(nodes, start, slots)| {
        for node in nodes {
            let pairs = neighborhoods.pairs(node);
            fill(node, &mut slots[pairs.start - start..pairs.end - start]);
        }
    });
}

/// Sum of `term(i)` for `i` in `0..count`, in a fixed order.
pub(crate) fn ordered_sum(count: usize, term: impl Fn(usize) -> DVec3 + Sync) -> DVec3 {
    let partial = |chunk: usize| {
        let first = chunk * SUM_CHUNK;
        let mut sum = DVec3::ZERO;
        for i in first..(first + SUM_CHUNK).min(count) {
            sum += term(i);
        }
        sum
    };
    let chunks = count.div_ceil(SUM_CHUNK);
    if chunks < 4 {
        return (0..chunks).fold(DVec3::ZERO, |sum, chunk| sum + partial(chunk));
    }
    let partials: Vec<DVec3> = (0..chunks).into_par_iter().map(partial).collect();
    partials.iter().fold(DVec3::ZERO, |sum, &part| sum + part)
}

/// Checked conversion of a count or index to 32 bits.
///
/// # Panics
/// If the value does not fit; callers have checked the size of their input before.
pub(crate) fn to_u32(value: usize) -> u32 {
    u32::try_from(value).expect("sizes were checked against the range of u32 on entry")
}
