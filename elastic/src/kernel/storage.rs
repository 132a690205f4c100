//! How what belongs to nodes is laid out, and shared out among threads.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Nodes whose constants lie together, by component, and are evaluated together.
pub(crate) const BLOCK: usize = 16;

/// One number per node of a block.
pub(crate) type Plane = [f64; BLOCK];

/// A matrix of each node of a block, row by row.
pub(crate) type Planes = [Plane; 9];

/// What belongs to the nodes of a block, node after node, from a cache line's start on.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Sixteen<T>(pub(crate) [T; BLOCK]);

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
/// Below this many nodes a second thread costs more than it saves.
pub(crate) const PARALLEL_NODES: usize = 1024;

/// Copies those of all nodes.
pub(crate) fn copy_gradients(parallel: bool, stored: &[Planes], to: &mut [DMat3]) {
    let copy = |(chunk, to): (usize, &mut [DMat3])| {
        let blocks = to.chunks_mut(BLOCK);
        for (planes, nodes) in stored[chunk * (COPY_CHUNK / BLOCK)..].iter().zip(blocks) {
            for (lane, f) in nodes.iter_mut().enumerate() {
                let row = |r: usize| DVec3::from_array([0, 1, 2].map(|c| planes[3 * r + c][lane]));
                *f = DMat3::from_cols(row(0), row(1), row(2)).transpose();
            }
        }
    };
    if parallel {
        to.par_chunks_mut(COPY_CHUNK).enumerate().for_each(copy);
    } else {
        to.chunks_mut(COPY_CHUNK).enumerate().for_each(copy);
    }
}

pub(crate) fn parallel(node_count: usize) -> bool {
    node_count >= PARALLEL_NODES && rayon::current_num_threads() > 1
}

/// Runs `work` on the numbered chunks of two slices, on the pool or in place.
///
/// Chunks are fixed and disjoint: the result does not depend on the number of threads.
pub(crate) fn chunks<A: Send, B: Send>(
    parallel: bool,
    (a, a_size): (&mut [A], usize),
    (b, b_size): (&mut [B], usize),
    work: impl Fn(usize, &mut [A], &mut [B]) + Sync,
) {
    debug_assert_eq!(
        a.len().div_ceil(a_size),
        b.len().div_ceil(b_size),
        "chunks of the same nodes"
    );
    if parallel {
        a.par_chunks_mut(a_size)
            .zip(b.par_chunks_mut(b_size))
            .enumerate()
            .with_max_len(1)
            .for_each(|(chunk, (a, b))| work(chunk, a, b));
    } else {
        let both = a.chunks_mut(a_size).zip(b.chunks_mut(b_size));
        for (chunk, (a, b)) in both.enumerate() {
            work(chunk, a, b);
        }
    }
}

/// Sets displacements (or any vectors): `fill` is given the number of the first of some of them.
pub(crate) fn set_moves(
    parallel: bool,
    moves: &mut [Move],
    fill: impl Fn(usize, &mut [Move]) + Sync,
) {
    let set = |(chunk, moves): (usize, &mut [Move])| fill(chunk * COPY_CHUNK, moves);
    if parallel {
        let chunks = moves.par_chunks_mut(COPY_CHUNK).enumerate();
        chunks.with_max_len(1).for_each(set);
    } else {
        moves.chunks_mut(COPY_CHUNK).enumerate().for_each(set);
    }
}

/// Displacement (m) as passes read it.
#[inline(always)]
pub(crate) fn moved(position: DVec3, rest: DVec3) -> Move {
    (position - rest).to_array()
}
