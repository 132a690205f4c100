//! Radii by a measure, computed again after a cut.

use super::Tissue;
use crate::cast::{count, index};
use crate::tissue::{CAPSULE, FACE_COSINE, Measure, RadiusMap, RadiusRule, measure_of, measures};
use glam::DVec3;
use rayon::prelude::*;

/// Surfels looked at for each neighbour that is wanted, before one beside a cut is content with fewer: half of
/// those nearby are on the other side, and as many again where a second cut meets the first.
const LOOKED_AT: usize = 4;

/// What is kept of a rule by a measure for cuts to come.
#[derive(Debug, Clone, Copy)]
pub(super) struct Renewal {
    measure: Measure,
    neighbors: usize,
    pub(super) map: RadiusMap,
}

impl Renewal {
    /// That of a rule which asks for it, on the uncut surface.
    pub(super) fn new(rule: RadiusRule, positions: &[DVec3]) -> Option<Self> {
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
        Some(Self {
            measure,
            neighbors,
            map: RadiusMap::of(&values, measure, [least, most]),
        })
    }
}

impl Tissue {
    /// Measures all surfels again; those whose radius changed, ascending.
    pub(super) fn renew_radii(
        &mut self,
        renewal: Renewal,
        crosses: &(dyn Fn(DVec3, DVec3) -> bool + Sync),
    ) -> Vec<u32> {
        let all = 0..count(self.surfels.len());
        let radius = |surfel| self.measured(surfel, renewal, crosses);
        let radii: Vec<f64> = all.clone().into_par_iter().map(radius).collect();
        let surfels = all.zip(&mut self.surfels).zip(radii);
        let changed = surfels.filter_map(|((number, surfel), radius)| {
            let before = std::mem::replace(&mut surfel.radius, radius);
            (before.to_bits() != radius.to_bits()).then_some(number)
        });
        changed.collect()
    }

    /// The radius (m) of a surfel by its neighbours of the same side.
    fn measured(
        &self,
        surfel: u32,
        renewal: Renewal,
        crosses: &(dyn Fn(DVec3, DVec3) -> bool + Sync),
    ) -> f64 {
        let (x, eye) = (self.place(surfel), self.eye(surfel));
        let most = LOOKED_AT * renewal.neighbors;
        let mut around: Vec<(f64, u32)> = Vec::new();
        for tree in [&self.outer_tree, &self.skin_tree] {
            let mut farthest = 0.0;
            for (k, p) in tree.nearest_neighbor_iter(x.to_array()).enumerate() {
                let away = self.surfels[index(p.data)].position.distance_squared(x);
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
        let others = around.iter().take(most).map(|&(_, other)| other);
        let seen =
            |other: &u32| self.is_same_sheet(surfel, *other) || !crosses(eye, self.eye(*other));
        let near = others.filter(seen).take(renewal.neighbors);
        let near: Vec<DVec3> = near.map(|other| self.place(other)).collect();
        renewal.map.radius(measure_of(x, &near, renewal.measure))
    }

    /// Whether two surfels are skin of the same side of one sheet: where a cut bends, it comes between them
    /// without parting them.
    fn is_same_sheet(&self, a: u32, b: u32) -> bool {
        let [one, other] = [a, b].map(|surfel| &self.surfels[index(surfel)]);
        let sheet = |surfel: u32| self.borders.sheet(self.triangles[index(surfel)]);
        one.material != CAPSULE
            && other.material != CAPSULE
            && one.normal.dot(other.normal) > FACE_COSINE
            && sheet(a) == sheet(b)
    }
}
