//! The front of a cut that a blade makes: where the growing sheet ends in the tissue.
//!
//! A blade in soft tissue soon hangs in the gap that it has opened, and most of its edge has no place
//! in the material. So the sheet is not spanned between positions of the blade: its free edge is kept,
//! and moves on only where the blade is in tissue ahead of it (the state of what is cut follows the
//! tool, as in Bielser 2003, here without elements). Where the blade goes back, trembles in the
//! gap or is in the air, the front stays.

mod step;
mod strip;
mod swept;
mod tear;
#[cfg(test)]
mod tests;

use glam::DVec3;

use crate::cuts::Cuts;
use crate::error::CutError;
use step::{Step, Surroundings};
pub(crate) use swept::{SweptPair, close_edge, swept_pairs};

/// Below this fraction of the spacing ahead of a front there is no telling a surface or an older sheet
/// from the front: it is passed. It is the default weld tolerance.
pub(crate) const SKIN: f64 = 0.1;
/// What takes its place where a stroke ends: the front comes as near to the blade. With its front off by d, a cut of depth a has
/// released two to three times d/a more or less: 1 % where a is 3 spacings.
pub(crate) const LAST_SKIN: f64 = 0.01;
/// How far a front that leaves the body is carried on, in spacings: a sheet that ends on the surface
/// severs none of the pairs that lie in it.
pub(crate) const OVERSHOOT: f64 = 0.5;
/// How far a branch, and a front that meets an older sheet, reach through it, in spacings: more than
/// the offset of diffraction points, 0.05 of an influence radius of 2.
pub(crate) const THROUGH: f64 = 0.15;
/// A blade this near to its sheet (in spacings) without being ahead of the front is in its gap: the
/// map between two flanks is good to half a spacing.
const NEAR: f64 = 0.5;
/// How far a surface or sheet is looked for from a position beside it (in spacings): a sub-step and half.
const LOOK: f64 = 0.75;
/// Cosine of the largest turn of a front against its last direction.
const LARGEST_TURN: f64 = 0.5;

/// Where a point of a blade's edge is.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum EdgePlace {
    /// In tissue.
    Inside {
        /// Material position (m).
        at: DVec3,
        /// Path length (m) in the material since the last position, by the deformation here.
        came: DVec3,
    },
    /// Outside of the body, so near that it still has a material position (m).
    Outside {
        /// That position.
        at: DVec3,
    },
    /// Between the flanks of a cut.
    Gap,
    /// Far from tissue.
    Air,
}

/// Triangles that were added to a cut; adding them again ([`Cuts::add_surface`]) without a weld tolerance gives the same cut.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Patch {
    /// Vertices (m, material coordinates).
    pub vertices: Vec<DVec3>,
    /// Corners as numbers of vertices.
    pub triangles: Vec<[u32; 3]>,
}

/// The front of one stroke, point by point of the blade's edge.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Front {
    /// Distance of the nodes (m).
    spacing: f64,
    samples: Vec<EdgeSample>,
    /// First and last point (m) of the line at which the sheet began, and of the front when it moved last, also those
    /// beyond the surface; `None` if there is no sheet yet.
    pub(crate) line: Option<[[DVec3; 2]; 2]>,
}

#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct EdgeSample {
    anchor: Option<Anchor>,
    /// Whether the sheet's edge runs on to the next sample.
    joined: bool,
    last: Option<EdgePlace>,
    /// Path length (m) of the blade in the world since the anchor moved.
    way: f64,
    /// Whether the anchor has torn away from the blade.
    torn: bool,
}

/// Where the front is that belongs to a sample.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Anchor {
    /// Vertex of the cut (m).
    at: DVec3,
    /// Unit conormal: in the sheet, across the front, out of what is cut. Zero while unknown.
    ahead: DVec3,
    /// Vertices beyond the first and last sample of a run, outside of the body.
    before: Option<DVec3>,
    after: Option<DVec3>,
}

impl Front {
    /// A front of a blade that has not touched anything yet.
    ///
    /// # Arguments
    /// * `samples` -- number of points along the blade's edge.
    /// * `spacing` -- distance of the nodes (m).
    ///
    /// # Panics
    /// If the spacing is not positive.
    pub(crate) fn new(samples: usize, spacing: f64) -> Self {
        let is_positive = spacing > 0.0 && spacing.is_finite();
        assert!(is_positive, "spacing of {spacing} is not positive");
        let sample = EdgeSample {
            anchor: None,
            joined: false,
            last: None,
            way: 0.0,
            torn: false,
        };
        Self {
            spacing,
            samples: vec![sample; samples],
            line: None,
        }
    }

