//! A body's surface that can be cut: surfels, their nodes, new skin and clipped rims.

use crate::binding::{BindSettings, Binding, NodeTree, point_tree};
use crate::carry::{Splats, carry_into};
use crate::cast::{count, index};
use crate::clip::{Clip, Screen, nearest_on_segment, nearest_on_triangle, wall_of_triangle};
use crate::error::SurfelError;
use crate::radii::{RadiusRule, shape_operators};
use crate::rim::{self, SkinDisk};
use crate::scene::SplatView;
use crate::skin::CutSampler;
use crate::surfels::Surfels;
use crate::texture::{CAPSULE, PARENCHYMA};
use glam::{DMat3, DVec2, DVec3, Vec3};
use rstar::primitives::GeomWithData;
use rstar::{AABB, RTree};
use std::collections::HashMap;

/// How a tissue is set up.
#[derive(Debug, Clone, PartialEq)]
pub struct TissueSettings {
    /// Nodes per surfel.
    pub bind: BindSettings,
    /// Radii of the outer surface.
    pub radius: RadiusRule,
    /// Samples per m² of cut; `None` takes the outer surface's own (surfels over area).
    pub skin_density: Option<f64>,
    /// Distance by which the two sides of a cut are held apart in the rest frame (m).
    pub opening: f64,
    /// Largest stretch a disk follows, see [`carry_into`].
    pub max_stretch: f64,
    /// Clip splats at the cut's rim and at sharp edges. Off, disks stick out as in Aras 2014,
    /// fig. 80.
    pub clip: bool,
}

impl Default for TissueSettings {
    fn default() -> Self {
        Self {
            bind: BindSettings::default(),
            radius: RadiusRule::Covering,
            skin_density: None,
            opening: 0.0,
            max_stretch: 3.0,
            clip: true,
        }
    }
}

/// What one piece of a cut changed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CutChange {
    /// Samples on the new triangles, inside and outside the body.
    pub samples: usize,
    /// Surfels of new skin (two per sample inside the body or at its rim).
    pub skin: usize,
    /// Surfels that the cut passes through and that were doubled, one for each side.
    pub doubled: usize,
    /// Surfels whose nodes were sought again.
    pub rebound: usize,
}

/// A body's surface in the rest frame, with everything a cut changes.
///
/// Order of surfels: the outer ones as given, then in order of appearance new skin and doubles of
/// split surfels. Indices never change.
#[derive(Debug, Clone)]
pub struct Tissue {
    surfels: Surfels,
    binding: Binding,
    clips: Vec<Option<Box<Clip>>>,
    settings: TissueSettings,
    rest_nodes: Vec<DVec3>,
    node_tree: NodeTree,
    outer_count: usize,
    outer_tree: NodeTree,
    skin_tree: NodeTree,
    /// Doubles of a surfel that a cut splits, by the index of the original.
    doubles: HashMap<u32, Vec<u32>>,
    sampler: CutSampler,
    max_reach: f64,
}

/// Clearance of an anchor from a wall, in radii.
const NUDGE: f64 = 0.05;
/// Doubles of one surfel at most: a disk diced into more pieces is smaller than a node's share.
const MAX_DOUBLES: usize = 7;
/// A cut this parallel to a disk (cosine of normals) does not bound it.
const PARALLEL: f64 = 0.9;
/// Radius of new skin in units of its spacing; the sampler's holes stay below that.
const SKIN_RADIUS: f64 = 1.3;

