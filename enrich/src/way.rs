//! The shortest free way round a cut.

use glam::DVec3;

use crate::index::Bounds;
use crate::obstacle::{Bend, Obstacle};

/// Work space of a search; contents do not matter.
#[derive(Debug, Clone, Default)]
pub(crate) struct WayScratch {
    near: Vec<u32>,
    stops: Vec<Stop>,
    path: Vec<(u32, Bend)>,
}

/// An edge that a way may bend round.
#[derive(Debug, Clone, Copy)]
struct Stop {
    id: u32,
    /// Length of the way with this bend alone: no way over the edge is shorter.
    least: f64,
    /// Where the shortest way found so far passes it.
    bend: Bend,
    /// Length of that way from its start; infinite while none is known.
    reached: f64,
    /// The stop before this one on it.
    from: Option<usize>,
    done: bool,
}

/// A bend must be free this far outside of its edge, relative to the coupling distance. It is what
/// severs pairs at a joint that is not quite closed, and along a cut that overshoots the body by a little.
pub(crate) const OFFSET: f64 = 0.05;

/// Shares of the offset at which a way that is free at the whole offset is tried again, so that its
/// length is that of a way that is there: over the edge itself but for round-off, or farther outside.
const TIGHTER: [f64; 2] = [1e-4, 0.125];

/// Sweeps over the bends of a way, each moved to its best place between its neighbours: at most so many,
/// and no more once a sweep gains less than `GAIN` of the length.
const SWEEPS: usize = 60;
const GAIN: f64 = 1e-6;
/// Sweeps over the whole, each after bends were moved to other edges. One is the rule.
const EXCHANGES: usize = 10;

/// What a search asks again and again.
struct Ways<'a, C> {
    cut: &'a C,
    inside: &'a (dyn Fn(DVec3) -> bool + Sync),
    /// Distance (m) from an edge at which a bend must be free.
    offset: f64,
    a: DVec3,
    b: DVec3,
}

/// Length of a way (m), and the mean direction of its bends out of the cut: of unit length, or zero where they
/// cancel.
pub(crate) type Way = (f64, DVec3);

/// The shortest free way from `a` to `b`, if its length is below `reach` (m).
///
/// A way is free if, moved outward by the offset at each of its bends, it crosses nothing and each bend
/// lies in the body. Its length is that over the edges themselves where such a way is free as well, and
/// that of a way a little outside of them where it is not.
///
/// A way over an edge is never shorter than the one that bends there alone. The first free one of
/// these in order of length is therefore the shortest of all but for ways over those before it, and
/// only if there are such is there anything to search.
pub(crate) fn detour<C: Obstacle>(
    cut: &C,
    a: DVec3,
    b: DVec3,
    reach: f64,
    inside: &(dyn Fn(DVec3) -> bool + Sync),
    scratch: &mut WayScratch,
) -> Option<Way> {
    let WayScratch { near, stops, path } = scratch;
    let around = Bounds::of(&[a.midpoint(b)]).grown(0.5 * reach);
    let ends = cut.bends_into(&around, near);
    // Sheets that go on all round part the neighbourhood: an odd number of them is between a and b.
    if !ends && cut.crossings(a, b) % 2 == 1 {
        return None;
    }
    stops.clear();
    for &id in &*near {
        let bend = cut.bend(id, a, b);
        let least = a.distance(bend.point) + bend.point.distance(b);
        if least < reach {
            stops.push(Stop {
                id,
                least,
                bend,
                reached: f64::INFINITY,
                from: None,
                done: false,
            });
        }
    }
    stops.sort_unstable_by(|x, y| x.least.total_cmp(&y.least).then(x.id.cmp(&y.id)));
    let ways = Ways {
        cut,
        inside,
        offset: OFFSET * reach,
        a,
        b,
    };
    let mut best = (reach, DVec3::ZERO);
    let mut shorter = 0;
    while shorter < stops.len() && stops[shorter].least < best.0 {
        let Stop { id, bend, .. } = stops[shorter];
        if let Some(length) = ways.length(&[(id, bend)])
            && length < best.0
        {
            best = (length, bend.outward);
        }
        shorter += 1;
    }
    stops.retain(|stop| stop.least < best.0 && inside(bend_point(&stop.bend, ways.offset)));
    if stops.len() > 1 && ways.some_seen_from(a, stops) && ways.some_seen_from(b, stops) {
        best = ways.search(best, stops, path, true);
        best = ways.search(best, stops, path, false);
    }
    (best.0 < reach).then_some(best)
}

