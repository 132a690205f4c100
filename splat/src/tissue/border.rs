//! Where a cut ends inside the body: the edges that only one of its triangles has.

use crate::cast::{count, index};
use crate::tissue::{envelope, map_bytes, tree_bytes};
use glam::DVec3;
use rstar::RTree;
use rstar::primitives::{GeomWithData, Line, Rectangle};
use std::collections::HashMap;

/// An edge by the bits of its ends, the lower first: neighbouring triangles of a growing cut share
/// their corners exactly.
type EdgeKey = [[u64; 3]; 2];

/// A free edge in the tree: its triangle and that triangle's third corner.
type FreeEdgeNode = GeomWithData<Line<[f64; 3]>, (u32, [f64; 3])>;

/// How many triangles have an edge; the first of them, and the corner at which the edge begins there.
#[derive(Debug, Clone, Copy)]
struct TriangleEdge {
    triangles: u32,
    first: u32,
    corner: u8,
}

/// All triangles of the cuts so far, their edges, and which triangles hang together.
#[derive(Debug, Clone, Default)]
pub(crate) struct Borders {
    /// Per edge the triangles that have it.
    edges: HashMap<EdgeKey, TriangleEdge>,
    free: RTree<FreeEdgeNode>,
    pub(super) triangles: Vec<[DVec3; 3]>,
    /// Boxes of the triangles, with their numbers.
    boxes: RTree<GeomWithData<Rectangle<[f64; 3]>, u32>>,
    /// Forest of triangles joined at edges, each pointing towards the first of its sheet.
    joined: Vec<u32>,
}

impl Borders {
    /// Numbers of the triangles whose box comes within `radius` of `x`, ascending.
    pub(crate) fn triangles_near(&self, x: DVec3, radius: f64) -> Vec<u32> {
        let boxes = &self.boxes;
        let near = boxes.locate_within_distance(x.to_array(), radius * radius);
        let mut found: Vec<u32> = near.map(|node| node.data).collect();
        found.sort_unstable();
        found
    }

    /// The sheet of a triangle: the same number for all triangles that hang together.
    pub(crate) fn sheet(&self, mut triangle: u32) -> u32 {
        while self.joined[index(triangle)] != triangle {
            triangle = self.joined[index(triangle)];
        }
        triangle
    }

    /// Takes in triangles; returns the ends of edges that were free and are not, or the other way
    /// round.
    pub(crate) fn extend(&mut self, triangles: &[[DVec3; 3]]) -> Vec<[DVec3; 2]> {
        let mut met: Vec<(EdgeKey, bool)> = Vec::new();
        for corners in triangles {
            let triangle = count(self.joined.len());
            self.joined.push(triangle);
            self.triangles.push(*corners);
            let rectangle = Rectangle::from_aabb(envelope(corners, 0.0));
            self.boxes.insert(GeomWithData::new(rectangle, triangle));
            for k in 0..3_u8 {
                let [a, b, _] = corners_from(corners, k);
                let key = key(a, b);
                if key[0] == key[1] {
                    continue;
                }
                met.push((key, self.is_free(&key)));
                if let Some(edge) = self.edges.get_mut(&key) {
                    edge.triangles += 1;
                    let edge = *edge;
                    if edge.triangles == 2 {
                        self.free.remove(&self.node(edge.first, edge.corner));
                    }
                    self.join(triangle, edge.first);
                } else {
                    self.free.insert(self.node(triangle, k));
                    let edge = TriangleEdge {
                        triangles: 1,
                        first: triangle,
                        corner: k,
                    };
                    self.edges.insert(key, edge);
                }
            }
        }
        // Of an edge met twice, the first entry knows how it was.
        met.sort_by_key(|edge| edge.0);
        met.dedup_by_key(|edge| edge.0);
        met.into_iter()
            .filter(|(key, was_free)| self.is_free(key) != *was_free)
            .map(|(key, _)| key.map(|end| DVec3::from_array(end.map(f64::from_bits))))
            .collect()
    }

