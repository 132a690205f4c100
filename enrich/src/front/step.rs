//! What each sample of a blade does to its front.

use glam::DVec3;

use super::{Anchor, EdgePlace, Front, LARGEST_TURN, LOOK, NEAR, OVERSHOOT, SKIN, THROUGH};
use crate::cuts::Cuts;

/// Halvings with which a surface or a sheet is found along a line: a thousandth of the path.
const HALVINGS: usize = 10;
/// Positions along a path at which the inside is asked for before halving.
const LOOKS: u32 = 6;

/// What becomes of the front at one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Step {
    /// There is none.
    None,
    /// It stays.
    Stay,
    /// It moves on.
    Go(DVec3),
    /// It moves on to a position outside of the body, and ends.
    Leave(DVec3),
    /// A new one begins beyond the surface or beyond a sheet; an old one ends.
    Begin { from: DVec3, to: DVec3 },
}

impl Step {
    /// Where the strip begins and ends at this sample.
    pub(super) fn ends(self, anchor: Option<&Anchor>) -> Option<[DVec3; 2]> {
        match self {
            Self::None => None,
            Self::Stay => anchor.map(|anchor| [anchor.at; 2]),
            Self::Go(to) | Self::Leave(to) => anchor.map(|anchor| [anchor.at, to]),
            Self::Begin { from, to } => Some([from, to]),
        }
    }

    /// Whether the front of before continues.
    pub(super) fn goes_on(self) -> bool {
        matches!(self, Self::Stay | Self::Go(_) | Self::Leave(_))
    }
}

/// What a front may run into.
pub(super) struct Surroundings<'a> {
    pub(super) cuts: &'a Cuts,
    pub(super) inside: &'a dyn Fn(DVec3) -> bool,
}

/// What a line meets first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Met {
    Surface,
    Sheet,
}

impl Surroundings<'_> {
    /// The first surface or sheet on the line from a point along a unit vector, and the position beyond
    /// it at which a strip ends.
    pub(super) fn beyond(
        &self,
        from: DVec3,
        way: DVec3,
        reach: f64,
        spacing: f64,
    ) -> Option<(Met, DVec3)> {
        if way == DVec3::ZERO {
            return None;
        }
        let inside = |r: f64| (self.inside)(from + way * r);
        let mut surface = None;
        let mut low = 0.0;
        for k in 0..=LOOKS {
            let r = reach * f64::from(k) / f64::from(LOOKS);
            if !inside(r) {
                surface = Some(last_true(low, r, inside));
                break;
            }
            low = r;
        }
        // The point itself is often a vertex of the sheet.
        let start = 0.02 * spacing;
        let clear = |r: f64| !self.cuts.crosses(from + way * start, from + way * r);
        let sheet = (reach > start && !clear(reach)).then(|| last_true(start, reach, clear));
        match (surface, sheet) {
            (Some(r), Some(s)) if r <= s => Some((Met::Surface, r + OVERSHOOT * spacing)),
            (_, Some(s)) => Some((Met::Sheet, s + THROUGH * spacing)),
            (Some(r), None) => Some((Met::Surface, r + OVERSHOOT * spacing)),
            (None, None) => None,
        }
        .map(|(met, r)| (met, from + way * r))
    }
}

impl Anchor {
    /// Its ends beyond the first and last sample of a run.
    fn ends(&self) -> impl Iterator<Item = DVec3> {
        [self.before, self.after].into_iter().flatten()
    }

    /// Where a front at `at`, by a face, ends beyond that face, if it is the one beside the front. Then tissue is nearer to the
    /// side of what lies `overshoot` (m) beyond it ahead, at `to`. A strip to there would end on the face and leave a slit.
    fn beside(
        &self,
        at: DVec3,
        to: DVec3,
        overshoot: f64,
        around: &Surroundings<'_>,
    ) -> Option<DVec3> {
        let mut outs = self.ends().map(|end| end - self.at);
        let beside = outs.find(|out| {
            let back = out.normalize_or_zero() * overshoot;
            (around.inside)(to - back) && !(around.inside)(at + *out)
        });
        beside.map(|out| at + out)
    }
}

