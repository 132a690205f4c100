//! A body's surface that can be cut: surfels, their nodes, new skin and clipped rims.

mod adapt;
mod binding;
mod border;
mod carry;
mod change;
mod drawn;
mod eigen;
mod geometry;
mod grow;
mod memory;
mod near;
mod normals;
mod radii;
mod renew;
mod rim;
mod skin;
mod split;
#[cfg(test)]
mod tests;
mod texture;
mod tree;

pub use adapt::follow_curvature;
use adapt::scatter;
pub use binding::{Binding, WeightLaw};
use binding::{Query, Row, Search, Sight};
use border::Borders;
pub use change::SurfaceChange;
pub use drawn::DrawnTissue;
use eigen::symmetric_eigen;
use geometry::{
    Screen, envelope, line_of_plane, nearest_on_segment, nearest_on_triangle, wall_of_triangle,
};
use memory::{map_bytes, tree_bytes};
pub use near::triangles_near;
pub use normals::estimate_normals;
use radii::{FACE_COSINE, RadiusMap, measure_of, shape_operators, sheet_radius};
pub use radii::{Measure, RadiusRule, covering_radii, measures};
use skin::SkinSample;
pub use skin::{CutSampler, triangle_area};
pub use texture::{CAPSULE, PARENCHYMA, TissueTexture};
use tree::{NodeTree, point_tree};

use crate::cast::{count, index};
use crate::error::SurfelError;
use crate::render::{Clip, Splat, SplatView, Surfel, TexturePlace};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use renew::Renewal;
use rstar::RTree;
use std::collections::HashMap;
use std::sync::Arc;

/// How a tissue is set up.
#[derive(Debug, Clone, PartialEq)]
pub struct TissueSettings {
    /// Nodes per surfel at most.
    pub neighbors: usize,
    /// How their weights fall with the distance.
    pub weights: WeightLaw,
    /// Radii of the outer surface.
    pub radius: RadiusRule,
    /// Samples per m² of cut; `None` takes the outer surface's own (surfels over area).
    pub skin_density: Option<f64>,
    /// Distance by which the two sides of a cut are held apart in the rest frame (m).
    pub opening: f64,
    /// A disk's axis never grows beyond this times its radius: an overstretched node near a cut would otherwise
    /// throw a disk over the picture.
    pub max_stretch: f64,
    /// How it is decided whether a sample of a cut lies in the body.
    pub inside: InsideTest,
    /// Clip splats at the cut's rim and at sharp edges. Off, disks stick out as in Aras 2014,
    /// fig. 80.
    pub clip: bool,
}

impl Default for TissueSettings {
    /// 8 nodes, weights of compact support, radii that just cover, skin as dense as the outside, no opening, stretches up to 3, clipped disks.
    fn default() -> Self {
        Self {
            neighbors: 8,
            weights: WeightLaw::Compact,
            radius: RadiusRule::Covering,
            skin_density: None,
            opening: 0.0,
            max_stretch: 3.0,
            inside: InsideTest::Shape,
            clip: true,
        }
    }
}

/// How it is decided whether a sample of a cut lies in the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum InsideTest {
    /// By the body's own shape: what the caller says of a point.
    #[default]
    Shape,
    /// By the two nearest surfels of the uncut surface, as in Aras 2014, fig. 65, which misjudges thin parts.
    TwoNearest,
}

/// Depth (spacings) below its surfel at which the eye lies.
const BEHIND: f64 = 0.02;

/// What one piece of a cut changed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct CutChange {
    /// All surfels whose disk, clip or nodes may be other than before, new ones included, ascending.
    pub surfels: Vec<u32>,
    /// Surfels of new skin (two per sample inside the body or at its rim).
    pub skin: usize,
    /// Surfels that the cut passes through and that were doubled, one for each side.
    pub doubled: usize,
    /// Surfels whose nodes were sought again.
    pub rebound: usize,
    /// Surfels of skin, new and old, whose radius was computed.
    pub resized: usize,
}

