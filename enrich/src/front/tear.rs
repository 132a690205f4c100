//! Fronts that run ahead of their blade, where tissue tears.

use glam::DVec3;

use super::step::{Met, Step, Surroundings};
use super::{EdgePlace, Front, Patch, SKIN, close_edge};
use crate::cuts::Cuts;
use crate::error::CutError;

/// How far at the side of a front, in spacings, the surface is that it ends at. Samples of the edge lie a spacing apart on the
/// blade, more in stretched tissue. With 1.5 and 2.5 blocks of 2 kPa (LOG, *Tearing*) tear alike.
const BESIDE: f64 = 2.5;

impl Front {
    /// Takes back what a blade begins on the flanks of a tear, in whose gap it hangs. What has torn it moves as it passes alone.
    pub(super) fn hold_torn(&self, steps: &mut [Step], places: &[EdgePlace], cuts: &Cuts) {
        if !self.samples.iter().any(|sample| sample.torn) {
            return;
        }
        let beside = |place: &EdgePlace| match place {
            EdgePlace::Inside { at, .. } => cuts.nearest(*at, BESIDE * self.spacing).is_some(),
            _ => false,
        };
        for ((step, place), sample) in steps.iter_mut().zip(places).zip(&self.samples) {
            let passes = |to: DVec3, anchor: &super::Anchor| {
                let way = to - anchor.at;
                way.dot(anchor.ahead) > 0.0 && way.length() <= BESIDE * self.spacing
            };
            *step = match (*step, &sample.anchor) {
                (Step::Begin { .. }, None) if beside(place) => Step::None,
                (Step::Begin { .. }, Some(_)) if beside(place) => Step::Stay,
                (Step::Go(to) | Step::Leave(to), Some(anchor))
                    if sample.torn && !passes(to, anchor) =>
                {
                    Step::Stay
                }
                (step, _) => step,
            };
        }
    }

    /// Unit vector in which all of the front tears: the mean of where its samples look, of those that have torn if there are any;
    /// zero while unknown.
    fn heading(&self) -> DVec3 {
        let is_torn = self.samples.iter().any(|sample| sample.torn);
        let samples = self.samples.iter().filter(|sample| sample.torn == is_torn);
        let anchors = samples.filter_map(|sample| sample.anchor.as_ref());
        let sum: DVec3 = anchors.map(|anchor| anchor.ahead).sum();
        sum.normalize_or_zero()
    }

    /// Whether each sample's front tears, as `tears` says of its place (m) and the unit vectors ahead and along.
    pub(crate) fn tearing(&self, tears: &dyn Fn([DVec3; 3]) -> bool) -> impl Iterator<Item = bool> {
        let ahead = self.heading();
        let samples = self.samples.iter().enumerate();
        samples.map(move |(k, sample)| {
            let at = sample.anchor.as_ref().map(|anchor| anchor.at);
            at.is_some_and(|at| ahead != DVec3::ZERO && tears([at, ahead, self.along(k)]))
        })
    }

    /// Moves the front ahead by `by` spacings where it tears, or through a surface or sheet that it meets on the way. All of it moves in
    /// one direction: fronts that fan out would leave the corners of the body.
    ///
    /// # Errors
    /// [`CutError::NotFinite`].
    pub(crate) fn tear(
        &mut self,
        cuts: &mut Cuts,
        tearing: &[bool],
        by: f64,
        inside: &dyn Fn(DVec3) -> bool,
    ) -> Result<Vec<Patch>, CutError> {
        let mut patches = self.reach_surface(cuts, tearing, inside)?;
        let (ahead, h) = (self.heading(), self.spacing);
        let around = Surroundings { cuts, inside };
        let step = |(sample, tears): (&super::EdgeSample, &bool)| {
            let Some(at) = sample.anchor.as_ref().map(|anchor| anchor.at) else {
                return Step::None;
            };
            if !tears {
                return Step::Stay;
            }
            match around.beyond(at, ahead, (by + SKIN) * h, h) {
                Some((Met::Surface, to)) => Step::Leave(to),
                Some((Met::Sheet, to)) => Step::Go(to),
                None => Step::Go(at + ahead * (by * h)),
            }
        };
        let mut steps: Vec<Step> = self.samples.iter().zip(tearing).map(step).collect();
        self.refuse_turns(&mut steps);
        for (step, sample) in steps.iter().zip(&mut self.samples) {
            sample.torn |= matches!(step, Step::Go(_));
        }
        // Ends are carried along: where the blade is says nothing of them.
        let places = vec![EdgePlace::Gap; steps.len()];
        patches.push(self.take(cuts, &steps, &places, inside, SKIN)?);
        Ok(patches)
    }

    /// Carries ends of a front that a blade left inside of the body, where its edge goes on, to the surface beside.
    fn reach_surface(
        &mut self,
        cuts: &mut Cuts,
        tearing: &[bool],
        inside: &dyn Fn(DVec3) -> bool,
    ) -> Result<Vec<Patch>, CutError> {
        let h = self.spacing;
        let is_free = |k: Option<usize>| {
            let next = k.and_then(|k| self.samples.get(k));
            next.is_some_and(|next| next.anchor.is_none())
        };
        let mut ends = Vec::new();
        let samples = self.samples.iter().enumerate();
        for (k, sample) in samples.filter(|(k, _)| tearing[*k]) {
            let Some(anchor) = &sample.anchor else {
                continue;
            };
            let sides = [
                (anchor.before, k.checked_sub(1)),
                (anchor.after, Some(k + 1)),
            ];
            for (after, (end, next)) in sides.into_iter().enumerate() {
                if end.map_or(is_free(next), inside) {
                    let way = self.aside(k) * (2.0 * after as f64 - 1.0);
                    let around = Surroundings { cuts, inside };
                    let met = around.beyond(anchor.at, way, BESIDE * h, h);
                    if let Some((Met::Surface, to)) = met {
                        ends.push((k, after, to));
                    }
                }
            }
        }
        let mut patches = Vec::new();
        for (k, after, to) in ends {
            let patch = close_edge(cuts, to, h, inside)?;
            let anchor = self.samples[k].anchor.as_mut();
            if let Some(anchor) = anchor.filter(|_| !patch.triangles.is_empty()) {
                *[&mut anchor.before, &mut anchor.after][after] = Some(to);
                patches.push(patch);
            }
        }
        Ok(patches)
    }

    /// Unit vector along the front at a sample, square to where the front moves; zero if it has none.
    fn aside(&self, k: usize) -> DVec3 {
        let (along, ahead) = (self.along(k), self.heading());
        (along - ahead * along.dot(ahead)).normalize_or_zero()
    }
}