/// The point so far outside of a bend.
fn bend_point(bend: &Bend, offset: f64) -> DVec3 {
    bend.point + offset * bend.outward
}

impl<C: Obstacle> Ways<'_, C> {
    fn some_seen_from(&self, end: DVec3, stops: &[Stop]) -> bool {
        stops
            .iter()
            .any(|stop| !self.cut.crosses(end, bend_point(&stop.bend, self.offset)))
    }

    /// Whether a way crosses nothing if its bends are moved outward by `offset`.
    fn is_free(&self, path: &[(u32, Bend)], offset: f64) -> bool {
        let mut last = self.a;
        for (_, bend) in path {
            let next = bend_point(bend, offset);
            if self.cut.crosses(last, next) {
                return false;
            }
            last = next;
        }
        !self.cut.crosses(last, self.b)
    }

    /// Length of a way whose bends are moved outward by `offset`.
    fn length_at(&self, path: &[(u32, Bend)], offset: f64) -> f64 {
        let mut last = self.a;
        let mut length = 0.0;
        for (_, bend) in path {
            let next = bend_point(bend, offset);
            length += last.distance(next);
            last = next;
        }
        length + last.distance(self.b)
    }

    /// Length of a way, if it is free.
    fn length(&self, path: &[(u32, Bend)]) -> Option<f64> {
        let in_body = |(_, bend): &(u32, Bend)| (self.inside)(bend_point(bend, self.offset));
        if !path.iter().all(in_body) || !self.is_free(path, self.offset) {
            return None;
        }
        let [edge, near] = TIGHTER;
        Some(if self.is_free(path, edge * self.offset) {
            self.length_at(path, 0.0)
        } else if self.is_free(path, near * self.offset) {
            self.length_at(path, near * self.offset)
        } else {
            self.length_at(path, self.offset)
        })
    }

    /// Whether the way from one place to a bend, or from a bend to the other end, is free; a `tight` one
    /// also right beside the edges.
    fn sees(&self, from: Option<&Bend>, to: Option<&Bend>, tight: bool) -> bool {
        let place = |bend: Option<&Bend>, end: DVec3, offset: f64| {
            bend.map_or(end, |bend| bend_point(bend, offset))
        };
        let free = |offset: f64| {
            let (from, to) = (place(from, self.a, offset), place(to, self.b, offset));
            !self.cut.crosses(from, to)
        };
        free(self.offset) && (!tight || free(TIGHTER[0] * self.offset))
    }

    /// The shortest way over any number of the stops, or `best` if none is shorter.
    ///
    /// Hart, Nilsson, Raphael 1968 with the straight line to the end as the bound. The place of a bend
    /// is the best between the stop before it and the end; all are moved to their best places at last.
    fn search(
        &self,
        best: Way,
        stops: &mut [Stop],
        path: &mut Vec<(u32, Bend)>,
        tight: bool,
    ) -> Way {
        for stop in &mut *stops {
            stop.reached = f64::INFINITY;
            stop.done = false;
        }
        self.extend(None, best.0, stops, tight);
        loop {
            let whole = |stop: &Stop| stop.reached + stop.bend.point.distance(self.b);
            let next = (0..stops.len())
                .filter(|&k| !stops[k].done && whole(&stops[k]) < best.0)
                .min_by(|&k, &m| whole(&stops[k]).total_cmp(&whole(&stops[m])));
            let Some(k) = next else {
                return best;
            };
            stops[k].done = true;
            if self.sees(Some(&stops[k].bend), None, tight) {
                path.clear();
                let mut at = Some(k);
                while let Some(k) = at {
                    path.push((stops[k].id, stops[k].bend));
                    at = stops[k].from;
                }
                path.reverse();
                return match self.tightened(path, stops) {
                    Some(length) if length < best.0 => {
                        let outward: DVec3 = path.iter().map(|(_, bend)| bend.outward).sum();
                        (length, outward.normalize_or_zero())
                    }
                    _ => best,
                };
            }
            self.extend(Some(k), best.0, stops, tight);
        }
    }

    /// Goes on from a stop, or from the start, to all stops that are seen from there.
    fn extend(&self, from: Option<usize>, best: f64, stops: &mut [Stop], tight: bool) {
        let (start, reached) = match from {
            Some(k) => (Some(stops[k].bend), stops[k].reached),
            None => (None, 0.0),
        };
        let last = start.map_or(self.a, |bend| bend.point);
        for stop in &mut *stops {
            if stop.done {
                continue;
            }
            let bend = match from {
                Some(_) => self.cut.bend(stop.id, last, self.b),
                None => stop.bend,
            };
            let length = reached + last.distance(bend.point);
            if length < stop.reached
                && length + bend.point.distance(self.b) < best
                && self.sees(start.as_ref(), Some(&bend), tight)
            {
                stop.bend = bend;
                stop.reached = length;
                stop.from = from;
            }
        }
    }

    /// Length of a way after its bends were moved to their best places, or of the way itself if it is
    /// free no more there.
    fn tightened(&self, path: &mut [(u32, Bend)], stops: &[Stop]) -> Option<f64> {
        let before = self.length(path);
        for _ in 0..EXCHANGES {
            self.sweep(path);
            if !self.exchange(path, stops) {
                break;
            }
        }
        match (before, self.length(path)) {
            (Some(before), Some(after)) => Some(before.min(after)),
            (before, after) => before.or(after),
        }
    }

    /// Moves each bend along its edge to the best place between those beside it, again and again.
    fn sweep(&self, path: &mut [(u32, Bend)]) {
        let mut length = self.length_at(path, 0.0);
        for _ in 0..SWEEPS {
            for k in 0..path.len() {
                let (last, next) = self.beside(path, k);
                path[k].1 = self.cut.bend(path[k].0, last, next);
            }
            let swept = self.length_at(path, 0.0);
            if swept > (1.0 - GAIN) * length {
                break;
            }
            length = swept;
        }
    }

    /// Moves bends to other edges where that makes the way shorter, as from one piece of a divided edge
    /// to the next; whether one was moved.
    fn exchange(&self, path: &mut [(u32, Bend)], stops: &[Stop]) -> bool {
        let mut exchanged = false;
        for k in 0..path.len() {
            let (last, next) = self.beside(path, k);
            let length = |point: DVec3| last.distance(point) + point.distance(next);
            for stop in stops {
                let bend = self.cut.bend(stop.id, last, next);
                if length(bend.point) < (1.0 - GAIN) * length(path[k].1.point)
                    && self.sees(path[..k].last().map(|(_, bend)| bend), Some(&bend), true)
                    && self.sees(Some(&bend), path.get(k + 1).map(|(_, bend)| bend), true)
                {
                    path[k] = (stop.id, bend);
                    exchanged = true;
                }
            }
        }
        exchanged
    }

    /// Points of a way before and after one of its bends.
    fn beside(&self, path: &[(u32, Bend)], k: usize) -> (DVec3, DVec3) {
        let point = |&(_, bend): &(u32, Bend)| bend.point;
        let last = path[..k].last().map_or(self.a, point);
        (last, path.get(k + 1).map_or(self.b, point))
    }
}