/// A body's surface in the rest frame, with everything a cut changes.
///
/// Order of surfels: the outer ones as given, then in order of appearance new skin and doubles of
/// split surfels. Indices never change.
///
/// # Examples
/// ```
/// use phyxel_splat::glam::{DMat3, DVec3};
/// use phyxel_splat::{Tissue, TissueSettings};
///
/// // A flat patch of 10 x 10 surfels, 1 cm apart, carried by four nodes that move up.
/// let x: Vec<DVec3> = (0..100)
///     .map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10), 0.0) * 0.01)
///     .collect();
/// let nodes = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|p| p * 0.1);
/// let settings = TissueSettings::default();
/// let tissue = Tissue::new(&x, &[DVec3::Z; 100], &[1e-4; 100], &nodes, &settings)?;
/// let mut splats = Vec::new();
/// tissue.carry_into(&nodes.map(|p| p + DVec3::Z), &[DMat3::IDENTITY; 4], &mut splats);
/// assert!((splats[42].position - x[42] - DVec3::Z).length() < 1e-12);
/// # Ok::<(), phyxel_splat::SurfelError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Tissue {
    surfels: Vec<Surfel>,
    binding: Binding,
    clips: Vec<Option<Arc<Clip>>>,
    settings: TissueSettings,
    /// What no cut changes is one for all copies.
    rest_nodes: Arc<[DVec3]>,
    node_tree: Arc<NodeTree>,
    outer_count: usize,
    outer_tree: Arc<NodeTree>,
    skin_tree: NodeTree,
    /// Doubles of a surfel that a cut splits, by the index of the original.
    doubles: HashMap<u32, Vec<u32>>,
    /// Triangle of the cut that each surfel of skin lies on; 0 for the outer ones.
    triangles: Vec<u32>,
    borders: Borders,
    sampler: CutSampler,
    max_reach: f64,
    /// Radii by a measure that are computed again at cuts.
    renewal: Option<Renewal>,
}

