//! Parallel loops whose results do not depend on the number of threads.
//!
//! Loops over nodes write disjoint outputs; sums run over chunks of a fixed length that are added
//! in order, so that one thread and many give bitwise identical results.

use std::sync::{Mutex, PoisonError};

use glam::DVec3;

use crate::Neighborhoods;

/// Length of the chunks over which sums are formed.
pub(crate) const SUM_CHUNK: usize = 1024;

/// Fewest rows given to one task; below this, starting a task costs more than it saves.
pub(crate) const ROWS_PER_TASK: usize = 256;

/// Hands the numbered parts of something to the threads of the pool, each the next one when it has done one.
///
/// What rayon makes of an iterator is some 3,000 lines of code for the compiler; tasks of a scope are made once.
pub(crate) fn share_out<T>(
    parts: impl ExactSizeIterator<Item = T> + Send,
    work: impl Fn(usize, T) + Sync,
) {
    let tasks = parts.len().min(rayon::current_num_threads());
    let parts = Mutex::new(parts.enumerate());
    on_threads(tasks, &|| {
        loop {
            let next = parts.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some((number, part)) = next else { break };
            work(number, part);
        }
    });
}

fn on_threads(tasks: usize, run: &(dyn Fn() + Sync)) {
    if tasks < 2 {
        return run();
    }
    rayon::scope(|scope| {
        for _ in 1..tasks {
            scope.spawn(|_| run());
        }
        run();
    });
}

/// `answer(i)` for `i` in `0..count`, in order; `per_task` of them are one task.
pub(crate) fn map<T: Send>(
    count: usize,
    per_task: usize,
    answer: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    map_with(count, per_task, |(): &mut (), i| answer(i))
}

/// [`map`] with memory that a task makes once.
pub(crate) fn map_with<T: Send, S: Default>(
    count: usize,
    per_task: usize,
    answer: impl Fn(&mut S, usize) -> T + Sync,
) -> Vec<T> {
    let mut parts: Vec<Vec<T>> = Vec::new();
    parts.resize_with(count.div_ceil(per_task), Vec::new);
    share_out(parts.iter_mut(), |part, out| {
        let mut scratch = S::default();
        let first = part * per_task;
        out.extend((first..(first + per_task).min(count)).map(|i| answer(&mut scratch, i)));
    });
    let mut all = Vec::with_capacity(count);
    for part in &mut parts {
        all.append(part);
    }
    all
}

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
    share_out(tasks.into_iter(), |_, (nodes, start, slots)| {
        for node in nodes {
            let pairs = neighborhoods.pairs(node);
            fill(node, &mut slots[pairs.start - start..pairs.end - start]);
        }
    });
}

/// Sum of `term(i)` for `i` in `0..count`, in a fixed order.
pub(crate) fn ordered_sum(count: usize, term: impl Fn(usize) -> DVec3 + Sync) -> DVec3 {
    let partial = |chunk: usize, sum: &mut DVec3| {
        let first = chunk * SUM_CHUNK;
        for i in first..(first + SUM_CHUNK).min(count) {
            *sum += term(i);
        }
    };
    let mut partials = vec![DVec3::ZERO; count.div_ceil(SUM_CHUNK)];
    share_out(partials.iter_mut(), partial);
    partials.iter().fold(DVec3::ZERO, |sum, &part| sum + part)
}

/// Checked conversion of a count or index to 32 bits.
///
/// # Panics
/// If the value does not fit; callers have checked the size of their input before.
pub(crate) fn to_u32(value: usize) -> u32 {
    u32::try_from(value).expect("sizes were checked against the range of u32 on entry")
}
