//! Where disks end: sharp edges of the surface, and the body's surface around new skin.

use super::Tissue;
use crate::cast::index;
use crate::render::{Clip, Surfel};
use crate::tissue::{NodeTree, line_of_plane, nearest_on_segment};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Faces whose normals differ by more than 40° meet at a sharp edge (cosine).
const SHARP: f64 = 0.766;
/// Planes that bound one disk at most: an edge, a corner, one to spare.
const MAX_PLANES: usize = 3;

/// Surfels within `radius` of `x`, nearest first, equal distances in order of their numbers.
pub(crate) fn within(tree: &NodeTree, surfels: &[Surfel], x: DVec3, radius: f64) -> Vec<u32> {
    let near = tree.locate_within_distance(x.to_array(), radius * radius);
    let mut found: Vec<(f64, u32)> = near
        .map(|p| (surfels[index(p.data)].position.distance_squared(x), p.data))
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    found.into_iter().map(|(_, surfel)| surfel).collect()
}

/// Planes of neighbouring faces that meet surfel `i`'s disk in a convex edge: pairs of surfel and
/// the line they draw in the disk (direction, offset).
fn edge_lines(surfels: &[Surfel], tree: &NodeTree, i: usize) -> Vec<(DVec2, f64)> {
    let ((x, n), r) = (surfels[i].plane(), surfels[i].radius);
    let tangents = Surfel::tangents(n);
    let mut chosen: Vec<DVec3> = Vec::new();
    let mut lines = Vec::new();
    let reach = 2.5 * r;
    // Most disks lie on one smooth face.
    let mut beside = tree.locate_within_distance(x.to_array(), reach * reach);
    if beside.all(|p| surfels[index(p.data)].normal.dot(n) > SHARP) {
        return lines;
    }
    for j in within(tree, surfels, x, reach) {
        let (y, m) = surfels[index(j)].plane();
        let convex = (y - x).dot(n) < 0.0 && (x - y).dot(m) < 0.0;
        if m.dot(n) > SHARP || !convex || chosen.iter().any(|c| c.dot(m) > SHARP) {
            continue;
        }
        let Some((direction, offset, _)) = line_of_plane(x, tangents, y, m) else {
            continue;
        };
        if offset < r {
            chosen.push(m);
            lines.push((direction, offset));
        }
        if chosen.len() == MAX_PLANES {
            break;
        }
    }
    lines
}

/// Clips of all surfels at the surface's sharp edges.
pub(crate) fn sharp_edges(surfels: &[Surfel], tree: &NodeTree) -> Vec<Option<Arc<Clip>>> {
    let clip = |i: usize| {
        let clip = Clip {
            edges: edge_lines(surfels, tree, i),
            ..Clip::default()
        };
        (!clip.edges.is_empty()).then(|| Arc::new(clip))
    };
    (0..surfels.len()).into_par_iter().map(clip).collect()
}

impl Tissue {
    /// The inside test of Aras 2014, fig. 65: whether a rest point lies behind the tangent planes of both
    /// outer surfels nearest to it, or of one at least where each of the two stands before the other's plane
    /// (a concave rim). It errs off sharp edges and beside parts as thin as the surfels are apart.
    #[must_use]
    pub fn is_behind_surfels(&self, x: DVec3) -> bool {
        let mut nearest = self.outer_tree.nearest_neighbor_iter(x.to_array());
        let mut next = || nearest.next().map(|p| index(p.data));
        let surfels = &self.surfels;
        let before = |x: DVec3, i: usize| (x - surfels[i].position).dot(surfels[i].normal);
        let behind = |i: usize| before(x, i) < 0.0;
        match (next(), next()) {
            (Some(a), Some(b))
                if before(surfels[a].position, b) > 0.0 && before(surfels[b].position, a) > 0.0 =>
            {
                behind(a) || behind(b)
            }
            (Some(a), Some(b)) => behind(a) && behind(b),
            (only, _) => only.is_none_or(behind),
        }
    }
}

/// Moves an anchor away from new walls that pass closer than `clearance`, to the side it is on.
pub(crate) fn clear_anchor(clip: &mut Clip, walls: &[[DVec2; 2]], clearance: f64) {
    for &[a, b] in walls {
        let foot = nearest_on_segment(a, b, clip.anchor);
        let gap = clip.anchor - foot;
        let Some(normal) = (b - a).perp().try_normalize() else {
            continue;
        };
        if gap.length() < clearance {
            let side = if gap.dot(normal) < 0.0 { -1.0 } else { 1.0 };
            clip.anchor = foot + normal * side * clearance;
        }
    }
}

/// The clip of a disk of new skin at the body's outer surface; `None` if nothing of it would show.
///
/// The surface is taken as the tangent planes of the outer surfels next to the disk, the very
/// planes that are drawn: so the skin ends where the outer splats, clipped by the cut, begin. A
/// disk whose centre lies outside keeps what reaches into the body.
pub(crate) fn at_surface(
    disk: &Surfel,
    surfels: &[Surfel],
    tree: &NodeTree,
    inside: &(dyn Fn(DVec3) -> bool + Sync),
) -> Option<Clip> {
    let (x, r) = (disk.position, disk.radius);
    let (t0, t1) = Surfel::tangents(disk.normal);
    let is_inside = inside(x);
    let line = |y: DVec3, m: DVec3| line_of_plane(x, (t0, t1), y, m);
    let near = within(tree, surfels, x, 3.0 * r);
    if near.is_empty() {
        return is_inside.then(Clip::default);
    }
    let mut chosen: Vec<(DVec3, DVec3)> = Vec::new();
    let mut clip = Clip::default();
    for &j in &near {
        let (y, m) = surfels[index(j)].plane();
        // A surface nearly parallel to the cut has no rim here.
        let Some((direction, first, _)) = line(y, m).filter(|&(_, _, sine)| sine >= 0.15) else {
            continue;
        };
        let fresh = chosen
            .iter()
            .all(|&(z, k)| k.dot(m) < SHARP && (y - z).dot(k) <= 0.0 && (z - y).dot(m) <= 0.0);
        if !fresh {
            continue;
        }
        // Once more from the rim itself: the surfel nearest to the line bounds it best.
        let foot = x + (t0 * direction.x + t1 * direction.y) * first;
        let (y, m) = nearest_like(surfels, tree, foot, m).unwrap_or((y, m));
        let Some((direction, offset, _)) = line(y, m) else {
            continue;
        };
        chosen.push((y, m));
        if offset < r {
            clip.edges.push((direction, offset));
        }
        if chosen.len() == MAX_PLANES {
            break;
        }
    }
    for _ in 0..4 {
        for &(direction, offset) in &clip.edges {
            let over = clip.anchor.dot(direction) - (offset - 0.1 * r);
            if over > 0.0 {
                clip.anchor -= direction * over;
            }
        }
    }
    let eye = x + t0 * clip.anchor.x + t1 * clip.anchor.y;
    let moved = clip.anchor.length();
    let in_body = if moved > 0.0 {
        inside(eye)
    } else {
        is_inside || !clip.edges.is_empty()
    };
    (in_body && moved <= r && !clip.is_beyond_edge(clip.anchor)).then_some(clip)
}

/// The surfel nearest to `x` among those that face about like `normal`.
fn nearest_like(
    surfels: &[Surfel],
    tree: &NodeTree,
    x: DVec3,
    normal: DVec3,
) -> Option<(DVec3, DVec3)> {
    tree.nearest_neighbor_iter(x.to_array())
        .take(6)
        .map(|p| surfels[index(p.data)].plane())
        .find(|plane| plane.1.dot(normal) > SHARP)
}