impl Tissue {
    /// Binds surface samples to the nodes of an uncut body.
    ///
    /// # Errors
    /// [`SurfelError`] names the first sample or node that is not usable, or slices of samples that differ
    /// in length.
    pub fn new(
        positions: &[DVec3],
        normals: &[DVec3],
        areas: &[f64],
        rest_nodes: &[DVec3],
        settings: &TissueSettings,
    ) -> Result<Self, SurfelError> {
        let (surfels, outer_tree) =
            Surfel::from_samples(positions, normals, areas, settings.radius)?;
        let n = surfels.len();
        if rest_nodes.is_empty() {
            return Err(SurfelError::NoNodes { surfels: n });
        }
        if let Some(node) = rest_nodes.iter().position(|x| !x.is_finite()) {
            return Err(SurfelError::BadNode { node });
        }
        let area: f64 = areas.iter().sum();
        let density = settings
            .skin_density
            .unwrap_or_else(|| n.max(1) as f64 / area.max(f64::MIN_POSITIVE));
        let node_tree = point_tree(rest_nodes);
        let binding = Binding::empty(settings.neighbors, rest_nodes.len());
        let renewal = Renewal::new(settings.radius, positions);
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
            rest_nodes: rest_nodes.into(),
            node_tree: Arc::new(node_tree),
            outer_count: n,
            outer_tree: Arc::new(outer_tree),
            skin_tree: RTree::new(),
            doubles: HashMap::new(),
            triangles: vec![0; n],
            borders: Borders::default(),
            sampler: CutSampler::new(density),
            max_reach: 0.0,
            renewal,
        };
        let all: Vec<u32> = (0..count(n)).collect();
        tissue.rebind(&all, &|_| true, &|_, _| false);
        Ok(tissue)
    }

    /// The surfels, rest frame.
    #[must_use]
    pub fn surfels(&self) -> &[Surfel] {
        &self.surfels
    }

    /// Heap bytes that a copy takes for itself. What copies share, the nodes and the outer surface's search tree,
    /// is not counted, and of a clip its part; search trees and hash tables are estimated.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let share = |clip: &Arc<Clip>| {
            let lists = size_of_val(&*clip.edges) + size_of_val(&*clip.walls);
            (size_of_val(&**clip) + lists) / Arc::strong_count(clip)
        };
        let clips: usize = self.clips.iter().flatten().map(share).sum();
        let doubles: usize = self.doubles.values().map(|all| size_of_val(&**all)).sum();
        size_of_val(&*self.surfels)
            + self.binding.bytes()
            + size_of_val(&*self.clips)
            + clips
            + tree_bytes(&self.skin_tree)
            + map_bytes(&self.doubles)
            + doubles
            + size_of_val(&*self.triangles)
            + self.borders.bytes()
            + self.sampler.bytes()
    }

    /// Nodes of each surfel.
    #[must_use]
    pub fn binding(&self) -> &Binding {
        &self.binding
    }

    /// What bounds each surfel's disk, if anything.
    #[must_use]
    pub fn clips(&self) -> &[Option<Arc<Clip>>] {
        &self.clips
    }

    /// Number of surfels of the uncut surface; they come first.
    #[must_use]
    pub fn outer_count(&self) -> usize {
        self.outer_count
    }

    /// Lays images on the surface of an uncut body: the position of each surfel in one, if it has any. Doubles of
    /// split surfels keep it, new skin has none.
    ///
    /// # Panics
    /// If there is not one entry per surfel.
    pub fn set_places(&mut self, places: Vec<Option<TexturePlace>>) {
        assert_eq!(places.len(), self.surfels.len(), "one place per surfel");
        for (surfel, place) in self.surfels.iter_mut().zip(places) {
            surfel.place = place;
        }
    }

    /// What the renderer needs: carried splats and one linear colour per surfel.
    #[must_use]
    pub fn view<'a>(&'a self, splats: &'a [Splat], colors: &'a [Vec3]) -> SplatView<'a> {
        SplatView {
            clips: &self.clips,
            ..SplatView::new(splats, &self.surfels, colors)
        }
    }

    /// Takes in new triangles of a cut (rest frame): new skin on both sides, disks split and
    /// clipped at the cut, nodes sought again for surfels near it. Costs in proportion to what the
    /// triangles touch.
    ///
    /// Skin ends at the body's surface and at older cuts; at the edges that only one triangle of the
    /// cut has, its disks reach on into the tissue that hides them. Its radii are those of
    /// [`crate::covering_radii`] within one sheet of skin, at most 1.3 spacings, computed again where
    /// samples are new. Radii of the outer surface stay: the parts of a split disk cover what it
    /// covered. [`RadiusRule::Mapped`] may ask for another: then all surfels are measured again among those of
    /// their own side, which takes time in proportion to their number.
    ///
    /// `inside(x)` says whether a rest point lies in the uncut body; `crosses(a, b)` whether the
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
        let is_bad = |t: &[DVec3; 3]| t.iter().any(|p| !p.is_finite());
        if let Some(triangle) = triangles.iter().position(is_bad) {
            return Err(SurfelError::BadTriangle { triangle });
        }
        let mut change = CutChange::default();
        let first_triangle = count(self.borders.triangles.len());
        let turned = self.borders.extend(triangles);
        let near = self.near(first_triangle..count(self.borders.triangles.len()));
        let mut touched: Vec<u32> = Vec::new();
        let before_all = count(self.surfels.len());
        for (surfel, hits) in &near {
            let before = self.surfels.len();
            let moved = if self.settings.clip {
                self.split(*surfel, hits)
            } else {
                Vec::new()
            };
            change.doubled += self.surfels.len() - before;
            let fresh = count(before)..count(self.surfels.len());
            for member in self.family(*surfel) {
                if fresh.contains(&member)
                    || moved.contains(&member)
                    || self.loses_a_node(member, hits)
                    || self.is_beside(member, &turned)
                {
                    touched.push(member);
                }
            }
        }
        change.rebound = touched.len();
        self.rebind(&touched, inside, crosses);
        let first = count(self.surfels.len());
        let resized = self.grow_skin(triangles, first_triangle, inside, &mut change);
        let seen = near.iter().map(|(surfel, _)| surfel);
        change.surfels = self.families(seen.chain(&resized));
        change.surfels.retain(|surfel| *surfel < before_all);
        change.surfels.extend(before_all..count(self.surfels.len()));
        let new: Vec<u32> = (first..count(self.surfels.len())).collect();
        self.rebind(&new, inside, crosses);
        if let Some(renewal) = self.renewal {
            change.surfels.extend(self.renew_radii(renewal, crosses));
            change.surfels.sort_unstable();
            change.surfels.dedup();
        }
        Ok(change)
    }

    /// Leaves each surfel the nodes of one piece, that which carries most of it; those that others carried, too, ascending.
    /// To be called after a cut that parts pieces: a point on a rim sees nodes around a cut's end that nothing links to its
    /// own, and skin is drawn out across the gap.
    ///
    /// # Arguments
    /// * `pieces` -- label of the connected piece of each node.
    ///
    /// # Panics
    /// If there is not one label per node.
    pub fn part(&mut self, pieces: &[u32]) -> Vec<u32> {
        assert_eq!(pieces.len(), self.rest_nodes.len(), "one label per node");
        let all = 0..count(self.surfels.len());
        all.filter(|&surfel| self.binding.keep_to_one(index(surfel), pieces))
            .collect()
    }

    /// Surfels with their doubles, ascending.
    fn families<'a>(&self, of: impl Iterator<Item = &'a u32>) -> Vec<u32> {
        let mut all: Vec<u32> = of.flat_map(|&surfel| self.family(surfel)).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// A surfel and its doubles.
    fn family(&self, surfel: u32) -> impl Iterator<Item = u32> + '_ {
        let doubles = self.doubles.get(&surfel).into_iter().flatten();
        std::iter::once(surfel).chain(doubles.copied())
    }

    /// Seeks nodes again for the given surfels.
    fn rebind(
        &mut self,
        of: &[u32],
        inside: &(dyn Fn(DVec3) -> bool + Sync),
        crosses: &(dyn Fn(DVec3, DVec3) -> bool + Sync),
    ) {
        self.binding.extend_to(self.surfels.len());
        let ahead = BEHIND * self.sampler.spacing();
        let search = Search {
            law: self.settings.weights,
            stride: self.binding.stride(),
            nodes: &self.rest_nodes,
            tree: &self.node_tree,
            visible: &|a, b| !crosses(a, b),
            way_round: &|query, radius| {
                let corner = self.borders.way_round(query.inner, radius, ahead)?;
                inside(corner).then_some(corner)
            },
        };
        let row = |&surfel: &u32| search.row(&self.query(surfel));
        let rows: Vec<Row> = of.par_iter().map(row).collect();
        for (&s, row) in of.iter().zip(&rows) {
            self.binding.store(index(s), row);
            self.max_reach = self.max_reach.max(self.reach(s));
        }
    }

    /// Where a surfel looks for nodes: from its anchor, a little below the surface.
    fn query(&self, surfel: u32) -> Query {
        let Surfel {
            normal, material, ..
        } = self.surfels[index(surfel)];
        let eye = self.eye(surfel);
        let (anchor, depth) = (self.anchor(surfel), self.skin_radius());
        let inner = if material == CAPSULE {
            eye - normal * depth
        } else {
            // As deep below the body's surface: skin at a rim goes around a cut's end as the surface beside it does.
            let mut inner = anchor;
            let clip = self.clips[index(surfel)].as_ref();
            for &(direction, offset) in clip.iter().flat_map(|clip| &clip.edges) {
                inner -= direction * (inner.dot(direction) - (offset - depth)).max(0.0);
            }
            let (t0, t1) = Surfel::tangents(normal);
            eye + t0 * (inner.x - anchor.x) + t1 * (inner.y - anchor.y)
        };
        Query {
            eye,
            inner,
            normal,
            anchor,
        }
    }
}