    /// Number of points along the blade's edge.
    pub(crate) fn sample_count(&self) -> usize {
        self.samples.len()
    }

    /// Whether all of it is finite and hangs together, as one that was read from a file may not.
    pub(crate) fn is_sound(&self) -> bool {
        let is_finite = |sample: &EdgeSample| {
            let Some(anchor) = &sample.anchor else {
                return !sample.joined;
            };
            let ends = [anchor.before, anchor.after];
            [anchor.at, anchor.ahead].iter().all(|x| x.is_finite())
                && ends.iter().flatten().all(|x| x.is_finite())
        };
        let next = |k: usize| self.samples.get(k + 1);
        let hangs = |(k, sample): (usize, &EdgeSample)| {
            !sample.joined || next(k).is_some_and(|next| next.anchor.is_some())
        };
        let mut line = self.line.iter().flatten().flatten();
        self.spacing > 0.0
            && self.spacing.is_finite()
            && line.all(|x| x.is_finite())
            && (self.samples.iter()).all(|s| s.way.is_finite() && is_finite(s))
            && self.samples.iter().enumerate().all(hangs)
    }

    /// Moves the front to where the blade is now, and adds the strip to the cut.
    ///
    /// A sample in tissue ahead of its front takes the front with it. One that leaves the body, or
    /// comes within a tenth of a spacing of its surface or of another sheet, takes it through. One
    /// that is beside its sheet, in a gap or in the air leaves the front where it is; one that comes
    /// out of the gap deep into a flank begins a branch that starts through the sheet.
    ///
    /// # Arguments
    /// * `cuts` -- takes the strip; its vertices are those of the front.
    /// * `places` -- where the samples are, one each; no more than half a spacing from the last.
    /// * `moved` -- largest path length (m) of a sample in the world since the last call.
    /// * `inside` -- whether a material point lies in the uncut body.
    /// * `least` -- smaller steps (in spacings) are none: [`SKIN`], or [`LAST_SKIN`] where the stroke ends.
    ///
    /// # Errors
    /// [`CutError::NotFinite`]; cut and front are then unchanged.
    ///
    /// # Panics
    /// If there is not one position per sample.
    pub(crate) fn advance(
        &mut self,
        cuts: &mut Cuts,
        places: &[EdgePlace],
        moved: f64,
        inside: &dyn Fn(DVec3) -> bool,
        least: f64,
    ) -> Result<Patch, CutError> {
        assert_eq!(places.len(), self.samples.len(), "one place per sample");
        for sample in &mut self.samples {
            sample.way += moved;
        }
        let mut steps: Vec<Step> = {
            let around = Surroundings { cuts, inside };
            (0..places.len())
                .map(|k| self.step(k, places[k], &around, least))
                .collect()
        };
        self.hold_torn(&mut steps, places, cuts);
        self.refuse_turns(&mut steps);
        for (step, sample) in steps.iter().zip(&mut self.samples) {
            sample.torn &= *step == Step::Stay;
        }
        let patch = self.take(cuts, &steps, places, inside, least)?;
        for (sample, place) in self.samples.iter_mut().zip(places) {
            sample.last = Some(*place);
        }
        Ok(patch)
    }

    /// Moves the front on to material points (m) that the blade has passed, as far as they lie ahead
    /// of it within two spacings, and adds the strip to the cut; `least` as of [`Front::advance`].
    ///
    /// # Errors
    /// [`CutError::NotFinite`]; cut and front are then unchanged.
    pub(crate) fn reach(
        &mut self,
        cuts: &mut Cuts,
        points: &[DVec3],
        inside: &dyn Fn(DVec3) -> bool,
        least: f64,
    ) -> Result<Patch, CutError> {
        let stays = |sample: &EdgeSample| match sample.anchor {
            Some(_) => Step::Stay,
            None => Step::None,
        };
        let mut steps: Vec<Step> = self.samples.iter().map(stays).collect();
        let mut farthest = vec![0.0; steps.len()];
        for &point in points {
            let Some((samples, way)) = self.nearest_ahead(point) else {
                continue;
            };
            let ahead = way.length();
            for k in samples {
                let Some(anchor) = &self.samples[k].anchor else {
                    continue;
                };
                if ahead > farthest[k] {
                    farthest[k] = ahead;
                    let beyond = THROUGH / SKIN * least * self.spacing;
                    let to = anchor.at + way * (1.0 + beyond / ahead);
                    let step = if inside(to) { Step::Go } else { Step::Leave };
                    steps[k] = step(to);
                }
            }
        }
        self.refuse_turns(&mut steps);
        let last = |sample: &EdgeSample| sample.last.unwrap_or(EdgePlace::Air);
        let places: Vec<EdgePlace> = self.samples.iter().map(last).collect();
        self.take(cuts, &steps, &places, inside, least)
    }

