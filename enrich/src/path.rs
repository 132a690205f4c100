//! The shortest free path around a cut.

use glam::DVec3;

use crate::bounds::Bounds;
use crate::cuts::Cuts;
use crate::edges::DiffractionPoint;

/// Work space of a search; contents do not matter.
#[derive(Debug, Clone, Default)]
pub(crate) struct PathScratch {
    near: Vec<u32>,
    stops: Vec<Stop>,
    path: Vec<DiffractionPoint>,
}

/// An edge that a path may bend around.
#[derive(Debug, Clone, Copy)]
struct Stop {
    /// Length of the path around this edge alone: no path over the edge is shorter.
    least: f64,
    /// Where the shortest path found so far passes it.
    diffraction: DiffractionPoint,
    /// Length of that path from its start; infinite while none is known.
    reached: f64,
    /// The stop before this one on it.
    from: Option<usize>,
    done: bool,
}

/// A diffraction point must be free this far outside of its edge, relative to the influence radius. It is what
/// severs pairs at a joint that is not quite closed, and along a cut that overshoots the body by a little.
pub(crate) const OFFSET: f64 = 0.05;

/// Fractions of the offset at which a path that is free at the whole offset is tried again, so that its
/// length is that of a path that is there: over the edge itself but for round-off, or farther outside.
const TIGHTER: [f64; 2] = [1e-4, 0.125];

/// Sweeps over the diffraction points of a path, each moved to its best position between its neighbours: at most so many,
/// and no more once a sweep gains less than `GAIN` of the length.
const SWEEPS: usize = 60;
const GAIN: f64 = 1e-6;
/// Sweeps over the whole, each after points were moved to other edges. One is the rule.
const EXCHANGES: usize = 10;

/// What a search asks again and again.
struct Paths<'a> {
    cut: &'a Cuts,
    inside: &'a (dyn Fn(DVec3) -> bool + Sync),
    /// Distance (m) from an edge at which a diffraction point must be free.
    offset: f64,
    a: DVec3,
    b: DVec3,
}

/// Length of a path (m), and the mean direction at its diffraction points out of the cut: of unit length, or zero where they
/// cancel.
pub(crate) type Path = (f64, DVec3);

/// The shortest free path from `a` to `b`, if its length is below the influence `radius` (m).
///
/// A path is free if, moved outward by the offset at each of its diffraction points, it crosses nothing and each of
/// these lies in the body. Its length is that over the edges themselves where such a path is free as well, and
/// that of a path a little outside of them where it is not.
///
/// A path over an edge is never shorter than the one that passes there alone. The first free one of
/// these in order of length is therefore the shortest of all but for paths over those before it, and
/// only if there are such is there anything to search.
pub(crate) fn shortest_path(
    cut: &Cuts,
    a: DVec3,
    b: DVec3,
    radius: f64,
    inside: &(dyn Fn(DVec3) -> bool + Sync),
    scratch: &mut PathScratch,
) -> Option<Path> {
    // A search takes the best positions seen from where it starts, so it starts where a lies whatever its number.
    let [a, b] = if a.to_array() <= b.to_array() {
        [a, b]
    } else {
        [b, a]
    };
    let PathScratch { near, stops, path } = scratch;
    let around = Bounds::of(&[a.midpoint(b)]).grown(0.5 * radius);
    let ends = cut.edges.diffraction_into(&around, near);
    // Where the cut does not end nearby, an odd number of crossings means that a and b are on different sides.
    if !ends && cut.crossings(a, b) % 2 == 1 {
        return None;
    }
    stops.clear();
    for &id in &*near {
        let diffraction = cut.edges.diffraction_point(id, a, b);
        let least = a.distance(diffraction.point) + diffraction.point.distance(b);
        if least < radius {
            stops.push(Stop {
                least,
                diffraction,
                reached: f64::INFINITY,
                from: None,
                done: false,
            });
        }
    }
    stops.sort_unstable_by(|x, y| {
        x.least
            .total_cmp(&y.least)
            .then(x.diffraction.edge.cmp(&y.diffraction.edge))
    });
    let paths = Paths {
        cut,
        inside,
        offset: OFFSET * radius,
        a,
        b,
    };
    let mut best = (radius, DVec3::ZERO);
    let mut shorter = 0;
    while shorter < stops.len() && stops[shorter].least < best.0 {
        let diffraction = stops[shorter].diffraction;
        if let Some(length) = paths.length(&[diffraction])
            && length < best.0
        {
            best = (length, diffraction.outward);
        }
        shorter += 1;
    }
    stops.retain(|stop| stop.least < best.0 && inside(stop.diffraction.outside(paths.offset)));
    if stops.len() > 1 && paths.some_seen_from(a, stops) && paths.some_seen_from(b, stops) {
        best = paths.search(best, stops, path, true);
        best = paths.search(best, stops, path, false);
    }
    (best.0 < radius).then_some(best)
}

