//! New skin on a cut: where it lies, how large its disks are, where it ends.

use super::{CutChange, InsideTest, Tissue};
use crate::cast::{count, index};
use crate::render::{Clip, Surfel};
use crate::tissue::rim;
use crate::tissue::{PARENCHYMA, SkinSample, sheet_radius};
use glam::DVec3;
use rayon::prelude::*;
use rstar::primitives::GeomWithData;
use std::sync::Arc;

/// Largest radius of new skin in units of its spacing; the sampler's holes stay below that.
const SKIN_RADIUS: f64 = 1.3;
/// Distance (spacings) within which samples bound each other's disks: 28 of one sheet on average,
/// of which the cell looks at 16.
const NEIGHBORHOOD: f64 = 3.0;

impl Tissue {
    /// The largest radius of new skin (m); its clips are made for that.
    pub(super) fn skin_radius(&self) -> f64 {
        let spread = SKIN_RADIUS * self.sampler.spacing();
        self.renewal.map_or(spread, |renewal| renewal.map.radii[1])
    }

    /// New skin on triangles, numbered from `first_triangle`: two surfels per sample inside the body,
    /// and beside its rim. Counts it, and gives the surfels whose radius was computed.
    pub(super) fn grow_skin(
        &mut self,
        triangles: &[[DVec3; 3]],
        first_triangle: u32,
        inside: &(dyn Fn(DVec3) -> bool + Sync),
        change: &mut CutChange,
    ) -> Vec<u32> {
        let first = count(self.surfels.len());
        let samples = self.sampler.sample(triangles, first_triangle);
        for (mut surfel, clip, triangle) in self.skin_on(&samples, inside) {
            surfel.position -= surfel.normal * (0.5 * self.settings.opening);
            let entry = GeomWithData::new(surfel.position.to_array(), count(self.surfels.len()));
            self.skin_tree.insert(entry);
            self.surfels.push(surfel);
            self.triangles.push(triangle);
            let bounded = !clip.edges.is_empty();
            self.clips.push(bounded.then(|| Arc::new(clip)));
        }
        let fresh: Vec<u32> = (first..count(self.surfels.len())).collect();
        if self.settings.clip {
            for &s in &fresh {
                let at = self.surfels[index(s)].position;
                let hits = self.borders.triangles_near(at, self.skin_radius());
                self.split(s, &hits);
            }
        }
        let mut resized = Vec::new();
        if self.renewal.is_none() {
            resized = self.skin_beside(&fresh);
            self.resize(&resized);
        }
        change.skin = fresh.len();
        change.resized = resized.len();
        resized
    }

    /// Disks on both sides of samples of a cut, as far as they show, with their clips and triangles.
    fn skin_on(
        &self,
        samples: &[SkinSample],
        inside: &(dyn Fn(DVec3) -> bool + Sync),
    ) -> Vec<(Surfel, Clip, u32)> {
        let inside = |x: DVec3| match self.settings.inside {
            InsideTest::Shape => inside(x),
            InsideTest::TwoNearest => self.is_behind_surfels(x),
        };
        let side = |sample: &SkinSample, side: f64| {
            let surfel = Surfel {
                position: sample.point,
                normal: sample.normal * side,
                area: self.sampler.spacing() * self.sampler.spacing(),
                radius: self.skin_radius(),
                shape: DVec3::ZERO,
                material: PARENCHYMA,
                place: None,
            };
            let clip = if self.settings.clip {
                rim::at_surface(&surfel, &self.surfels, &self.outer_tree, &inside)
            } else {
                inside(surfel.position).then(Clip::default)
            };
            Some((surfel, clip?, sample.triangle))
        };
        let both = |sample| [1.0, -1.0].into_iter().filter_map(move |k| side(sample, k));
        samples.par_iter().flat_map_iter(both).collect()
    }

    /// Originals of skin in whose neighbourhood one of `fresh` lies, in order.
    fn skin_beside(&self, fresh: &[u32]) -> Vec<u32> {
        let reach = NEIGHBORHOOD * self.sampler.spacing();
        let beside = |&s: &u32| {
            let at = self.surfels[index(s)].position.to_array();
            self.skin_tree.locate_within_distance(at, reach * reach)
        };
        let mut found: Vec<u32> = fresh.iter().flat_map(beside).map(|p| p.data).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Radii (m) of originals of skin among their sheet's samples.
    pub(super) fn skin_radii(&self, of: &[u32]) -> Vec<f64> {
        let (most, reach) = (self.skin_radius(), NEIGHBORHOOD * self.sampler.spacing());
        let sheet = |s: u32| self.borders.sheet(self.triangles[index(s)]);
        let radius = |&s: &u32| {
            let own = &self.surfels[index(s)];
            let near = rim::within(&self.skin_tree, &self.surfels, own.position, reach);
            let beside = (near.iter()).filter(|&&other| other != s && sheet(other) == sheet(s));
            sheet_radius(own, beside.map(|&other| &self.surfels[index(other)]), most)
        };
        of.par_iter().map(radius).collect()
    }

    fn resize(&mut self, of: &[u32]) {
        for (&s, radius) in of.iter().zip(self.skin_radii(of)) {
            self.surfels[index(s)].radius = radius;
            for &double in self.doubles.get(&s).into_iter().flatten() {
                self.surfels[index(double)].radius = radius;
            }
        }
    }
}
