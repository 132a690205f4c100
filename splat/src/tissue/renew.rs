//! Radii by a measure, computed again where a cut changed what is measured.

use super::Tissue;
use crate::cast::{count, index};
use crate::tissue::geometry::{envelope, nearest_on_triangle};
use crate::tissue::radii::{FACE_COSINE, Measure, RadiusMap, RadiusRule, measure_of, measures};
use crate::tissue::texture::CAPSULE;
use crate::tissue::tree::NodeTree;
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// Surfels looked at for each neighbour that is wanted, before one beside a cut is content with fewer: half of
/// those nearby are on the other side, and as many again where a second cut meets the first.
const LOOKED_AT: usize = 4;

/// What is kept of a rule by a measure for cuts to come.
#[derive(Debug, Clone)]
pub(super) struct Renewal {
    measure: Measure,
    neighbors: usize,
    map: RadiusMap,
    /// Distance from each surfel within which its neighbours were sought (m).
    reach: Vec<f64>,
}

impl Renewal {
    /// Heap bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.reach)
    }

    /// That of a rule which asks for it, on the uncut surface.
    pub(super) fn new(rule: RadiusRule, positions: &[DVec3], tree: &NodeTree) -> Option<Self> {
        let RadiusRule::Mapped {
            measure,
            neighbors,
            least,
            most,
            at_cuts: true,
        } = rule
        else {
            return None;
        };
        let neighbors = index(neighbors);
        let values = measures(positions, measure, neighbors);
        let farthest = |x: &DVec3| {
            let last = tree.nearest_neighbor_iter(x.to_array()).nth(neighbors);
            last.map_or(f64::INFINITY, |p| positions[index(p.data)].distance(*x))
        };
        Some(Self {
            measure,
            neighbors,
            map: RadiusMap::of(&values, measure, [least, most]),
            reach: positions.par_iter().map(farthest).collect(),
        })
    }

    /// The largest radius (m).
    pub(super) fn most(&self) -> f64 {
        self.map.most()
    }
}

impl Tissue {
    /// Measures again what new triangles may have touched, and all surfels from `first` on; those whose
    /// radius was computed, ascending.
    pub(super) fn renew_radii(
        &mut self,
        new: Range<u32>,
        first: u32,
        crosses: &(dyn Fn(DVec3, DVec3) -> bool + Sync),
    ) -> Vec<u32> {
        let mut touched = self.touched(new, first);
        touched.extend(first..count(self.surfels.len()));
        touched.sort_unstable();
        touched.dedup();
        let measured: Vec<(f64, f64)> = touched
            .par_iter()
            .map(|&surfel| self.measured(surfel, crosses))
            .collect();
        let Some(renewal) = &mut self.renewal else {
            return Vec::new();
        };
        renewal.reach.resize(self.surfels.len(), 0.0);
        for (&surfel, (radius, reach)) in touched.iter().zip(measured) {
            self.surfels.radii[index(surfel)] = radius;
            renewal.reach[index(surfel)] = reach;
        }
        touched
    }

    /// Surfels, their doubles included, in whose neighbourhood new triangles lie or surfels from `first` on, which
    /// may be samples of triangles of before; never one too few: no part of a disk is farther from its
    /// middle than the largest radius.
    fn touched(&self, new: Range<u32>, first: u32) -> Vec<u32> {
        let Some(renewal) = &self.renewal else {
            return Vec::new();
        };
        let slack = 2.0 * renewal.most() + self.settings.opening;
        let farthest = renewal.reach.iter().copied().fold(0.0, f64::max) + slack;
        let reach = |surfel: u32| renewal.reach.get(index(surfel)).map_or(0.0, |r| r + slack);
        let mut out = Vec::new();
        let triangles = new.map(|t| self.borders.triangles()[index(t)]);
        let samples = &self.surfels.positions[index(first)..];
        for triangle in triangles.chain(samples.iter().map(|&x| [x; 3])) {
            let envelope = envelope(&triangle, farthest);
            for tree in [&self.outer_tree, &self.skin_tree] {
                for p in tree.locate_in_envelope(envelope) {
                    let x = self.surfels.positions[index(p.data)];
                    let apart = nearest_on_triangle(&triangle, x).distance(x);
                    let family = self.family(p.data);
                    out.extend(family.filter(|&member| apart <= reach(member)));
                }
            }
        }
        out
    }

    /// The radius (m) of a surfel by its neighbours of the same side, and the distance (m) within which they
    /// were sought. Sheets that a later piece of a cut joins count as two until it comes near.
    pub(super) fn measured(
        &self,
        surfel: u32,
        crosses: &(dyn Fn(DVec3, DVec3) -> bool + Sync),
    ) -> (f64, f64) {
        let Some(renewal) = &self.renewal else {
            return (self.surfels.radii[index(surfel)], 0.0);
        };
        let (x, eye) = (self.place(surfel), self.eye(surfel));
        let most = LOOKED_AT * renewal.neighbors;
        let mut around: Vec<(f64, u32)> = Vec::new();
        for tree in [&self.outer_tree, &self.skin_tree] {
            let mut farthest = 0.0;
            for (k, p) in tree.nearest_neighbor_iter(x.to_array()).enumerate() {
                let away = self.surfels.positions[index(p.data)].distance_squared(x);
                // All that are equally far, so that the tree's order decides nothing.
                if k > most + 1 && away > farthest {
                    break;
                }
                farthest = away;
                let family = self.family(p.data);
                around.extend(family.map(|j| (self.place(j).distance_squared(x), j)));
            }
        }
        around.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        around.retain(|&(_, other)| other != surfel);
        // What lies beyond the last that may be looked at has no say.
        let horizon = around.get(most).map_or(f64::INFINITY, |next| next.0);
        let mut near = Vec::with_capacity(renewal.neighbors);
        let (mut hidden, mut reach) = (false, 0.0);
        for &(away, other) in around.iter().take(most) {
            if near.len() == renewal.neighbors {
                break;
            }
            reach = away;
            if self.is_same_sheet(surfel, other) || !crosses(eye, self.eye(other)) {
                near.push(self.place(other));
            } else {
                hidden = true;
            }
        }
        if hidden || near.len() < renewal.neighbors {
            reach = horizon;
        }
        let value = measure_of(x, &near, renewal.measure);
        (renewal.map.radius(value), reach.sqrt())
    }

    /// Whether two surfels are skin of the same side of one sheet: where a cut bends, it comes between them
    /// without parting them.
    fn is_same_sheet(&self, a: u32, b: u32) -> bool {
        let (a, b) = (index(a), index(b));
        let (materials, normals) = (&self.surfels.materials, &self.surfels.normals);
        let sheet = |i: usize| self.borders.sheet(self.triangles[i]);
        materials[a] != CAPSULE
            && materials[b] != CAPSULE
            && normals[a].dot(normals[b]) > FACE_COSINE
            && sheet(a) == sheet(b)
    }
}
