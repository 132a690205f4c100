//! How what belongs to nodes is laid out.

/// Nodes whose constants lie together, by component, and are evaluated together.
pub(crate) const BLOCK: usize = 16;

/// One number per node of a block.
pub(crate) type Plane = [f64; BLOCK];

/// What belongs to the nodes of a block, node after node, from a cache line's start on.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Sixteen<T>(pub(crate) [T; BLOCK]);

/// What is stored of `node` in blocks.
#[inline(always)]
pub(crate) fn at<T>(blocks: &[Sixteen<T>], node: usize) -> &T {
    &blocks[node / BLOCK].0[node % BLOCK]
}
