//! Boundary vectors of nodes that no triangle joins.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::mesh::{Mesh, area_vector};
use crate::sampling::Near;

/// Support radius tried first and its growth, over the cell at the nearest node.
const FIRST_SUPPORT: f64 = 2.0;
const GROWTH: f64 = 1.25;
/// Most times that the radius grows.
const GROWTHS: usize = 24;
/// Least `det C / (tr C / 3)^3` of the nodes' weighted second moments C: 0 if they lie in a plane,
/// 1 if they spread evenly. An ill-posed shape function is large and of both signs.
const LEAST_SPREAD: f64 = 0.02;
/// A support of more nodes grows no more: those in the tip of a wedge of 10 degrees or less lie too nearly
/// in a plane however many they are, and the best of the supports tried is taken. Half a ball of 8 cells
/// has 1,000; bodies without such parts stay below 300.
const MOST_NODES: usize = 1000;
/// Spread below which nodes do lie in a plane: 1/2,000 of their width thick, where the slope of a shape
/// function keeps 9 digits.
const FLAT: f64 = 1e-6;
/// Longest edge of a piece of the surface with one quadrature point, over the cell.
const LONGEST_EDGE: f64 = 0.5;
/// Most pieces along a triangle's edge.
const MOST_PIECES: f64 = 64.0;

/// Fractions that a triangle gives before they are added up, over the nodes: supports that had to grow over
/// a whole body give every node a fraction for each of 4,096 pieces.
const MOST_SHARES: usize = 4;

/// What one triangle gives nodes, and the largest support radius it took.
type TriangleShare = (Vec<(u32, DVec3)>, f64);

/// `b_i = sum_q phi_i(x_q) n_q a_q` with linear moving-least-squares functions phi of the nodes;
/// `sum b_i = 0` and `sum b_i (x) X_i = V I` follow from linear reproduction, as the rule integrates
/// linear functions over each triangle exactly. Also the largest support radius; `None` if the
/// nodes lie in a plane.
pub(crate) fn boundary_vectors(
    nodes: &[DVec3],
    size: &[f64],
    surface: &Mesh,
    tree: &Near,
) -> Option<(Vec<DVec3>, f64)> {
    let most = MOST_SHARES * nodes.len();
    let parts: Vec<Option<TriangleShare>> = (0..surface.triangles.len())
        .into_par_iter()
        .with_min_len(64)
        .map_init(Vec::new, |near, t| {
            let corners = surface.corners(t);
            let local = size[tree.nearest(corners[0]) as usize];
            let mut out = Vec::new();
            let mut largest = 0.0_f64;
            for (x, area) in pieces(corners, LONGEST_EDGE * local) {
                let support = support(x, FIRST_SUPPORT * local, nodes, tree, near)?;
                support.shape_functions(nodes, near, |v, phi| out.push((v, phi * area)));
                largest = largest.max(support.radius);
                if out.len() > most {
                    summed(&mut out);
                }
            }
            Some((out, largest))
        })
        .collect();
    let mut vectors = vec![DVec3::ZERO; nodes.len()];
    let mut largest = 0.0_f64;
    for part in parts {
        let (part, radius) = part?;
        largest = largest.max(radius);
        for (v, b) in part {
            vectors[v as usize] += b;
        }
    }
    Some((vectors, largest))
}

/// Adds up what each node was given, in the order in which it was given.
fn summed(shares: &mut Vec<(u32, DVec3)>) {
    shares.sort_by_key(|(v, _)| *v);
    shares.dedup_by(|next, first| {
        let same = next.0 == first.0;
        if same {
            first.1 += next.1;
        }
        same
    });
}

/// A triangle in equal pieces with edges up to `longest`: middles and area vectors.
#[allow(clippy::cast_possible_truncation, reason = "at most 64")]
fn pieces([a, b, c]: [DVec3; 3], longest: f64) -> Vec<(DVec3, DVec3)> {
    let edge = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let n = (edge / longest).ceil().clamp(1.0, MOST_PIECES) as usize;
    let area = area_vector([a, b, c]) / (n * n) as f64;
    let (u, v) = ((b - a) / n as f64, (c - a) / n as f64);
    let mut out = Vec::with_capacity(n * n);
    for i in 0..n {
        for j in 0..n - i {
            let corner = a + u * i as f64 + v * j as f64;
            out.push((corner + (u + v) / 3.0, area));
            if i + j + 1 < n {
                out.push((corner + (u + v) * (2.0 / 3.0), area));
            }
        }
    }
    out
}

/// The nodes around a position, weighted.
#[derive(Debug, Clone, Copy)]
struct NodesAround {
    x: DVec3,
    radius: f64,
    /// Sum of the weights, mean and second moments of the offsets over the radius.
    total: f64,
    mean: DVec3,
    moments: DMat3,
    /// `det C / (tr C / 3)^3` of the moments.
    spread: f64,
}

/// The smallest support of radius `first` or more whose nodes spread, else the one of those with up to
/// [`MOST_NODES`] whose nodes spread best; its nodes are left in `near`. `None` if they lie in a plane.
fn support(
    x: DVec3,
    first: f64,
    nodes: &[DVec3],
    tree: &Near,
    near: &mut Vec<u32>,
) -> Option<NodesAround> {
    let mut radius = first;
    let mut best: Option<NodesAround> = None;
    for _ in 0..GROWTHS {
        tree.within_into(x, radius, near);
        let here = NodesAround::new(x, radius, nodes, near);
        if here.spread >= LEAST_SPREAD {
            return Some(here);
        }
        if best.is_none_or(|best| here.spread > best.spread) {
            best = Some(here);
        }
        if near.len() > MOST_NODES {
            break;
        }
        radius *= GROWTH;
    }
    let best = best.filter(|best| best.spread > FLAT)?;
    tree.within_into(x, best.radius, near);
    Some(best)
}

impl NodesAround {
    fn new(x: DVec3, radius: f64, nodes: &[DVec3], near: &[u32]) -> Self {
        let mut support = Self {
            x,
            radius,
            total: 0.0,
            mean: DVec3::ZERO,
            moments: DMat3::ZERO,
            spread: 0.0,
        };
        for &v in near {
            let (d, w) = support.offset(nodes[v as usize]);
            support.total += w;
            support.mean += w * d;
        }
        if near.len() < 5 || support.total <= 0.0 {
            return support;
        }
        support.mean /= support.total;
        for &v in near {
            let (d, w) = support.offset(nodes[v as usize]);
            let e = d - support.mean;
            support.moments += w * DMat3::from_cols(e * e.x, e * e.y, e * e.z);
        }
        let moments = support.moments;
        let even = (moments.x_axis.x + moments.y_axis.y + moments.z_axis.z) / 3.0;
        if even > 0.0 {
            support.spread = moments.determinant() / (even * even * even);
        }
        support
    }

    /// Offset of a position over the radius, and its weight.
    fn offset(&self, place: DVec3) -> (DVec3, f64) {
        let d = (place - self.x) / self.radius;
        let rest = (1.0 - d.length_squared()).max(0.0);
        (d, rest * rest * rest)
    }

    /// Linear moving-least-squares shape functions at x, with the constant taken out so that a 3x3
    /// system is left: `phi_j = w_j (1/W + (d_j - m) . g)`, `C g = -m`.
    fn shape_functions(&self, nodes: &[DVec3], near: &[u32], mut emit: impl FnMut(u32, f64)) {
        let slope = self.moments.inverse() * -self.mean;
        for &v in near {
            let (d, w) = self.offset(nodes[v as usize]);
            emit(v, w * (1.0 / self.total + (d - self.mean).dot(slope)));
        }
    }
}
