//! The strip between a front and the next.

use glam::DVec3;

use super::step::{Met, Step, Surroundings};
use super::{Anchor, EdgePlace, EdgeSample, Front, LOOK, OVERSHOOT, Patch, SKIN};
use crate::cuts::Cuts;
use crate::error::CutError;
use crate::index32;
use crate::polyline::span;

/// Samples of one run that begin or join it may be this far apart (in spacings): they lie a spacing
/// apart on the blade, and tissue is rarely pressed to less than half.
const WIDEST: f64 = 2.5;

/// A vertex of a front: position along the blade in samples, position (m), sample if it is one.
#[derive(Debug, Clone, Copy)]
struct Vertex {
    place: f64,
    at: DVec3,
    sample: Option<usize>,
}

impl Vertex {
    fn new(place: f64, at: DVec3, sample: Option<usize>) -> Self {
        Self { place, at, sample }
    }
}

impl Front {
    /// Does what the steps say: adds the strips to the cut and takes the new front.
    pub(super) fn take(
        &mut self,
        cuts: &mut Cuts,
        steps: &[Step],
        places: &[EdgePlace],
        inside: &dyn Fn(DVec3) -> bool,
        least: f64,
    ) -> Result<Patch, CutError> {
        let mut corners: Vec<[DVec3; 3]> = Vec::new();
        let mut fronts: Vec<Vec<Vertex>> = Vec::new();
        let mut before: Vec<DVec3> = Vec::new();
        let around = Surroundings { cuts, inside };
        for run in self.runs(steps) {
            let mut old = self.old_front(&run, steps);
            let new = self.new_front(&run, steps, places, &around);
            carry_back_ends(&mut old, &new, steps);
            strip(&old, &new, &mut corners);
            before.extend(old.iter().map(|vertex| vertex.at));
            fronts.push(new);
        }
        let mut patch = patch_of(&corners);
        let asked = patch.vertices.clone();
        // The tolerance may be another than the default, but where a stroke ends the front must not stay.
        let own: (&[DVec3], f64) = if least < SKIN {
            (&before, least * self.spacing)
        } else {
            (&[], 0.0)
        };
        cuts.add_welded(&mut patch.vertices, &patch.triangles, own)?;
        let place_of = |at: DVec3| {
            let known = asked.iter().position(|&vertex| vertex == at);
            known.map_or(at, |vertex| patch.vertices[vertex])
        };
        for front in &mut fronts {
            for vertex in front {
                vertex.at = place_of(vertex.at);
            }
        }
        let after: Vec<DVec3> = fronts.iter().flatten().map(|vertex| vertex.at).collect();
        let ends = |line: &[DVec3]| Some([*line.first()?, *line.last()?]);
        if let (false, Some(old), Some(new)) =
            (patch.triangles.is_empty(), ends(&before), ends(&after))
        {
            self.line = Some([self.line.map_or(old, |[start, _]| start), new]);
        }
        self.settle(steps, &fronts);
        Ok(patch)
    }

    /// Runs of samples whose fronts hang together, as first and last sample.
    fn runs(&self, steps: &[Step]) -> Vec<[usize; 2]> {
        let mut runs: Vec<[usize; 2]> = Vec::new();
        for k in 0..steps.len() {
            if steps[k] == Step::None {
                continue;
            }
            match runs.last_mut() {
                Some([_, last]) if *last + 1 == k && self.linked(*last, steps) => *last = k,
                _ => runs.push([k; 2]),
            }
        }
        runs
    }

    /// Whether the strips at a sample and the next hang together.
    fn linked(&self, k: usize, steps: &[Step]) -> bool {
        let (here, next) = (steps[k], steps[k + 1]);
        if here.goes_on() && next.goes_on() && self.samples[k].joined {
            return true;
        }
        // Fronts that come to lie side by side are joined, or a slit would stay between their sheets.
        let moves = |step| step != Step::Stay;
        let ends = [k, k + 1].map(|k| steps[k].ends(self.samples[k].anchor.as_ref()));
        let [Some([from_a, to_a]), Some([from_b, to_b])] = ends else {
            return false;
        };
        let widest = WIDEST * self.spacing;
        let near = from_a.distance(from_b) <= widest && to_a.distance(to_b) <= widest;
        near && (moves(here) || moves(next))
    }

