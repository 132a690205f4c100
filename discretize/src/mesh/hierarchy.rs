//! A box hierarchy over triangles: closest point, winding number, crossings of a segment.

use std::f64::consts::PI;
use std::ops::Range;

use glam::DVec3;

use crate::mesh::{Bounds, Mesh, area_vector, index};

/// Triangles per leaf.
const LEAF: usize = 4;
/// A cluster is replaced by its dipole beyond this many radii (Barill et al. 2018, section 3.2: 2).
const DIPOLE_DISTANCE: f64 = 2.0;
/// Barycentric slack of segment crossings, so that none slips through between two triangles.
const SLACK: f64 = 1e-12;

#[derive(Debug, Clone)]
struct BoxNode {
    bounds: Bounds,
    /// Area-weighted middle of the triangles, and radius about it.
    center: DVec3,
    radius: f64,
    /// Sum of the area vectors: the dipole.
    dipole: DVec3,
    /// Leaf: first triangle. Inner node: the second child (the first follows at once).
    next: u32,
    /// Triangles of a leaf, 0 for inner nodes.
    count: u32,
}

impl BoxNode {
    /// Corners of a leaf.
    fn entries(&self) -> Range<usize> {
        let first = self.next as usize;
        first..first + self.count as usize
    }
}

/// Hierarchy of axis-aligned boxes over the triangles of one mesh.
#[derive(Debug, Clone)]
pub struct Hierarchy {
    nodes: Vec<BoxNode>,
    /// Corners, in the order of the leaves.
    corners: Vec<[DVec3; 3]>,
    /// Triangle of the mesh for each entry of `corners`.
    ids: Vec<u32>,
}

/// Where a segment crosses a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Crossing {
    /// Parameter on the segment, 0 to 1.
    pub parameter: f64,
    /// Triangle of the mesh.
    pub triangle: u32,
}

/// The closest point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Closest {
    /// The point on the surface.
    pub point: DVec3,
    /// Squared distance to it.
    pub distance_squared: f64,
    /// Triangle of the mesh.
    pub triangle: u32,
}

impl Hierarchy {
    /// Builds the hierarchy; `O(n log n)`, the same for the same mesh.
    ///
    /// # Panics
    /// If a triangle names a vertex out of range.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Self {
        let corners: Vec<[DVec3; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
        let mut items: Vec<(DVec3, u32)> = corners
            .iter()
            .enumerate()
            .map(|(t, [a, b, c])| ((*a + *b + *c) / 3.0, index(t)))
            .collect();
        let mut nodes = Vec::with_capacity(2 * items.len() / LEAF + 2);
        if !items.is_empty() {
            build(&corners, &mut items, 0, &mut nodes);
        }
        Self {
            nodes,
            corners: items.iter().map(|(_, t)| corners[*t as usize]).collect(),
            ids: items.into_iter().map(|(_, t)| t).collect(),
        }
    }

    /// Generalised winding number of `p` (Jacobson et al. 2013), far clusters by their dipole
    /// (Barill et al. 2018): 1 inside a closed outward surface, 0 outside, 2 where two overlap.
    /// The dipoles leave an error of a few hundredths; [`winding_number`] sums every triangle.
    #[must_use]
    pub fn winding_number(&self, p: DVec3) -> f64 {
        let mut sum = 0.0;
        let mut at = 0;
        let mut stack = [0_u32; 64];
        let mut depth = 0;
        if self.nodes.is_empty() {
            return 0.0;
        }
        loop {
            let node = &self.nodes[at];
            let to = node.center - p;
            let distance_squared = to.length_squared();
            let reach = DIPOLE_DISTANCE * node.radius;
            if distance_squared > reach * reach {
                sum +=
                    node.dipole.dot(to) / (4.0 * PI * distance_squared * distance_squared.sqrt());
            } else if node.count > 0 {
                for corners in &self.corners[node.entries()] {
                    sum += solid_angle(corners, p) / (4.0 * PI);
                }
            } else {
                stack[depth] = node.next;
                depth += 1;
                at += 1;
                continue;
            }
            if depth == 0 {
                return sum;
            }
            depth -= 1;
            at = stack[depth] as usize;
        }
    }