impl Tissue {
    /// Binds surface samples to the nodes of an uncut body.
    ///
    /// # Errors
    /// [`SurfelError`] names the first sample or node that is not usable.
    ///
    /// # Panics
    /// If the slices of samples differ in length.
    pub fn new(
        positions: &[DVec3],
        normals: &[DVec3],
        areas: &[f64],
        rest_nodes: &[DVec3],
        settings: &TissueSettings,
    ) -> Result<Self, SurfelError> {
        let mut surfels = Surfels::from_samples(positions, normals, areas)?;
        let n = surfels.len();
        if rest_nodes.is_empty() {
            return Err(SurfelError::NoNodes { surfels: n });
        }
        if let Some(node) = rest_nodes.iter().position(|x| !x.is_finite()) {
            return Err(SurfelError::BadNode { node });
        }
        surfels.radii = settings.radius.radii(&surfels.positions, &surfels.normals);
        surfels.materials.fill(CAPSULE);
        surfels.shapes = shape_operators(&surfels.positions, &surfels.normals);
        let area: f64 = areas.iter().sum();
        let density = settings
            .skin_density
            .unwrap_or_else(|| crate::cast::real(n.max(1)) / area.max(f64::MIN_POSITIVE));
        let node_tree = point_tree(rest_nodes);
        let binding = Binding::empty(&settings.bind, rest_nodes.len());
        let outer_tree = point_tree(&surfels.positions);
        let clips = if settings.clip {
            rim::sharp_edges(&surfels, &outer_tree)
        } else {
            vec![None; n]
        };
        let mut tissue = Self {
            surfels,
            binding,
            clips,
            settings: settings.clone(),
            rest_nodes: rest_nodes.to_vec(),
            node_tree,
            outer_count: n,
            outer_tree,
            skin_tree: RTree::new(),
            doubles: HashMap::new(),
            sampler: CutSampler::new(density),
            max_reach: 0.0,
        };
        let all: Vec<u32> = (0..count(n)).collect();
        tissue.rebind(&all, &|_, _| false);
        Ok(tissue)
    }

    /// The surfels, rest frame.
    #[must_use]
    pub fn surfels(&self) -> &Surfels {
        &self.surfels
    }

    /// Nodes of each surfel.
    #[must_use]
    pub fn binding(&self) -> &Binding {
        &self.binding
    }

    /// What bounds each surfel's disk, if anything.
    #[must_use]
    pub fn clips(&self) -> &[Option<Box<Clip>>] {
        &self.clips
    }

    /// Number of surfels of the uncut surface; they come first.
    #[must_use]
    pub fn outer_count(&self) -> usize {
        self.outer_count
    }

    /// Carries all surfels, see [`carry_into`].
    ///
    /// # Panics
    /// If there is not one position and one gradient per node.
    pub fn carry_into(&self, nodes: &[DVec3], gradients: &[DMat3], splats: &mut Splats) {
        carry_into(
            &self.surfels,
            &self.binding,
            &self.rest_nodes,
            nodes,
            gradients,
            self.settings.max_stretch,
            splats,
        );
    }

