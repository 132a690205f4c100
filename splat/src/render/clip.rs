//! Splats clipped at sharp edges: the part of a disk that its anchor cannot see is not drawn.

use glam::DVec2;

/// What bounds a disk, in its tangent plane (m, measured from the centre along the tangents of
/// `Surfel::tangents`).
///
/// A point of the disk is drawn if it lies beyond none of `edges` and the segment from `anchor` to
/// it crosses none of `walls`: the same visibility that separates nodes across a cut. A wall that
/// ends inside the disk (the front of a growing cut) hides only what lies in its shadow.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Clip {
    /// The point that sees.
    pub anchor: DVec2,
    /// Lines `p · direction = offset` beyond which there is no body: sharp edges, and for new skin
    /// the body's surface.
    pub edges: Vec<(DVec2, f64)>,
    /// Segments that block the view.
    pub walls: Vec<[DVec2; 2]>,
}

impl Clip {
    /// True if `p` lies beyond an edge or the segment from the anchor to `p` crosses a wall.
    #[must_use]
    pub fn hides(&self, p: DVec2) -> bool {
        let o = self.anchor;
        let hides = |&[a, b]: &[DVec2; 2]| shadows(a - o, b - o, p - o);
        self.is_beyond_edge(p) || self.walls.iter().any(hides)
    }

    /// True if `p` lies beyond an edge.
    pub(crate) fn is_beyond_edge(&self, p: DVec2) -> bool {
        let mut edges = self.edges.iter();
        edges.any(|&(direction, offset)| p.dot(direction) > offset)
    }
}

/// True if `p` lies in the shadow that the wall a-b throws from the origin.
fn shadows(a: DVec2, b: DVec2, p: DVec2) -> bool {
    let turn = a.perp_dot(b);
    let (a, b) = if turn < 0.0 { (b, a) } else { (a, b) };
    a.perp_dot(p) >= 0.0 && p.perp_dot(b) >= 0.0 && (b - a).perp_dot(p - a) < 0.0
}