    /// The point of the surface closest to `p`; of equally close ones the first in the hierarchy.
    /// `None` for an empty mesh.
    #[must_use]
    pub fn closest(&self, p: DVec3) -> Option<Closest> {
        let mut best: Option<Closest> = None;
        let mut best_squared = f64::INFINITY;
        let mut stack = [(0_u32, 0.0_f64); 64];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let (at, bound) = stack[depth];
            if bound >= best_squared {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for entry in node.entries() {
                    let point = closest_on_triangle(&self.corners[entry], p);
                    let distance_squared = point.distance_squared(p);
                    if distance_squared < best_squared {
                        best_squared = distance_squared;
                        best = Some(Closest {
                            point,
                            distance_squared,
                            triangle: self.ids[entry],
                        });
                    }
                }
            } else {
                let [near, far] = [at + 1, node.next].map(|child| {
                    let bounds = &self.nodes[child as usize].bounds;
                    (child, bounds.distance_squared(p))
                });
                let (near, far) = if far.1 < near.1 {
                    (far, near)
                } else {
                    (near, far)
                };
                stack[depth] = far;
                stack[depth + 1] = near;
                depth += 2;
            }
        }
        best
    }

    /// Appends every crossing of the segment from `a` to `b`, unsorted.
    pub fn crossings_into(&self, a: DVec3, b: DVec3, out: &mut Vec<Crossing>) {
        let direction = b - a;
        self.visit(&Bounds::of([a, b]), |entry| {
            if let Some(parameter) = segment_parameter(&self.corners[entry], a, direction) {
                let triangle = self.ids[entry];
                out.push(Crossing {
                    parameter,
                    triangle,
                });
            }
        });
    }

    /// Appends every triangle whose box touches the given box, unsorted.
    pub fn touching_into(&self, bounds: &Bounds, out: &mut Vec<u32>) {
        self.visit(bounds, |entry| {
            if !apart(&Bounds::of(self.corners[entry]), bounds) {
                out.push(self.ids[entry]);
            }
        });
    }

    /// Calls `entry` for the triangles of all leaves whose box touches the given one.
    fn visit(&self, bounds: &Bounds, mut entry: impl FnMut(usize)) {
        let mut stack = [0_u32; 64];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let at = stack[depth];
            let node = &self.nodes[at as usize];
            if apart(&node.bounds, bounds) {
                continue;
            }
            if node.count > 0 {
                node.entries().for_each(&mut entry);
            } else {
                stack[depth] = node.next;
                stack[depth + 1] = at + 1;
                depth += 2;
            }
        }
    }
}

fn apart(a: &Bounds, b: &Bounds) -> bool {
    (a.min.cmpgt(b.max) | b.min.cmpgt(a.max)).any()
}

fn build(
    corners: &[[DVec3; 3]],
    items: &mut [(DVec3, u32)],
    first: usize,
    nodes: &mut Vec<BoxNode>,
) {
    let at = nodes.len();
    let mut bounds = Bounds::EMPTY;
    let mut dipole = DVec3::ZERO;
    let mut center = DVec3::ZERO;
    let mut area = 0.0;
    for (middle, t) in items.iter() {
        let triangle = corners[*t as usize];
        triangle.iter().for_each(|p| bounds.include(*p));
        let vector = area_vector(triangle);
        let length = vector.length();
        dipole += vector;
        center += length * *middle;
        area += length;
    }
    center = if area > 0.0 {
        center / area
    } else {
        bounds.center()
    };
    let radius = (bounds.max - center).max(center - bounds.min).length();
    nodes.push(BoxNode {
        bounds,
        center,
        radius,
        dipole,
        next: index(first),
        count: 0,
    });
    if items.len() <= LEAF {
        nodes[at].count = index(items.len());
        return;
    }
    let spread = Bounds::of(items.iter().map(|(middle, _)| *middle)).size();
    let axis = if spread.x >= spread.y && spread.x >= spread.z {
        0
    } else if spread.y >= spread.z {
        1
    } else {
        2
    };
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |a, b| {
        a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1))
    });
    let (low, high) = items.split_at_mut(half);
    build(corners, low, first, nodes);
    nodes[at].next = index(nodes.len());
    build(corners, high, first + half, nodes);
}

/// Signed solid angle of a triangle seen from `p` (Van Oosterom & Strackee 1983, eq. 8); positive
/// if `p` lies behind the outward side.
fn solid_angle(corners: &[DVec3; 3], p: DVec3) -> f64 {
    let [a, b, c] = corners.map(|x| x - p);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let numerator = a.dot(b.cross(c));
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    if numerator == 0.0 && denominator == 0.0 {
        return 0.0;
    }
    2.0 * numerator.atan2(denominator)
}

/// Generalised winding number by summing every triangle (Jacobson et al. 2013, eq. 5).
///
/// # Panics
/// If a triangle names a vertex out of range.
#[must_use]
pub fn winding_number(mesh: &Mesh, p: DVec3) -> f64 {
    (0..mesh.triangles.len())
        .map(|t| solid_angle(&mesh.corners(t), p))
        .sum::<f64>()
        / (4.0 * PI)
}

/// Closest point of a triangle by Voronoi regions (Ericson 2005, section 5.1.5).
pub(crate) fn closest_on_triangle([a, b, c]: &[DVec3; 3], p: DVec3) -> DVec3 {
    let (ab, ac, ap) = (*b - *a, *c - *a, p - *a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    let bp = p - *b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return *a + ab * (d1 / (d1 - d3));
    }
    let cp = p - *c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return *a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return *b + (*c - *b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let scale = 1.0 / (va + vb + vc);
    *a + ab * (vb * scale) + ac * (vc * scale)
}

/// Parameter at which the segment `a + t d`, `0 <= t <= 1`, meets the triangle
/// (Moeller & Trumbore 1997).
fn segment_parameter(corners: &[DVec3; 3], a: DVec3, d: DVec3) -> Option<f64> {
    let e1 = corners[1] - corners[0];
    let e2 = corners[2] - corners[0];
    let h = d.cross(e2);
    let determinant = e1.dot(h);
    if determinant == 0.0 {
        return None;
    }
    let inverse = 1.0 / determinant;
    let s = a - corners[0];
    let u = inverse * s.dot(h);
    if !(-SLACK..=1.0 + SLACK).contains(&u) {
        return None;
    }
    let q = s.cross(e1);
    let v = inverse * d.dot(q);
    if v < -SLACK || u + v > 1.0 + SLACK {
        return None;
    }
    let t = inverse * e2.dot(q);
    (0.0..=1.0).contains(&t).then_some(t)
}