    /// What the renderer needs: carried splats and one linear colour per surfel.
    #[must_use]
    pub fn view<'a>(&'a self, splats: &'a Splats, colors: &'a [Vec3]) -> SplatView<'a> {
        SplatView {
            splats,
            colors,
            materials: &self.surfels.materials,
            texture_points: &self.surfels.positions,
            clips: &self.clips,
            radii: &self.surfels.radii,
        }
    }

    /// Takes in new triangles of a cut (rest frame): new skin on both sides, disks split and
    /// clipped at the cut, nodes sought again for surfels near it. Costs in proportion to what the
    /// triangles touch.
    ///
    /// `inside(x)` tells whether a rest point lies in the uncut body; `crosses(a, b)` whether the
    /// segment a-b crosses the cut, all of it, the new triangles included. Triangles of one cut
    /// are oriented alike; the two sides of the skin get normals along plus and minus the
    /// triangle's normal, each pointing out of its own piece.
    ///
    /// # Errors
    /// [`SurfelError::BadTriangle`]; nothing is changed then.
    pub fn cut(
        &mut self,
        triangles: &[[DVec3; 3]],
        inside: &(dyn Fn(DVec3) -> bool + Sync),
        crosses: &(dyn Fn(DVec3, DVec3) -> bool + Sync),
    ) -> Result<CutChange, SurfelError> {
        if let Some(triangle) = triangles
            .iter()
            .position(|t| t.iter().any(|p| !p.is_finite()))
        {
            return Err(SurfelError::BadTriangle { triangle });
        }
        let mut change = CutChange::default();
        let near = self.near(triangles);
        let mut touched: Vec<u32> = Vec::new();
        for (surfel, hits) in &near {
            let before = self.surfels.len();
            let moved = if self.settings.clip {
                self.split(*surfel, hits, triangles)
            } else {
                Vec::new()
            };
            change.doubled += self.surfels.len() - before;
            let fresh = count(before)..count(self.surfels.len());
            let family = self.doubles.get(surfel).into_iter().flatten();
            for &member in std::iter::once(surfel).chain(family) {
                if fresh.contains(&member)
                    || moved.contains(&member)
                    || self.loses_a_node(member, hits, triangles)
                {
                    touched.push(member);
                }
            }
        }
        change.rebound = touched.len();
        self.rebind(&touched, crosses);
        let first = self.surfels.len();
        change.samples = self.grow_skin(triangles, inside);
        change.skin = self.surfels.len() - first;
        let fresh: Vec<u32> = (count(first)..count(self.surfels.len())).collect();
        self.rebind(&fresh, crosses);
        Ok(change)
    }

    /// Originals (outer and skin) whose disk or nodes new triangles may touch, in order, each with
    /// the triangles in reach.
    fn near(&self, triangles: &[[DVec3; 3]]) -> Vec<(u32, Vec<u32>)> {
        let mut hits: Vec<(u32, u32)> = Vec::new();
        for (t, triangle) in triangles.iter().enumerate() {
            let low = triangle[0].min(triangle[1]).min(triangle[2]) - self.max_reach;
            let high = triangle[0].max(triangle[1]).max(triangle[2]) + self.max_reach;
            let envelope = AABB::from_corners(low.to_array(), high.to_array());
            for tree in [&self.outer_tree, &self.skin_tree] {
                for p in tree.locate_in_envelope(envelope) {
                    let i = index(p.data);
                    let x = self.surfels.positions[i];
                    let family = self.doubles.get(&p.data).into_iter().flatten();
                    let reach = family
                        .map(|&double| self.reach(double))
                        .fold(self.reach(p.data), f64::max);
                    if nearest_on_triangle(triangle, x).distance_squared(x) <= reach * reach {
                        hits.push((p.data, count(t)));
                    }
                }
            }
        }
        hits.sort_unstable();
        let mut out: Vec<(u32, Vec<u32>)> = Vec::new();
        for (surfel, triangle) in hits {
            match out.last_mut() {
                Some(last) if last.0 == surfel => last.1.push(triangle),
                _ => out.push((surfel, vec![triangle])),
            }
        }
        out
    }

    /// Adds the walls of new triangles to a surfel and its doubles, and doubles it again for every
    /// part of the disk that no anchor sees any more. Returns those whose anchor moved.
    fn split(&mut self, surfel: u32, hits: &[u32], triangles: &[[DVec3; 3]]) -> Vec<u32> {
        let i = index(surfel);
        let (x, n, r) = (
            self.surfels.positions[i],
            self.surfels.normals[i],
            self.surfels.radii[i],
        );
        let walls: Vec<[DVec2; 2]> = hits
            .iter()
            .map(|&t| &triangles[index(t)])
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
        let mut family = vec![surfel];
        family.extend(self.doubles.get(&surfel).into_iter().flatten());
        for &member in &family {
            let clip = self.clips[index(member)].get_or_insert_default();
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
                let seen = |m: &u32| {
                    self.clips[index(*m)]
                        .as_ref()
                        .is_none_or(|c| !c.hides(probe))
                };
                if probe.length() >= r || family.len() > MAX_DOUBLES || family.iter().any(seen) {
                    continue;
                }
                let Some(clip) = &self.clips[i] else { continue };
                let clip = Clip {
                    anchor: probe,
                    walls: clip.walls.clone(),
                };
                // Sharp edges of the surface bound the doubles too: a probe beyond one is air.
                if self.beyond_edge(surfel, probe) {
                    continue;
                }
                let double = count(self.surfels.len());
                self.push_surfel(x, n, self.surfels.areas[i], r, self.surfels.materials[i]);
                self.surfels.shapes[index(double)] = self.surfels.shapes[i];
                self.clips.push(Some(Box::new(clip)));
                self.doubles.entry(surfel).or_default().push(double);
                family.push(double);
            }
        }
        self.rows_for_new();
        moved
    }

    /// Distance (m) from a surfel within which its disk, and all lines from its eye to its nodes, lie.
    fn reach(&self, surfel: u32) -> f64 {
        let i = index(surfel);
        let aside = self.eye(surfel).distance(self.surfels.positions[i]);
        (self.binding.reach(i) + aside).max(self.surfels.radii[i])
    }

    /// Whether one of `hits` may come between a surfel and a node that carries it; never a false
    /// no. Only then can its nodes change: what is hidden stays hidden, and a row holds the nearest
    /// nodes that are not.
    fn loses_a_node(&self, surfel: u32, hits: &[u32], triangles: &[[DVec3; 3]]) -> bool {
        let eye = self.eye(surfel);
        let (nodes, _) = self.binding.row(index(surfel));
        hits.iter().any(|&t| {
            let screen = Screen::new(&triangles[index(t)]);
            nodes
                .iter()
                .any(|&node| screen.may_hide(eye, self.rest_nodes[index(node)]))
        })
    }

    /// The point of a surfel from which nodes are seen: its anchor, a little below the surface.
    fn eye(&self, surfel: u32) -> DVec3 {
        let i = index(surfel);
        let n = self.surfels.normals[i];
        let (t0, t1) = Surfels::tangents(n);
        let anchor = self.clips[i].as_ref().map_or(DVec2::ZERO, |c| c.anchor);
        let behind = 0.02 * self.sampler.spacing();
        self.surfels.positions[i] + t0 * anchor.x + t1 * anchor.y - n * behind
    }

    /// True if `probe` lies outside a sharp edge of the surface that bounds `surfel`.
    fn beyond_edge(&self, surfel: u32, probe: DVec2) -> bool {
        let i = index(surfel);
        let (t0, t1) = Surfels::tangents(self.surfels.normals[i]);
        let at = self.surfels.positions[i] + t0 * probe.x + t1 * probe.y;
        rim::outside_of_edges(&self.surfels, &self.outer_tree, i, at)
    }

    fn push_surfel(&mut self, x: DVec3, n: DVec3, area: f64, r: f64, material: u8) {
        self.surfels.push(x, n, area, r, material);
    }

    /// Gives surfels without a binding row one that [`Self::rebind`] replaces.
    fn rows_for_new(&mut self) {
        let missing = self.surfels.len() - self.binding.len();
        if missing > 0 {
            self.binding.push_placeholders(missing);
        }
    }

    /// Seeks nodes again for the given surfels.
    fn rebind(&mut self, of: &[u32], crosses: &(dyn Fn(DVec3, DVec3) -> bool + Sync)) {
        self.rows_for_new();
        let queries: Vec<(DVec3, DVec3)> = of
            .iter()
            .map(|&s| {
                let eye = self.eye(s);
                (eye, eye)
            })
            .collect();
        let visible = |a: DVec3, b: DVec3| !crosses(a, b);
        let rows = self.binding.rows(
            &queries,
            &self.rest_nodes,
            &self.node_tree,
            &self.settings.bind,
            &visible,
        );
        for (&s, row) in of.iter().zip(&rows) {
            self.binding.store(index(s), row);
            self.max_reach = self.max_reach.max(self.reach(s));
        }
    }

    /// New skin on triangles: two surfels per sample inside the body, and beside its rim.
    fn grow_skin(
        &mut self,
        triangles: &[[DVec3; 3]],
        inside: &(dyn Fn(DVec3) -> bool + Sync),
    ) -> usize {
        let spacing = self.sampler.spacing();
        let radius = SKIN_RADIUS * spacing;
        let samples = self.sampler.sample(triangles);
        for sample in &samples {
            for side in [1.0, -1.0] {
                let normal = sample.normal * side;
                let disk = SkinDisk {
                    point: sample.point,
                    normal,
                    radius,
                };
                let clip = if self.settings.clip {
                    let Some(clip) =
                        rim::at_surface(&disk, &self.surfels, &self.outer_tree, inside)
                    else {
                        continue;
                    };
                    clip
                } else if inside(sample.point) {
                    Clip::default()
                } else {
                    continue;
                };
                let at = sample.point - normal * (0.5 * self.settings.opening);
                let i = count(self.surfels.len());
                self.push_surfel(at, normal, spacing * spacing, radius, PARENCHYMA);
                self.clips
                    .push((!clip.walls.is_empty()).then(|| Box::new(clip)));
                self.skin_tree.insert(GeomWithData::new(at.to_array(), i));
            }
        }
        self.rows_for_new();
        samples.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::cloud::{Random, lattice};

    /// Whether the segment p-q crosses a triangle, by the signs of three volumes.
    fn meets(&[a, b, c]: &[DVec3; 3], p: DVec3, q: DVec3) -> bool {
        let volume = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| (b - a).cross(c - a).dot(d - a);
        let sides = (volume(a, b, c, p) > 0.0) != (volume(a, b, c, q) > 0.0);
        let turns = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
        sides && (turns.iter().all(|&v| v > 0.0) || turns.iter().all(|&v| v < 0.0))
    }

    /// A slab's surface over random nodes is cut along a wavy way, piece by piece: what was bound
    /// piece by piece is what binding every surfel anew under the whole cut gives.
    #[test]
    fn binding_again_only_what_loses_a_node_equals_binding_all_again() {
        let mut random = Random::new(11);
        let (mut x, mut n, mut a) = (vec![], vec![], vec![]);
        for i in 0..1600 {
            let jitter = random.vector(0.01);
            let at = DVec3::new(f64::from(i % 40), f64::from(i / 40), 0.0) / 40.0 - 0.49;
            x.push(DVec3::new(at.x + jitter.x, at.y + jitter.y, 0.5));
            n.push(DVec3::Z);
            a.push(1.0 / 1600.0);
        }
        let nodes: Vec<DVec3> = lattice([9, 9, 9], 1.0 / 8.0, 0.2, 5)
            .into_iter()
            .map(|p| p - 0.5)
            .collect();
        let mut tissue = Tissue::new(&x, &n, &a, &nodes, &TissueSettings::default())
            .expect("the samples are sound");
        let inside = |p: DVec3| p.abs().max_element() < 0.5;
        let edge = |k: i32| {
            let at = DVec3::new(
                0.07 * (0.9 * f64::from(k)).sin(),
                0.09 * f64::from(k) - 0.4,
                0.0,
            );
            [at + 0.9 * DVec3::Z, at - 0.17 * DVec3::Z]
        };
        let mut whole: Vec<[DVec3; 3]> = Vec::new();
        let (mut rebound, mut all) = (0, 0);
        for k in 0..9 {
            let ([a, b], [c, d]) = (edge(k), edge(k + 1));
            let new = [[a, b, c], [c, b, d]];
            whole.extend(new);
            let crosses = |p: DVec3, q: DVec3| whole.iter().any(|t| meets(t, p, q));
            rebound += tissue.cut(&new, &inside, &crosses).expect("finite").rebound;
            all += tissue.surfels().len();
            let mut again = tissue.clone();
            let every: Vec<u32> = (0..count(again.surfels.len())).collect();
            again.rebind(&every, &crosses);
            let other = (0..every.len())
                .filter(|&i| again.binding.row(i) != tissue.binding.row(i))
                .count();
            assert_eq!(other, 0, "rows of other nodes after piece {k}");
        }
        assert!(!tissue.doubles.is_empty(), "the cut splits disks");
        assert!(5 * rebound < all, "{rebound} of {all} were sought again");
    }
}