    /// The samples at both ends of the piece of the front that a point lies straight ahead of, and the
    /// path length (m) from there to the point.
    fn nearest_ahead(&self, point: DVec3) -> Option<([usize; 2], DVec3)> {
        let mut best: Option<([usize; 2], DVec3)> = None;
        for (samples, [from, to], ahead) in self.pieces() {
            let along = to - from;
            let share = (point - from).dot(along) / along.length_squared();
            let way = point - from.lerp(to, share);
            let (length, reach) = (way.length(), 2.0 * self.spacing);
            let straight = (0.0..=1.0).contains(&share) && length > 0.0 && length <= reach;
            if straight
                && way.dot(ahead) >= LARGEST_TURN * length * ahead.length()
                && best.is_none_or(|(_, found)| length < found.length())
            {
                best = Some((samples, way));
            }
        }
        best
    }

    /// Whether a material point (m) that the blade has passed lies less than a tenth of a spacing ahead of where both front and
    /// blade are: by so much the map of the blade and the straight line of a pair differ.
    pub(crate) fn is_at_blade(&self, point: DVec3) -> bool {
        let near = SKIN * self.spacing;
        let holds = |k: &usize| match (self.samples[*k].last, &self.samples[*k].anchor) {
            (Some(EdgePlace::Inside { at, .. }), Some(anchor)) => at.distance(anchor.at) <= near,
            _ => false,
        };
        self.nearest_ahead(point)
            .is_some_and(|(samples, way)| way.length() <= near && samples.iter().all(holds))
    }

    /// Pieces of the front: the samples at their ends, their ends (m) and where they look to.
    fn pieces(&self) -> Vec<([usize; 2], [DVec3; 2], DVec3)> {
        let mut pieces = Vec::new();
        for (k, sample) in self.samples.iter().enumerate() {
            let Some(anchor) = &sample.anchor else {
                continue;
            };
            for end in [anchor.before, anchor.after].into_iter().flatten() {
                pieces.push(([k; 2], [anchor.at, end], anchor.ahead));
            }
            let next = self.samples.get(k + 1);
            let next = next.and_then(|next| next.anchor.as_ref());
            if let (true, Some(next)) = (sample.joined, next) {
                let ahead = (anchor.ahead + next.ahead).normalize_or_zero();
                pieces.push(([k, k + 1], [anchor.at, next.at], ahead));
            }
        }
        pieces.retain(|(_, _, ahead)| *ahead != DVec3::ZERO);
        pieces
    }

    /// A path from a sample's front without what goes along the front.
    fn across(&self, k: usize, way: DVec3) -> DVec3 {
        let along = self.along(k);
        way - way.dot(along) * along
    }

    /// Unit tangent of the front at a sample, from lower to higher samples; zero if it has none.
    fn along(&self, k: usize) -> DVec3 {
        let Some(anchor) = &self.samples[k].anchor else {
            return DVec3::ZERO;
        };
        let at = |k: usize| self.samples[k].anchor.as_ref().map(|anchor| anchor.at);
        let below = (k > 0 && self.samples[k - 1].joined).then(|| at(k - 1));
        let above = self.samples[k].joined.then(|| at(k + 1));
        let from = below.flatten().or(anchor.before).unwrap_or(anchor.at);
        let to = above.flatten().or(anchor.after).unwrap_or(anchor.at);
        (to - from).normalize_or_zero()
    }
}

impl Anchor {
    /// Whether a path across the front continues, without turning by more than 60 degrees.
    fn is_ahead(&self, across: DVec3) -> bool {
        self.ahead == DVec3::ZERO || across.dot(self.ahead) >= LARGEST_TURN * across.length()
    }
}