/// The last argument at which a predicate that holds at `low` and not at `high` holds, about.
fn last_true(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

impl Front {
    /// What a sample's position asks for.
    pub(super) fn step(
        &self,
        k: usize,
        place: EdgePlace,
        around: &Surroundings<'_>,
        least: f64,
    ) -> Step {
        let (sample, h) = (&self.samples[k], self.spacing);
        let Some(anchor) = &sample.anchor else {
            return match place {
                EdgePlace::Inside { at, came } => self.begin(k, at, came, around),
                _ => Step::None,
            };
        };
        match place {
            EdgePlace::Inside { at, came } => {
                self.step_inside(k, anchor, [at, came], around, least)
            }
            EdgePlace::Outside { at } => self.step_outside(k, anchor, at, around),
            EdgePlace::Gap | EdgePlace::Air => {
                let Some(EdgePlace::Inside { .. }) = sample.last else {
                    return Step::Stay;
                };
                // Through another sheet the front continues, or a slit would stay between its neighbours.
                match around.beyond(anchor.at, anchor.ahead, LOOK * h, h) {
                    Some((Met::Sheet, to)) if place == EdgePlace::Gap => Step::Go(to),
                    Some((Met::Surface, to)) if place == EdgePlace::Air => Step::Leave(to),
                    _ => Step::Stay,
                }
            }
        }
    }

    /// What a sample outside asks for, whose front is at `anchor`.
    fn step_outside(
        &self,
        k: usize,
        anchor: &Anchor,
        at: DVec3,
        around: &Surroundings<'_>,
    ) -> Step {
        let h = self.spacing;
        let way = at - anchor.at;
        let across = self.across(k, way);
        if across != DVec3::ZERO && anchor.is_ahead(across) {
            let inside = |share: f64| (around.inside)(anchor.at + way * share);
            let surface = anchor.at + way * last_true(0.0, 1.0, inside);
            let to = surface + way.normalize() * (OVERSHOOT * h);
            let beside = anchor.beside(surface, to, OVERSHOOT * h, around);
            return Step::Leave(beside.unwrap_or(to));
        }
        if way.dot(anchor.ahead) < 0.0 && way.length() <= 2.0 * h {
            // It went back the way it came.
            return Step::Stay;
        }
        // It slid out along the front, or past the last of the tissue ahead.
        let near = if way.length() <= h { NEAR * h } else { 0.0 };
        match around.beyond(anchor.at, anchor.ahead, near, h) {
            Some((Met::Surface, to)) => Step::Leave(to),
            _ => {
                let passed =
                    |end: &DVec3| !(around.inside)(*end) && way.dot(*end - anchor.at) > 0.0;
                Step::Leave(anchor.ends().find(passed).unwrap_or(anchor.at))
            }
        }
    }

    /// What a sample in tissue asks for, whose front is at `anchor`.
    fn step_inside(
        &self,
        k: usize,
        anchor: &Anchor,
        [at, came]: [DVec3; 2],
        around: &Surroundings<'_>,
        least: f64,
    ) -> Step {
        let (sample, h) = (&self.samples[k], self.spacing);
        let way = at - anchor.at;
        let across = self.across(k, way);
        let length = across.length();
        // What is welded to the front's own vertex is no step.
        if length <= least * h {
            return Step::Stay;
        }
        // The tissue may have moved against the blade: two spacings more than the blade. One that was
        // outside may have come in elsewhere.
        let led = match sample.last {
            _ if sample.torn => 0.0,
            Some(EdgePlace::Outside { .. } | EdgePlace::Air) => 0.0,
            _ => sample.way,
        };
        let believed = way.length() <= 2.0 * (h + led);
        if anchor.is_ahead(across) && believed {
            // Where it was put in beside a sheet, only now it is known which way it leaves that.
            let out = across / length;
            let back = || around.beyond(anchor.at + out * (SKIN * h), -out, 2.0 * SKIN * h, h);
            if anchor.ahead == DVec3::ZERO
                && let Some((Met::Sheet, from)) = back()
            {
                return Step::Begin { from, to: at };
            }
            return match around.beyond(at, across / length, SKIN * h, h) {
                Some((Met::Surface, to)) => match anchor.beside(at, to, OVERSHOOT * h, around) {
                    Some(_) => Step::Go(at),
                    None => Step::Leave(to),
                },
                Some((Met::Sheet, to)) => Step::Go(to),
                None => Step::Go(at),
            };
        }
        if around.cuts.nearest(at, NEAR * h).is_some() {
            return Step::Stay;
        }
        match self.begin(k, at, came, around) {
            Step::None => Step::Stay,
            step => step,
        }
    }

    /// A new front for a sample that is in tissue: from beyond the surface or sheet through which it
    /// came, or where it is.
    fn begin(&self, k: usize, at: DVec3, came: DVec3, around: &Surroundings<'_>) -> Step {
        let h = self.spacing;
        // Put in here: there is no way through a surface or gap that it could have come.
        if self.samples[k].last.is_none() {
            return Step::Begin { from: at, to: at };
        }
        if around.cuts.nearest(at, SKIN * h).is_some() {
            return Step::None;
        }
        let (way, reach) = match self.samples[k].last {
            Some(EdgePlace::Outside { at: from }) => (from - at, from.distance(at)),
            _ => (-came, 2.0 * came.length() + LOOK * h),
        };
        if let Some((_, from)) = around.beyond(at, way.normalize_or_zero(), reach, h) {
            return Step::Begin { from, to: at };
        }
        let is_inner = |point| around.cuts.edges.nearest_free(point, 1e-6 * h).is_none();
        match around.cuts.nearest(at, 1.5 * h) {
            // Beside the sheet it is in the gap; beyond the sheet's edge it is not.
            Some((sheet, distance)) if distance <= NEAR * h && is_inner(sheet) => Step::None,
            Some((sheet, _)) => {
                let back = (sheet - at).normalize_or_zero();
                let from = sheet + back * (THROUGH * h);
                Step::Begin { from, to: at }
            }
            None => Step::Begin { from: at, to: at },
        }
    }

    /// Takes back steps between which the sheet would fold: the normal of the new quad turns by more
    /// than 60 degrees against the front's.
    pub(super) fn refuse_turns(&self, steps: &mut [Step]) {
        let negligible = (SKIN * self.spacing).powi(2);
        for k in 0..steps.len().saturating_sub(1) {
            if !self.samples[k].joined {
                continue;
            }
            let pair = [&self.samples[k].anchor, &self.samples[k + 1].anchor];
            let [Some(a), Some(b)] = pair else { continue };
            let ends = [steps[k].ends(Some(a)), steps[k + 1].ends(Some(b))];
            let (true, true) = (steps[k].goes_on(), steps[k + 1].goes_on()) else {
                continue;
            };
            let [Some([_, to_a]), Some([_, to_b])] = ends else {
                continue;
            };
            let area = 0.5 * (to_b - a.at).cross(to_a - b.at);
            let before = (b.at - a.at).cross(a.ahead + b.ahead);
            let (new, old) = (area.length(), before.length());
            if new <= negligible || area.dot(before) >= LARGEST_TURN * new * old {
                continue;
            }
            let straight = |anchor: &Anchor, to: DVec3| {
                let way = (to - anchor.at).normalize_or(anchor.ahead);
                way.dot(anchor.ahead)
            };
            let first = straight(a, to_a) < straight(b, to_b);
            steps[if first { k } else { k + 1 }] = Step::Stay;
        }
    }
}
