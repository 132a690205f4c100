//! How what belongs to nodes is laid out, and shared out among threads.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, PoisonError};

use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Nodes whose constants lie together, by component, and are evaluated together.
pub(crate) const BLOCK: usize = 16;

/// One number per node of a block.
pub(crate) type Plane = Sixteen<f64>;

/// A matrix of each node of a block, row by row.
pub(crate) type Planes = [Plane; 9];

/// What belongs to the nodes of a block, node after node, from a cache line's start on: a vector register that is as long
/// as a line is then read from one.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Sixteen<T>(pub(crate) [T; BLOCK]);

impl<T: Copy> Sixteen<T> {
    /// The same for all nodes.
    pub(crate) const fn of(value: T) -> Self {
        Self([value; BLOCK])
    }
}

impl<T> Deref for Sixteen<T> {
    type Target = [T; BLOCK];

    #[inline(always)]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<T> DerefMut for Sixteen<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

/// What is stored of `node` in blocks.
#[inline(always)]
pub(crate) fn at<T>(blocks: &[Sixteen<T>], node: usize) -> &T {
    &blocks[node / BLOCK].0[node % BLOCK]
}

/// Displacement `u_i` (m) of a node, or any vector.
pub(crate) type Move = [f64; 3];

/// A node's matrix of those stored by blocks.
pub(crate) fn gradient(stored: &[Planes], node: usize) -> DMat3 {
    let planes = &stored[node / BLOCK];
    let rows = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|k| planes[k][node % BLOCK]);
    DMat3::from_cols_array(&rows).transpose()
}

/// Replaces one of them.
pub(crate) fn set_gradient(stored: &mut [Planes], node: usize, value: DMat3) {
    let rows = value.transpose().to_cols_array();
    for (plane, value) in stored[node / BLOCK].iter_mut().zip(rows) {
        plane[node % BLOCK] = value;
    }
}

/// Nodes per unit of parallel work, and per partial sum of the energy; blocks divide it.
pub(crate) const CHUNK: usize = 256;
/// Nodes per unit of work that only copies.
const COPY_CHUNK: usize = 4 * CHUNK;
/// Below this many nodes a second thread costs more than it saves: passes are not shared out.
pub const PARALLEL_NODES: usize = 1024;

/// Copies those of all nodes.
pub(crate) fn copy_gradients(parallel: bool, stored: &[Planes], to: &mut [DMat3]) {
    share_out(parallel, to.chunks_mut(COPY_CHUNK), |chunk, to| {
        for (node, to) in (chunk * COPY_CHUNK..).zip(to) {
            *to = gradient(stored, node);
        }
    });
}

pub(crate) fn parallel(node_count: usize) -> bool {
    node_count >= PARALLEL_NODES && rayon::current_num_threads() > 1
}

/// Hands the numbered parts of something to the threads of the pool, or to this one. Each takes the next part when it has
/// done one, every other thread from behind: two threads meet the same parts in every pass.
///
/// Parts are fixed and disjoint: the result does not depend on the number of threads. What rayon makes of an iterator is
/// some 3,000 lines of code for the compiler, so it is made once, for the threads.
pub(crate) fn share_out<T>(
    parallel: bool,
    parts: impl DoubleEndedIterator<Item = T> + ExactSizeIterator + Send,
    work: impl Fn(usize, T) + Sync,
) {
    let mut parts = parts.enumerate();
    if !parallel {
        return parts.for_each(|(number, part)| work(number, part));
    }
    let parts = Mutex::new(&mut parts);
    on_each_thread(&|| {
        let behind = rayon::current_thread_index().is_some_and(|thread| thread % 2 == 1);
        loop {
            let mut left = parts.lock().unwrap_or_else(PoisonError::into_inner);
            let next = if behind {
                left.next_back()
            } else {
                left.next()
            };
            drop(left);
            let Some((number, part)) = next else { break };
            work(number, part);
        }
    });
}

fn on_each_thread(run: &(dyn Fn() + Sync)) {
    let threads = (0..rayon::current_num_threads()).into_par_iter();
    threads.with_max_len(1).for_each(|_| run());
}

/// Runs both, at the same time if `parallel`.
pub(crate) fn both(parallel: bool, a: &mut (dyn FnMut() + Send), b: &mut (dyn FnMut() + Send)) {
    if parallel {
        rayon::join(a, b);
    } else {
        a();
        b();
    }
}

/// Sets displacements (or any vectors): `fill` is given the number of the first of some of them.
pub(crate) fn set_moves(
    parallel: bool,
    moves: &mut [Move],
    fill: impl Fn(usize, &mut [Move]) + Sync,
) {
    let set = |chunk, moves: &mut [Move]| fill(chunk * COPY_CHUNK, moves);
    share_out(parallel, moves.chunks_mut(COPY_CHUNK), set);
}

/// Heap bytes of a list.
pub(crate) fn bytes_of<T>(list: &Vec<T>) -> usize {
    list.capacity() * size_of::<T>()
}

/// Displacement (m) as passes read it.
#[inline(always)]
pub(crate) fn moved(position: DVec3, rest: DVec3) -> Move {
    (position - rest).to_array()
}