impl Paths<'_> {
    fn some_seen_from(&self, end: DVec3, stops: &[Stop]) -> bool {
        let outside = |stop: &Stop| stop.diffraction.outside(self.offset);
        (stops.iter()).any(|stop| !self.cut.crosses(end, outside(stop)))
    }

    /// Whether a path crosses nothing if its diffraction points are moved outward by `offset`.
    fn is_free(&self, path: &[DiffractionPoint], offset: f64) -> bool {
        let mut last = self.a;
        for diffraction in path {
            let next = diffraction.outside(offset);
            if self.cut.crosses(last, next) {
                return false;
            }
            last = next;
        }
        !self.cut.crosses(last, self.b)
    }

    /// Length of a path whose diffraction points are moved outward by `offset`.
    fn length_at(&self, path: &[DiffractionPoint], offset: f64) -> f64 {
        let mut last = self.a;
        let mut length = 0.0;
        for diffraction in path {
            let next = diffraction.outside(offset);
            length += last.distance(next);
            last = next;
        }
        length + last.distance(self.b)
    }

    /// Length of a path, if it is free.
    fn length(&self, path: &[DiffractionPoint]) -> Option<f64> {
        let in_body = |at: &DiffractionPoint| (self.inside)(at.outside(self.offset));
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

    /// Whether the path from one point to a diffraction point, or from one to the other end, is free; a `tight` one
    /// also right beside the edges.
    fn sees(
        &self,
        from: Option<&DiffractionPoint>,
        to: Option<&DiffractionPoint>,
        tight: bool,
    ) -> bool {
        let point = |diffraction: Option<&DiffractionPoint>, end: DVec3, offset: f64| {
            diffraction.map_or(end, |diffraction| diffraction.outside(offset))
        };
        let free = |offset: f64| {
            let (from, to) = (point(from, self.a, offset), point(to, self.b, offset));
            !self.cut.crosses(from, to)
        };
        free(self.offset) && (!tight || free(TIGHTER[0] * self.offset))
    }

    /// The shortest path over any number of the stops, or `best` if none is shorter.
    ///
    /// Hart, Nilsson, Raphael 1968 with the straight line to the end as the bound. The position of a point
    /// is the best between the stop before it and the end; all are moved to their best positions at last.
    fn search(
        &self,
        best: Path,
        stops: &mut [Stop],
        path: &mut Vec<DiffractionPoint>,
        tight: bool,
    ) -> Path {
        for stop in &mut *stops {
            stop.reached = f64::INFINITY;
            stop.done = false;
        }
        self.extend(None, best.0, stops, tight);
        loop {
            let whole = |stop: &Stop| stop.reached + stop.diffraction.point.distance(self.b);
            let next = (0..stops.len())
                .filter(|&k| !stops[k].done && whole(&stops[k]) < best.0)
                .min_by(|&k, &m| whole(&stops[k]).total_cmp(&whole(&stops[m])));
            let Some(k) = next else {
                return best;
            };
            stops[k].done = true;
            if self.sees(Some(&stops[k].diffraction), None, tight) {
                path.clear();
                let mut at = Some(k);
                while let Some(k) = at {
                    path.push(stops[k].diffraction);
                    at = stops[k].from;
                }
                path.reverse();
                return match self.tightened(path, stops) {
                    Some(length) if length < best.0 => {
                        let outward: DVec3 = path.iter().map(|at| at.outward).sum();
                        (length, outward.normalize_or_zero())
                    }
                    _ => best,
                };
            }
            self.extend(Some(k), best.0, stops, tight);
        }
    }

    /// Extends the search from a stop, or from the start, to all stops that are seen from there.
    fn extend(&self, from: Option<usize>, best: f64, stops: &mut [Stop], tight: bool) {
        let (start, reached) = match from {
            Some(k) => (Some(stops[k].diffraction), stops[k].reached),
            None => (None, 0.0),
        };
        let last = start.map_or(self.a, |diffraction| diffraction.point);
        for stop in &mut *stops {
            if stop.done {
                continue;
            }
            let diffraction = match from {
                Some(_) => self
                    .cut
                    .edges
                    .diffraction_point(stop.diffraction.edge, last, self.b),
                None => stop.diffraction,
            };
            let length = reached + last.distance(diffraction.point);
            if length < stop.reached
                && length + diffraction.point.distance(self.b) < best
                && self.sees(start.as_ref(), Some(&diffraction), tight)
            {
                stop.diffraction = diffraction;
                stop.reached = length;
                stop.from = from;
            }
        }
    }

    /// Length of a path after its diffraction points were moved to their best positions, or of the path itself if it is
    /// free no more there.
    fn tightened(&self, path: &mut [DiffractionPoint], stops: &[Stop]) -> Option<f64> {
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

    /// Moves each diffraction point along its edge to the best position between those beside it, again and again.
    fn sweep(&self, path: &mut [DiffractionPoint]) {
        let mut length = self.length_at(path, 0.0);
        for _ in 0..SWEEPS {
            for k in 0..path.len() {
                let (last, next) = self.beside(path, k);
                path[k] = self.cut.edges.diffraction_point(path[k].edge, last, next);
            }
            let swept = self.length_at(path, 0.0);
            if swept > (1.0 - GAIN) * length {
                break;
            }
            length = swept;
        }
    }

    /// Moves diffraction points to other edges where that makes the path shorter, as from one piece of a divided edge
    /// to the next; whether one was moved.
    fn exchange(&self, path: &mut [DiffractionPoint], stops: &[Stop]) -> bool {
        let mut exchanged = false;
        for k in 0..path.len() {
            let (last, next) = self.beside(path, k);
            let length = |point: DVec3| last.distance(point) + point.distance(next);
            for stop in stops {
                let edge = stop.diffraction.edge;
                let diffraction = self.cut.edges.diffraction_point(edge, last, next);
                if length(diffraction.point) < (1.0 - GAIN) * length(path[k].point)
                    && self.sees(path[..k].last(), Some(&diffraction), true)
                    && self.sees(Some(&diffraction), path.get(k + 1), true)
                {
                    path[k] = diffraction;
                    exchanged = true;
                }
            }
        }
        exchanged
    }

    /// Points of a path before and after one of its diffraction points.
    fn beside(&self, path: &[DiffractionPoint], k: usize) -> (DVec3, DVec3) {
        let last = path[..k].last().map_or(self.a, |at| at.point);
        (last, path.get(k + 1).map_or(self.b, |at| at.point))
    }
}
