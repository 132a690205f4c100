//! Fronts that run ahead of their blade, where tissue tears.

use glam::DVec3;

use super::step::{Met, Step, Surroundings};
use super::{EdgePlace, Front, OVERSHOOT, Patch, SKIN, close_edge};
use crate::cuts::Cuts;
use crate::error::CutError;

/// How far at the side of a front, in spacings, the surface is that it ends at: samples of the edge lie a spacing apart on the
/// blade, more in tissue that is stretched.
const BESIDE: f64 = 2.5;

impl Front {
    /// Follows where the blade drives the front, by a short way less than by a long one, but for one that has torn away from it.
    pub(super) fn turn(&mut self, places: &[EdgePlace]) {
        if self.samples.iter().any(|sample| sample.torn) {
            return;
        }
        let came = places.iter().filter_map(|place| match place {
            EdgePlace::Inside { came, .. } => Some(*came),
            _ => None,
        });
        let (count, way) = came.fold((0.0, DVec3::ZERO), |(n, sum), way| (n + 1.0, sum + way));
        let heading = self.heading * (OVERSHOOT * self.spacing) + way / f64::max(count, 1.0);
        self.heading = heading.normalize_or(self.heading);
    }

    /// Takes back what a blade does that hangs in the gap of a tear: it begins nothing on its flanks, and moves no front that it
    /// is behind.
    pub(super) fn hold_torn(&self, steps: &mut [Step]) {
        if !self.samples.iter().any(|sample| sample.torn) {
            return;
        }
        for (step, sample) in steps.iter_mut().zip(&self.samples) {
            *step = match (*step, &sample.anchor) {
                (Step::Begin { .. }, None) => Step::None,
                (Step::Begin { .. }, Some(_)) => Step::Stay,
                (Step::Go(to) | Step::Leave(to), Some(anchor))
                    if sample.torn && (to - anchor.at).dot(self.heading) <= 0.0 =>
                {
                    Step::Stay
                }
                (step, _) => step,
            };
        }
    }

    /// Whether each sample's front tears, as `tears` says of its place (m) and the unit vectors ahead and along.
    pub(crate) fn tearing(&self, tears: &dyn Fn([DVec3; 3]) -> bool) -> impl Iterator<Item = bool> {
        let ahead = self.heading;
        let samples = self.samples.iter().enumerate();
        samples.map(move |(k, sample)| {
            let at = sample.anchor.as_ref().map(|anchor| anchor.at);
            at.is_some_and(|at| ahead != DVec3::ZERO && tears([at, ahead, self.along(k)]))
        })
    }

    /// Moves the front ahead by `by` spacings, or through a surface or sheet that is met on the way, where it tears; all in
    /// one direction, as fronts that fan out would leave the corners of the body.
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
        let (ahead, h) = (self.heading, self.spacing);
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
        patches.push(self.take(cuts, &steps, &places, inside)?);
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
            patches.push(close_edge(cuts, to, h, inside)?);
            if let Some(anchor) = &mut self.samples[k].anchor {
                *[&mut anchor.before, &mut anchor.after][after] = Some(to);
            }
        }
        Ok(patches)
    }

    /// Unit vector along the front at a sample, square to where the front moves; zero if it has none.
    fn aside(&self, k: usize) -> DVec3 {
        let along = self.along(k);
        (along - self.heading * along.dot(self.heading)).normalize_or_zero()
    }
}
