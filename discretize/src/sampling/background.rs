//! Tetrahedra that fill space around a body, before they are cut along its surface.

use glam::DVec3;

use crate::sampling::{SampleError, Solid};

/// What is called for a tetrahedron with the ranks of its edges' lengths.
pub(crate) type Visit<'a> = dyn FnMut([u32; 4], &[[u8; 4]; 4]) + 'a;

/// An edge of the background.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BackgroundEdge {
    /// Ends, the smaller id first.
    pub ends: [u32; 2],
    /// An end moves onto the surface if the cut lies within this fraction of the edge.
    pub reach: f64,
}

impl BackgroundEdge {
    pub(crate) fn new(a: u32, b: u32, reach: f64) -> Self {
        Self {
            ends: [a.min(b), a.max(b)],
            reach,
        }
    }
}

/// Points and conforming tetrahedra.
pub(crate) trait BackgroundMesh: Sync {
    fn point_count(&self) -> usize;

    fn position(&self, id: u32) -> DVec3;

    /// Edge of the smallest cell at a point.
    fn size(&self, id: u32) -> f64;

    /// Signs at all points: 1 inside, 0 on the surface, -1 outside.
    fn signs(&self, solid: &Solid) -> Result<Vec<i8>, SampleError>;

    /// Every edge with an end inside and an end outside, once.
    fn crossed_edges(&self, sign: &[i8]) -> Vec<BackgroundEdge>;

    /// Number of pieces of the background that can be worked on side by side.
    fn chunks(&self) -> usize;

    /// Calls `visit` for the tetrahedra of a piece, with the rank of the length of each edge.
    fn tetrahedra_in(&self, chunk: usize, visit: &mut Visit<'_>);

    /// Whether a point may move to a position while all others are where `position` says, without
    /// flattening a tetrahedron.
    fn may_warp(&self, id: u32, to: DVec3, position: &dyn Fn(u32) -> DVec3) -> bool;
}