    fn is_free(&self, key: &EdgeKey) -> bool {
        self.edges.get(key).is_some_and(|edge| edge.triangles == 1)
    }

    /// The edge that begins at a corner of a triangle, as the tree of free edges has it.
    fn node(&self, triangle: u32, corner: u8) -> FreeEdgeNode {
        let [a, b, c] = corners_from(&self.triangles[index(triangle)], corner);
        let line = Line::new(a.to_array(), b.to_array());
        FreeEdgeNode::new(line, (triangle, c.to_array()))
    }

    /// Heap bytes.
    pub(crate) fn bytes(&self) -> usize {
        map_bytes(&self.edges)
            + tree_bytes(&self.free)
            + tree_bytes(&self.boxes)
            + size_of_val(&*self.triangles)
            + size_of_val(&*self.joined)
    }

    /// Joins the sheets of two triangles under the older root; strips join one by one, so that
    /// paths stay short.
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.sheet(a), self.sheet(b));
        self.joined[index(a.max(b))] = a.min(b);
    }

    /// The point on the free edges of all sheets that is nearest to `x`, if it is at most `radius` away,
    /// moved on by `ahead`, out of the cut and in its plane.
    pub(crate) fn way_round(&self, x: DVec3, radius: f64, ahead: f64) -> Option<DVec3> {
        let mut near = self
            .free
            .nearest_neighbor_iter_with_distance_2(x.to_array());
        let (nearest, squared) = near.next()?;
        if squared > radius * radius {
            return None;
        }
        // Neighbouring edges share their end; which of them is taken must not depend on the tree.
        let same = squared * (1.0 + 1e-9);
        let tied = self.free.locate_within_distance(x.to_array(), same);
        let node = tied.min_by_key(|node| node_key(node)).unwrap_or(nearest);
        let [a, b] = [node.geom().from, node.geom().to].map(DVec3::from_array);
        let along = (b - a).try_normalize()?;
        let inward = DVec3::from_array(node.data.1) - a;
        let inward = (inward - along * inward.dot(along)).try_normalize()?;
        let at = (x - a).dot(along).clamp(0.0, a.distance(b));
        Some(a + along * at - inward * ahead)
    }
}

/// The corners of a triangle, beginning with `first`.
fn corners_from(corners: &[DVec3; 3], first: u8) -> [DVec3; 3] {
    let k = usize::from(first);
    [corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]]
}

fn node_key(node: &FreeEdgeNode) -> EdgeKey {
    let [a, b] = [node.geom().from, node.geom().to].map(DVec3::from_array);
    key(a, b)
}

fn key(a: DVec3, b: DVec3) -> EdgeKey {
    // Adding zero makes -0 and 0 one.
    let bits = |p: DVec3| p.to_array().map(|x| (x + 0.0).to_bits());
    let (a, b) = (bits(a), bits(b));
    if a <= b { [a, b] } else { [b, a] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shared_edges_are_not_free_and_join_their_triangles() {
        let corner = |x: f64, z: f64| DVec3::new(x, 0.0, z);
        let strip = |x: f64| {
            let (a, b) = (corner(x, 0.0), corner(x, 1.0));
            let (c, d) = (corner(x + 1.0, 0.0), corner(x + 1.0, 1.0));
            [[a, b, c], [c, b, d]]
        };
        let mut borders = Borders::default();
        borders.extend(&strip(0.0));
        let far = strip(7.0);
        borders.extend(&far);
        assert_ne!(borders.sheet(0), borders.sheet(2));
        assert_eq!(borders.free.size(), 8);
        // The next strip takes the front: one edge is free no more, three are new.
        let turned = borders.extend(&strip(1.0));
        assert_eq!(turned.len(), 4);
        assert_eq!(borders.free.size(), 10);
        assert_eq!(borders.sheet(5), borders.sheet(0));
        let round = borders.way_round(corner(1.7, 0.4), 0.5, 0.1);
        assert!(round.is_some_and(|p| p.distance(corner(2.1, 0.4)) < 1e-12));
        assert_eq!(borders.way_round(corner(1.7, 0.4), 0.2, 0.1), None);
    }
}
