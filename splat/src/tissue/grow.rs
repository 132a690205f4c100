//! New skin on a cut: where it lies, how large its disks are, where it ends.

use super::{CutChange, InsideTest, Tissue};
use crate::cast::{count, index};
use crate::render::clip::Clip;
use crate::tissue::radii::sheet_radius;
use crate::tissue::rim::{self, SkinDisk};
use crate::tissue::texture::PARENCHYMA;
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
        self.renewal.map_or(spread, |renewal| renewal.map.most())
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
        let (spacing, radius) = (self.sampler.spacing(), self.skin_radius());
        let first = count(self.surfels.len());
        let samples = self.sampler.sample(triangles, first_triangle);
        let inside = |x: DVec3| match self.settings.inside {
            InsideTest::Shape => inside(x),
            InsideTest::TwoNearest => self.is_behind_surfels(x),
        };
        let bounded = |disk: &SkinDisk| {
            if self.settings.clip {
                rim::at_surface(disk, &self.surfels, &self.outer_tree, &inside)
            } else {
                inside(disk.point).then(Clip::default)
            }
        };
        let disks: Vec<(SkinDisk, Clip, u32)> = samples
            .par_iter()
            .flat_map_iter(|sample| {
                [1.0, -1.0].into_iter().filter_map(|side| {
                    let disk = SkinDisk {
                        point: sample.point,
                        normal: sample.normal * side,
                        radius,
                    };
                    let clip = bounded(&disk)?;
                    Some((disk, clip, sample.triangle))
                })
            })
            .collect();
        for (disk, clip, triangle) in disks {
            let at = disk.point - disk.normal * (0.5 * self.settings.opening);
            let i = count(self.surfels.len());
            let area = spacing * spacing;
            self.surfels.push(at, disk.normal, area, radius, PARENCHYMA);
            self.triangles.push(triangle);
            let bounded = !clip.edges.is_empty();
            self.clips.push(bounded.then(|| Arc::new(clip)));
            self.skin_tree.insert(GeomWithData::new(at.to_array(), i));
        }
        let fresh: Vec<u32> = (first..count(self.surfels.len())).collect();
        if self.settings.clip {
            for &s in &fresh {
                let at = self.surfels.positions[index(s)];
                let hits = self.borders.triangles_near(at, radius);
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

    /// Originals of skin in whose neighbourhood one of `fresh` lies, in order.
    fn skin_beside(&self, fresh: &[u32]) -> Vec<u32> {
        let reach = NEIGHBORHOOD * self.sampler.spacing();
        let beside = |&s: &u32| {
            let at = self.surfels.positions[index(s)].to_array();
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
            let x = self.surfels.positions[index(s)];
            let near = rim::within(&self.skin_tree, &self.surfels, x, reach).into_iter();
            let beside = near.filter(|&other| other != s && sheet(other) == sheet(s));
            sheet_radius(&self.surfels, index(s), beside.map(index), most)
        };
        of.par_iter().map(radius).collect()
    }

    fn resize(&mut self, of: &[u32]) {
        for (&s, radius) in of.iter().zip(self.skin_radii(of)) {
            self.surfels.radii[index(s)] = radius;
            for &double in self.doubles.get(&s).into_iter().flatten() {
                self.surfels.radii[index(double)] = radius;
            }
        }
    }
}