    fn old_front(&self, &[first, last]: &[usize; 2], steps: &[Step]) -> Vec<Vertex> {
        let mut front: Vec<Vertex> = Vec::new();
        for (k, step) in steps.iter().enumerate().take(last + 1).skip(first) {
            let anchor = self.samples[k].anchor.as_ref();
            let at = place_along(k);
            let start = step.ends(anchor).map(|[start, _]| start);
            let old = anchor.filter(|_| step.goes_on());
            let vertex =
                |place: f64, at: Option<DVec3>, sample| at.map(|at| Vertex { place, at, sample });
            let before = vertex(at - 0.5, old.and_then(|anchor| anchor.before), None);
            let after = vertex(at + 0.5, old.and_then(|anchor| anchor.after), None);
            front.extend(before);
            front.extend(vertex(at, start, Some(k)));
            front.extend(after);
        }
        // Where a run grows, its old end may reach beyond the beginning of the sample that joins it.
        let new = |vertex: &Vertex| vertex.sample.is_some_and(|k| !steps[k].goes_on());
        let mut n = 1;
        while n + 1 < front.len() {
            let [low, end, high] = [front[n - 1], front[n], front[n + 1]];
            let turns = |inner: Vertex, joining: Vertex| {
                (joining.at - end.at).dot(end.at - inner.at) <= 0.0
            };
            if end.sample.is_some() {
                n += 1;
            } else if new(&high) && turns(low, high) {
                front.remove(n + 1);
            } else if new(&low) && turns(high, low) {
                front.remove(n - 1);
            } else {
                n += 1;
            }
        }
        front
    }

    fn new_front(
        &self,
        &[first, last]: &[usize; 2],
        steps: &[Step],
        places: &[EdgePlace],
        around: &Surroundings<'_>,
    ) -> Vec<Vertex> {
        let vertex = |k: usize| {
            let [_, at] = steps[k].ends(self.samples[k].anchor.as_ref())?;
            Some(Vertex::new(place_along(k), at, Some(k)))
        };
        let mut front: Vec<Vertex> = (first..=last).filter_map(vertex).collect();
        let (Some(low), Some(high)) = (front.first(), front.last()) else {
            return front;
        };
        let other = |k: usize| front.get(k).map(|vertex| vertex.at);
        let beside = |k: Option<usize>| k.and_then(|k| places.get(k)).copied();
        let end = |k: usize, at, inner: Option<DVec3>, next, below| {
            let outward = inner.map(|inner| at - inner);
            self.end(k, at, steps[k], outward, beside(next), below, around)
        };
        let left = end(first, low.at, other(1), first.checked_sub(1), true);
        let inner = front.len().checked_sub(2).and_then(other);
        let right = end(last, high.at, inner, Some(last + 1), false);
        if let Some(at) = right {
            front.push(Vertex::new(place_along(last) + 0.5, at, None));
        }
        if let Some(at) = left {
            front.insert(0, Vertex::new(place_along(first) - 0.5, at, None));
        }
        front
    }

    /// The vertex beyond the last sample of a run: through the surface, or through a sheet, that the
    /// blade's edge passes between this sample and the next.
    fn end(
        &self,
        k: usize,
        at: DVec3,
        step: Step,
        outward: Option<DVec3>,
        beside: Option<EdgePlace>,
        below: bool,
        around: &Surroundings<'_>,
    ) -> Option<DVec3> {
        let h = self.spacing;
        let anchor = self.samples[k].anchor.as_ref();
        let old = anchor
            .filter(|_| step.goes_on())
            .and_then(|anchor| if below { anchor.before } else { anchor.after });
        match step {
            Step::None => return None,
            // The corner between the surfaces at the side and ahead.
            Step::Leave(_) => return anchor.and_then(|anchor| Some(at + (old? - anchor.at))),
            Step::Stay => return old,
            Step::Go(_) | Step::Begin { .. } => {}
        }
        let old_way = anchor.and_then(|anchor| old.map(|old| old - anchor.at));
        let straight = outward.or(old_way).unwrap_or(DVec3::ZERO);
        let way = straight.normalize_or_zero();
        let sheet = |met: Option<(Met, DVec3)>| met.filter(|(met, _)| *met == Met::Sheet);
        let met = match beside {
            Some(EdgePlace::Outside { at: next }) => {
                let reach = at.distance(next);
                around.beyond(at, (next - at).normalize_or_zero(), reach, h)
            }
            Some(EdgePlace::Air) => around.beyond(at, way, 1.5 * straight.length().max(h), h),
            Some(EdgePlace::Gap) => {
                sheet(around.beyond(at, way, straight.length().max(LOOK * h), h))
            }
            // The next sample may lie in an older sheet, where no front begins.
            Some(EdgePlace::Inside { at: next, .. }) => {
                around.beyond(at, way, SKIN * h, h).or_else(|| {
                    let way = (next - at).normalize_or_zero();
                    let reach = (at.distance(next) + 2.0 * SKIN * h).min(WIDEST * h);
                    sheet(around.beyond(at, way, reach, h))
                })
            }
            None => around.beyond(at, way, SKIN * h, h),
        };
        met.map(|(_, end)| end)
            .or_else(|| self.rim(k, at, old?, around))
    }

