//! Edges of a cut's triangles: where it ends, and around which paths pass.

use std::collections::HashMap;

use glam::DVec3;

use crate::bounds::Bounds;
use crate::face::nearest_on_segment;
use crate::forest::Forest;
use crate::index32;

/// Where the shortest path between two points passes an edge of a cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DiffractionPoint {
    /// The edge.
    pub(crate) edge: u32,
    /// Point of the edge with the shortest path from `a` over it to `b` (m).
    pub(crate) point: DVec3,
    /// Unit vector away from the cut.
    pub(crate) outward: DVec3,
}

impl DiffractionPoint {
    /// The point so far outside.
    pub(crate) fn outside(&self, offset: f64) -> DVec3 {
        self.point + offset * self.outward
    }
}

#[derive(Debug, Clone)]
struct FreeEdge {
    /// End points, the one [`before`] the other first.
    ends: [u32; 2],
    /// Third corners of the triangles at this edge.
    opposite: Vec<u32>,
    /// Unit vector out of the cut, zero where the cut goes straight on.
    outward: DVec3,
}

/// Edges by their ends and by position.
#[derive(Debug, Clone, Default)]
pub(crate) struct Edges {
    /// Vertices (m) of the cut.
    pub(crate) vertices: Vec<DVec3>,
    edges: Vec<FreeEdge>,
    /// Never iterated: its order is a random one.
    of: HashMap<[u32; 2], u32>,
    index: Forest,
}

fn key(vertices: &[DVec3], a: u32, b: u32) -> [u32; 2] {
    if before(vertices[a as usize], vertices[b as usize]) {
        [a, b]
    } else {
        [b, a]
    }
}

impl Edges {
    /// Bytes held on the heap, about.
    pub(crate) fn bytes(&self) -> usize {
        self.vertices.capacity() * 24
            + self.edges.capacity() * size_of::<FreeEdge>()
            + self.edges.len() * 16
            + self.of.capacity() * 16
            + self.index.bytes()
    }

    /// Adds the three edges of a triangle; `straight` (m) as [`outward`] takes it.
    pub(crate) fn add(&mut self, corners: [u32; 3], straight: f64) {
        let vertices = &self.vertices;
        for k in 0..3 {
            let ends = key(vertices, corners[k], corners[(k + 1) % 3]);
            let [a, b] = ends.map(|v| vertices[v as usize]);
            let number = *self.of.entry(ends).or_insert_with(|| {
                let number = index32(self.edges.len());
                self.edges.push(FreeEdge {
                    ends,
                    opposite: Vec::new(),
                    outward: DVec3::ZERO,
                });
                self.index.insert(number, [a, b, b]);
                number
            });
            let edge = &mut self.edges[number as usize];
            edge.opposite.push(corners[(k + 2) % 3]);
            let along = (b - a).normalize_or_zero();
            let inward = |&v: &u32| {
                let corner = vertices[v as usize];
                let to = corner - a;
                (corner, to - to.dot(along) * along)
            };
            let mut inward: Vec<(DVec3, DVec3)> = edge.opposite.iter().map(inward).collect();
            edge.outward = outward(&mut inward, straight);
        }
    }

    /// Whether there is a triangle with these corners.
    pub(crate) fn has(&self, [a, b, c]: [u32; 3]) -> bool {
        let found = self.of.get(&key(&self.vertices, a, b));
        found.is_some_and(|&edge| self.edges[edge as usize].opposite.contains(&c))
    }

    /// Edges of some triangles that no other triangle has, and the unit vector out of the cut at each.
    pub(crate) fn free(&self, triangles: &[[u32; 3]]) -> Vec<([u32; 2], DVec3)> {
        let edges = triangles
            .iter()
            .flat_map(|&[p, q, r]| [[p, q], [q, r], [r, p]]);
        let edges = edges.filter_map(|[p, q]| self.of.get(&key(&self.vertices, p, q)));
        let edges = edges.map(|&edge| &self.edges[edge as usize]);
        let free = edges.filter(|edge| edge.opposite.len() == 1);
        free.map(|edge| (edge.ends, edge.outward)).collect()
    }

