//! Disks that a cut passes through: split, clipped, and bound again where they lose a node.

use super::Tissue;
use crate::cast::{count, index};
use crate::render::{Clip, Surfel};
use crate::tissue::{
    CAPSULE, Screen, Sight, envelope, nearest_on_segment, nearest_on_triangle, rim,
    wall_of_triangle,
};
use glam::{DVec2, DVec3};
use std::ops::Range;
use std::sync::Arc;

/// Clearance of an anchor from a wall, in radii.
const NUDGE: f64 = 0.05;
/// Doubles of one surfel at most: a disk diced into more pieces is smaller than a node's share.
const MAX_DOUBLES: usize = 7;
/// A cut this parallel to a disk (cosine of normals) does not bound it.
const PARALLEL: f64 = 0.9;

impl Tissue {
    /// Originals (outer and skin) whose disk or nodes new triangles may touch, in order, each with
    /// the triangles in reach.
    pub(super) fn near(&self, new: Range<u32>) -> Vec<(u32, Vec<u32>)> {
        let mut hits: Vec<(u32, u32)> = Vec::new();
        for t in new {
            let triangle = &self.borders.triangles[index(t)];
            let envelope = envelope(triangle, self.max_reach);
            for tree in [&self.outer_tree, &self.skin_tree] {
                for p in tree.locate_in_envelope(envelope) {
                    let x = self.surfels[index(p.data)].position;
                    let reaches = self.family(p.data).map(|member| self.reach(member));
                    let reach = reaches.fold(0.0, f64::max);
                    if nearest_on_triangle(triangle, x).distance_squared(x) <= reach * reach {
                        hits.push((p.data, t));
                    }
                }
            }
        }
        hits.sort_unstable();
        let triangles = |run: &[(u32, u32)]| run.iter().map(|hit| hit.1).collect::<Vec<u32>>();
        let runs = hits.chunk_by(|a, b| a.0 == b.0);
        runs.map(|run| (run[0].0, triangles(run))).collect()
    }

    /// Adds the walls of triangles to a surfel and its doubles, and doubles it again for every
    /// part of the disk that no anchor sees any more. Returns those whose anchor moved.
    pub(super) fn split(&mut self, surfel: u32, hits: &[u32]) -> Vec<u32> {
        let (i, r) = (index(surfel), self.largest_radius(surfel));
        let (x, n) = self.surfels[i].plane();
        let walls: Vec<[DVec2; 2]> = hits
            .iter()
            .map(|&t| &self.borders.triangles[index(t)])
            .filter(|t| {
                let m = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
                m.dot(n).abs() < PARALLEL
            })
            .filter_map(|t| wall_of_triangle(t, x, n))
            .filter(|&[a, b]| nearest_on_segment(a, b, DVec2::ZERO).length() < r)
            .collect();
        let mut moved = Vec::new();
        if walls.is_empty() {
            return moved;
        }
        let mut family: Vec<u32> = self.family(surfel).collect();
        for &member in &family {
            let clip = Arc::make_mut(self.clips[index(member)].get_or_insert_default());
            clip.walls.extend(&walls);
            let anchor = clip.anchor;
            rim::clear_anchor(clip, &walls, NUDGE * r);
            if clip.anchor != anchor {
                moved.push(member);
            }
        }
        for &[a, b] in &walls {
            let foot = nearest_on_segment(a, b, DVec2::ZERO);
            let aside = (b - a).perp().normalize_or_zero() * (2.0 * NUDGE * r);
            for probe in [foot + aside, foot - aside] {
                let clip = |m: &u32| self.clips[index(*m)].as_ref();
                let seen = |m: &u32| clip(m).is_none_or(|c| !c.hides(probe));
                if probe.length() >= r || family.len() > MAX_DOUBLES || family.iter().any(seen) {
                    continue;
                }
                let Some(clip) = &self.clips[i] else { continue };
                // What no one sees beyond an edge is air.
                if clip.is_beyond_edge(probe) {
                    continue;
                }
                let clip = Clip {
                    anchor: probe,
                    ..Clip::clone(clip)
                };
                let double = count(self.surfels.len());
                self.surfels.push(self.surfels[i]);
                self.triangles.push(self.triangles[i]);
                self.clips.push(Some(Arc::new(clip)));
                self.doubles.entry(surfel).or_default().push(double);
                family.push(double);
            }
        }
        moved
    }

    /// Distance (m) from a surfel within which its disk, and all lines from its eye to its nodes, lie.
    pub(super) fn reach(&self, surfel: u32) -> f64 {
        let i = index(surfel);
        let aside = self.query(surfel).inner.distance(self.surfels[i].position);
        (self.binding.reach[i] + aside).max(self.largest_radius(surfel))
    }

    /// The radius (m) that a surfel's clip must do for: that of new skin still changes while the
    /// cut grows, and all do that are measured again.
    fn largest_radius(&self, surfel: u32) -> f64 {
        let surfel = &self.surfels[index(surfel)];
        if surfel.material == CAPSULE && self.renewal.is_none() {
            surfel.radius
        } else {
            self.skin_radius()
        }
    }

    /// Whether one of `hits` may come between a surfel and a node that carries it; never a false
    /// no. Only then can its nodes change: what is hidden stays hidden, and a row holds the nearest
    /// nodes that are not. One with fewer, or with some that are seen around a corner, is always
    /// sought again.
    pub(super) fn loses_a_node(&self, surfel: u32, hits: &[u32]) -> bool {
        if self.binding.sight[index(surfel)] == Sight::Poor {
            return true;
        }
        let eye = self.eye(surfel);
        let (nodes, _) = self.binding.row(index(surfel));
        hits.iter().any(|&t| {
            let screen = Screen::new(&self.borders.triangles[index(t)]);
            let hides = |&node: &u32| screen.may_hide(eye, self.rest_nodes[index(node)]);
            nodes.iter().any(hides)
        })
    }

    /// Whether a path around one of `edges` may lead to a node as near as those of a surfel, other than
    /// those it sees.
    pub(super) fn is_beside(&self, surfel: u32, edges: &[[DVec3; 2]]) -> bool {
        if self.binding.sight[index(surfel)] == Sight::Clear {
            return false;
        }
        let (x, reach) = (self.query(surfel).inner, self.binding.reach[index(surfel)]);
        edges
            .iter()
            .any(|&[a, b]| nearest_on_triangle(&[a, b, b], x).distance_squared(x) <= reach * reach)
    }

    /// The point of a disk that sees, in its tangents from its middle (m).
    pub(super) fn anchor(&self, surfel: u32) -> DVec2 {
        let clip = self.clips[index(surfel)].as_ref();
        clip.map_or(DVec2::ZERO, |clip| clip.anchor)
    }

    /// Where a surfel is as a sample of the surface: at its anchor, which is on its own side of a cut.
    pub(super) fn place(&self, surfel: u32) -> DVec3 {
        let anchor = self.anchor(surfel);
        let surfel = &self.surfels[index(surfel)];
        let (t0, t1) = Surfel::tangents(surfel.normal);
        surfel.position + t0 * anchor.x + t1 * anchor.y
    }

    /// The point of a surfel from which nodes are seen: its anchor, a little below the surface.
    pub(super) fn eye(&self, surfel: u32) -> DVec3 {
        let behind = super::BEHIND * self.sampler.spacing();
        self.place(surfel) - self.surfels[index(surfel)].normal * behind
    }
}