    /// Where the surface is that the front ended at, when the blade's edge does not say: the old end carried along,
    /// or what a spacing more of the same path meets. Without it a notch would stay between this end and the
    /// next.
    fn rim(&self, k: usize, at: DVec3, old: DVec3, around: &Surroundings<'_>) -> Option<DVec3> {
        let from = self.samples[k].anchor.as_ref()?.at;
        if (around.inside)(old) {
            return None;
        }
        let carried = at + (old - from);
        if !(around.inside)(carried) {
            return Some(carried);
        }
        let way = (old - from).normalize_or_zero();
        let met = around.beyond(carried, way, self.spacing, self.spacing);
        met.map(|(_, end)| end)
    }

    /// Takes new fronts over.
    fn settle(&mut self, steps: &[Step], fronts: &[Vec<Vertex>]) {
        let leave = |sample: &mut EdgeSample| {
            sample.joined = false;
            sample.anchor.take()
        };
        let before: Vec<Option<Anchor>> = self.samples.iter_mut().map(leave).collect();
        for front in fronts {
            for (n, vertex) in front.iter().enumerate() {
                let Some(k) = vertex.sample else { continue };
                let step = steps[k];
                if let Step::None | Step::Leave(_) = step {
                    continue;
                }
                let below = n.checked_sub(1).map(|n| front[n]);
                let above = front.get(n + 1).copied();
                let stays = |other: Option<Vertex>, k: usize| {
                    other.is_some_and(|other| {
                        other.sample == Some(k) && !matches!(steps[k], Step::Leave(_))
                    })
                };
                let joined_below = k > 0 && stays(below, k - 1);
                let joined_above = stays(above, k + 1);
                let along = above.unwrap_or(*vertex).at - below.unwrap_or(*vertex).at;
                let along = along.normalize_or_zero();
                let old = before[k].as_ref().filter(|_| step.goes_on());
                let ahead = match step.ends(before[k].as_ref()) {
                    Some([from, to]) if from != to => {
                        let way = to - from;
                        let across = way - way.dot(along) * along;
                        // A short step turns the direction less than a long one.
                        let last = old.map_or(DVec3::ZERO, |anchor| anchor.ahead);
                        (last * (OVERSHOOT * self.spacing) + across).normalize_or(last)
                    }
                    _ => old.map_or(DVec3::ZERO, |anchor| anchor.ahead),
                };
                let sample = &mut self.samples[k];
                sample.joined = joined_above;
                if step != Step::Stay {
                    sample.way = 0.0;
                }
                sample.anchor = Some(Anchor {
                    at: vertex.at,
                    ahead,
                    before: below.filter(|_| !joined_below).map(|end| end.at),
                    after: above.filter(|_| !joined_above).map(|end| end.at),
                });
            }
        }
    }
}

/// Gives the beginning of a new front the ends that the front has, in parallel: without them a notch would
/// stay between the surface at the side and the surface or sheet that it begins at.
fn carry_back_ends(old: &mut Vec<Vertex>, new: &[Vertex], steps: &[Step]) {
    let parallel = |end: &Vertex, inner: &Vertex| {
        let begins = inner.sample.map(|k| steps[k]);
        let (Some(Step::Begin { from, to }), None) = (begins, end.sample) else {
            return None;
        };
        let at = from + (end.at - to);
        (from != to).then_some(Vertex { at, ..*end })
    };
    let is =
        |inner: &Vertex, end: Option<&Vertex>| end.is_some_and(|end| end.sample == inner.sample);
    if let [end, inner, ..] = new
        && is(inner, old.first())
        && let Some(vertex) = parallel(end, inner)
    {
        old.insert(0, vertex);
    }
    if let [.., inner, end] = new
        && is(inner, old.last())
        && let Some(vertex) = parallel(end, inner)
    {
        old.push(vertex);
    }
}

/// A sample's position along the blade.
fn place_along(sample: usize) -> f64 {
    f64::from(index32(sample))
}

/// Spans the strip between two fronts by their positions along the blade.
fn strip(old: &[Vertex], new: &[Vertex], out: &mut Vec<[DVec3; 3]>) {
    if old.is_empty() || new.is_empty() {
        return;
    }
    let [old, new] = [old, new].map(|front| -> Vec<(f64, DVec3)> {
        front
            .iter()
            .map(|vertex| (vertex.place, vertex.at))
            .collect()
    });
    span(&old, &new, |[p, q, r]| {
        if p != q && q != r && r != p {
            out.push([p, q, r]);
        }
    });
}

/// Triangles with each vertex once.
fn patch_of(corners: &[[DVec3; 3]]) -> Patch {
    let mut patch = Patch::default();
    for triangle in corners {
        let triangle = triangle.map(|at| {
            let known = patch.vertices.iter().position(|&vertex| vertex == at);
            index32(known.unwrap_or_else(|| {
                patch.vertices.push(at);
                patch.vertices.len() - 1
            }))
        });
        patch.triangles.push(triangle);
    }
    patch
}