    /// The edge with one triangle, at which the cut ends, that is nearest to a point, and its point there, if there is
    /// one within a distance. Of edges that meet at that point it is the one most across the path to it.
    pub(crate) fn nearest_free(&self, point: DVec3, within: f64) -> Option<([DVec3; 2], DVec3)> {
        let nearest = |edge: u32| nearest_on_segment(self.ends(edge), point);
        let mut near: Vec<(f64, u32)> = Vec::new();
        let around = Bounds::of(&[point]).grown(within);
        self.index.in_box(&around, |edge| {
            if self.edges[edge as usize].opposite.len() == 1 {
                near.push((point.distance(nearest(edge)), edge));
            }
        });
        near.retain(|found| found.0 <= within);
        let least = near.iter().map(|found| found.0).reduce(f64::min)?;
        let round_off = 1e-9 * (least + within);
        let across = |edge: u32| {
            let [p, q] = self.ends(edge);
            let along = (q - p).normalize_or_zero();
            let [from_p, from_q] = [point - p, point - q].map(|way| way.cross(along).length());
            from_p.max(from_q)
        };
        let tied = near.iter().filter(|found| found.0 <= least + round_off);
        let order = |a: u32, b: u32| across(a).total_cmp(&across(b)).then(b.cmp(&a));
        let (_, edge) = *tied.max_by(|a, b| order(a.1, b.1))?;
        Some((self.ends(edge), nearest(edge)))
    }

    /// Numbers of the edges that a path may bend around and that may meet the box, sorted, each once; replaces what
    /// `out` held. Gives whether the cut may end in the box: false only if an even number of triangles meets at each
    /// of its edges there.
    pub(crate) fn diffraction_into(&self, near: &Bounds, out: &mut Vec<u32>) -> bool {
        out.clear();
        let mut ends = false;
        self.index.in_box(near, |number| {
            let edge = &self.edges[number as usize];
            ends |= edge.opposite.len() % 2 == 1;
            if edge.outward != DVec3::ZERO {
                out.push(number);
            }
        });
        out.sort_unstable();
        ends
    }

    /// The shortest path over an edge. Its best point is where the path, unfolded into a plane, is straight:
    /// `t = (t_a d_b + t_b d_a) / (d_a + d_b)` with the coordinates t along the edge and the
    /// distances d to its line; clamped to the edge.
    pub(crate) fn diffraction_point(&self, edge: u32, a: DVec3, b: DVec3) -> DiffractionPoint {
        let [p, q] = self.ends(edge);
        let length = p.distance(q);
        let along = (q - p) / length;
        let (t_a, t_b) = ((a - p).dot(along), (b - p).dot(along));
        let d_a = (a - p - t_a * along).length();
        let d_b = (b - p - t_b * along).length();
        let t = if d_a + d_b > 0.0 {
            (t_a * d_b + t_b * d_a) / (d_a + d_b)
        } else {
            0.5 * (t_a + t_b)
        };
        DiffractionPoint {
            edge,
            point: p + t.clamp(0.0, length) * along,
            outward: self.edges[edge as usize].outward,
        }
    }

    fn ends(&self, edge: u32) -> [DVec3; 2] {
        self.edges[edge as usize]
            .ends
            .map(|v| self.vertices[v as usize])
    }
}

/// Orders points by x, then y, then z; what depends on it does not depend on the order of arrival.
fn before(a: DVec3, b: DVec3) -> bool {
    (a.x, a.y, a.z) < (b.x, b.y, b.z)
}

/// Below this length the sum of the unit directions into the cut counts as zero: the edge is flat.
///
/// Two faces that meet at less than 2.9 degrees from straight.
pub(crate) const FLAT: f64 = 0.05;

/// The faces at a flat edge reach so far from it (in influence radii); where they reach less far, the edge must
/// be straighter in the same proportion. A smooth sheet in small triangles has such edges if its radius is below
/// `FACE / FLAT`, 2.5 influence radii: around a larger one, paths without them are too short by less than 0.7 %
/// of the influence radius.
const FACE: f64 = 0.125;

/// Unit vector out of the cut from the directions into it, zero if the edge is flat.
///
/// The sum runs in the order of the points, so that it is bitwise identical for any order of arrival.
///
/// # Arguments
/// * `inward` -- per piece at the edge a point of it to sort by, and the vector (m) from the edge to its
///   far end.
/// * `radius` -- influence radius (m), about.
fn outward(inward: &mut [(DVec3, DVec3)], radius: f64) -> DVec3 {
    inward.sort_by(|(a, _), (b, _)| {
        let order = |a: f64, b: f64| a.total_cmp(&b);
        order(a.x, b.x).then(order(a.y, b.y)).then(order(a.z, b.z))
    });
    let (mut sum, mut farthest) = (DVec3::ZERO, 0.0_f64);
    for (_, vector) in &*inward {
        sum += vector.normalize_or_zero();
        farthest = farthest.max(vector.length());
    }
    if sum.length() < FLAT * (farthest / (FACE * radius)).min(1.0) {
        DVec3::ZERO
    } else {
        -sum.normalize_or_zero()
    }
}
