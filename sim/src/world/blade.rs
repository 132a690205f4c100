//! A blade on its way through a body: from its edge in the world to the front of its cut.

use glam::DVec3;
use phyxel_enrich::{
    Bounds, Cuts, Front, Graph, Patch, Place, SweptPair, close_edge, missed_pairs, swept_pairs,
};
use phyxel_mls::MapFrame;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::body::Body;
use super::cutting::{Moment, Sweep};
use super::error::BodyProblem;
use super::factors::Factors;

/// No point of a blade moves farther than this between two looks at where it is, in spacings.
const LARGEST_MOVE: f64 = 0.5;
/// Tissue that is pressed to a smaller share of its volume is not mapped: its gradients are none.
const LEAST_VOLUME: f64 = 0.2;
/// A blade goes on for this way, in spacings, before its front is led to a pair that it passed. The map is not
/// exact to the last hair: most such pairs lie so little ahead of the front that its next step takes them.
const PATIENCE: f64 = 1.0;
/// How often the front is led to pairs that it missed: each time it comes a spacing farther at most,
/// and a blade moves half of one.
const ROUNDS: usize = 3;

/// Places of an edge from which they are sought on several threads; one takes some 20 µs.
const PARALLEL: usize = 8;

/// Nodes within so many spacings of a place of the edge carry it: fewer would be those of one side of the cut.
const CARRYING: f64 = 1.5;

/// A blade of more points than this is looked at only round the body.
const MOST_POINTS: u32 = 4096;

/// The blade of one stroke.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Blade {
    front: Front,
    /// Samples on each segment of the edge, its start included, as shares of it.
    shares: Vec<Vec<f64>>,
    /// Where the samples were last (m), in the world.
    last: Vec<DVec3>,
    /// Nodes round each sample there, and where all nodes were then (m); empty before.
    around: Vec<Vec<u32>>,
    then: Vec<DVec3>,
    /// Pairs that it passed and that the cut does not cross yet, with its way (m) since.
    owed: Vec<(SweptPair, f64)>,
}

/// A body as a blade finds it.
pub(super) struct Tissue<'a> {
    pub(super) body: &'a Body,
    pub(super) frame: MapFrame<'a>,
    pub(super) factors: &'a Factors,
}

impl Blade {
    /// A blade whose edge (m) is looked at every `spacing` (m), if it is very long only within `reach`.
    pub(super) fn new(edge: &[DVec3], spacing: f64, reach: &Bounds) -> Self {
        let segments = || edge.windows(2).map(|ends| (ends[0], ends[1]));
        let whole: f64 = segments().map(|(from, to)| from.distance(to)).sum();
        let everywhere = whole <= f64::from(MOST_POINTS) * spacing;
        let shares: Vec<Vec<f64>> = segments()
            .map(|(from, to)| {
                let part = if everywhere {
                    Some((0.0, 1.0))
                } else {
                    within(from, to, reach)
                };
                shares(part, from.distance(to) / spacing)
            })
            .collect();
        let last = divided(edge, &shares);
        Self {
            front: Front::new(last.len(), spacing),
            shares,
            last,
            around: Vec::new(),
            then: Vec::new(),
            owed: Vec::new(),
        }
    }

    /// Leads the blade to where its edge is now, in steps of half a spacing through the tissue as it lies now:
    /// from where tissue has carried the places that the edge had in it, which a lobe that swings past the blade
    /// moves farther than the hand does. Also the number of pairs that it passed and the cut does not cross.
    pub(super) fn sweep(
        &mut self,
        edge: &[DVec3],
        cuts: &mut Cuts,
        tissue: &Tissue<'_>,
        moment: Moment,
    ) -> Result<(Sweep, usize), BodyProblem> {
        let now = if edge.len() == self.shares.len() + 1 {
            divided(edge, &self.shares)
        } else {
            resampled(edge, self.last.len())
        };
        let inside = |point: DVec3| tissue.body.solid.contains(point);
        let positions = tissue.body.motion.positions();
        self.carry(positions);
        let mut patches = Vec::new();
        let before = self.front.line();
        let mut from = self.last.clone();
        for share in self.looks(&now, tissue.body) {
            let to: Vec<DVec3> = (self.last.iter().zip(&now))
                .map(|(last, now)| last.lerp(*now, share))
                .collect();
            let found = |(from, to): (&DVec3, &DVec3)| tissue.place(*from, *to, cuts);
            let places: Vec<Place> = if from.len() < PARALLEL {
                from.iter().zip(&to).map(found).collect()
            } else {
                from.par_iter().zip(&to).map(found).collect()
            };
            let moved = largest_move(&from, &to);
            patches.push(self.front.advance(cuts, &places, moved, &inside)?);
            from = to;
        }
        let missed = self.settle_debts(&now, cuts, tissue, moment, &mut patches)?;
        self.around = now.iter().map(|at| tissue.around(*at)).collect();
        self.then.clear();
        self.then.extend_from_slice(positions);
        self.last = now;
        patches.retain(|patch: &Patch| !patch.triangles.is_empty());
        let ends = self.front.line().filter(|_| !patches.is_empty());
        let ends = ends.map(|[start, now]| [before.map_or(start, |[_, before]| before), now]);
        Ok((Sweep { patches, ends }, missed))
    }

    /// Moves the last places of the edge with the tissue round them.
    fn carry(&mut self, positions: &[DVec3]) {
        for (last, around) in self.last.iter_mut().zip(&self.around) {
            let moved = around
                .iter()
                .map(|&node| positions[node as usize] - self.then[node as usize]);
            #[allow(clippy::cast_precision_loss, reason = "a node has few neighbours")]
            let count = around.len().max(1) as f64;
            *last += moved.sum::<DVec3>() / count;
        }
    }

    /// Leads the front to pairs that the blade passed a while ago and the cut does not cross; the number of
    /// those that stay.
    fn settle_debts(
        &mut self,
        now: &[DVec3],
        cuts: &mut Cuts,
        tissue: &Tissue<'_>,
        moment: Moment,
        patches: &mut Vec<Patch>,
    ) -> Result<usize, BodyProblem> {
        let (rest, spacing) = (&tissue.body.rest, tissue.body.spacing);
        let inside = |point: DVec3| tissue.body.solid.contains(point);
        let moved = largest_move(&self.last, now);
        for (_, way) in &mut self.owed {
            *way += moved;
        }
        let passed = tissue.passed(&swept(&self.last, now));
        self.owed.extend(passed.into_iter().map(|pair| (pair, 0.0)));
        let is_missed = |pair: &SweptPair, cuts: &Cuts| {
            !missed_pairs(std::slice::from_ref(pair), rest, cuts, spacing).is_empty()
        };
        self.owed.retain(|(pair, _)| is_missed(pair, cuts));
        let is_due =
            |&(_, way): &(SweptPair, f64)| moment == Moment::End || way > PATIENCE * spacing;
        let (due, owed): (Vec<_>, Vec<_>) = self.owed.drain(..).partition(is_due);
        self.owed = owed;
        let mut due: Vec<SweptPair> = due.into_iter().map(|(pair, _)| pair).collect();
        for _ in 0..ROUNDS {
            if due.is_empty() {
                break;
            }
            let points: Vec<DVec3> = due.iter().map(|pair| pair.point).collect();
            let patch = self.front.reach(cuts, &points, &inside)?;
            if patch.triangles.is_empty() {
                break;
            }
            patches.push(patch);
            due.retain(|pair| is_missed(pair, cuts));
        }
        // What no front is near to: the edge of the cut that ends beside it.
        for pair in &due {
            if is_missed(pair, cuts) {
                patches.push(close_edge(cuts, pair.point, spacing, &inside)?);
            }
        }
        due.retain(|pair| is_missed(pair, cuts));
        Ok(due.len())
    }

    /// Whether it can be gone on from, as one that was read from a file may not.
    pub(super) fn is_sound(&self, nodes: usize) -> bool {
        let shares = self.shares.iter().flatten();
        let count = 1 + shares.clone().count();
        self.last.len() == count
            && self.front.sample_count() == count
            && self.front.is_sound()
            && shares.clone().all(|share| share.is_finite())
            && self.last.iter().chain(&self.then).all(|x| x.is_finite())
            && self.then.len() == if self.around.is_empty() { 0 } else { nodes }
            && (self.around.is_empty() || self.around.len() == count)
            && self
                .around
                .iter()
                .flatten()
                .all(|&node| (node as usize) < nodes)
            && self.owed.iter().all(|(pair, way)| {
                let known = pair.nodes.iter().all(|&node| (node as usize) < nodes);
                known && pair.point.is_finite() && way.is_finite()
            })
    }

    /// Shares of the way to the next place of the edge at which the blade is looked at: every half a spacing
    /// while it is near the body, and at the end.
    fn looks(&self, now: &[DVec3], body: &Body) -> Vec<f64> {
        let reach = reach_of(body.motion.positions());
        let ways = self.last.iter().zip(now);
        let near = ways.filter_map(|(last, now)| within(*last, *now, &reach));
        let near = near.reduce(|(a, b), (start, end)| (a.min(start), b.max(end)));
        let Some((start, end)) = near else {
            return vec![1.0];
        };
        let farthest = (end - start) * largest_move(&self.last, now);
        let count = pieces(farthest / (LARGEST_MOVE * body.spacing));
        let share = |look: u32| start + (end - start) * (f64::from(look) / f64::from(count));
        let mut looks: Vec<f64> = (1..=count).map(share).collect();
        if start > 0.0 {
            looks.insert(0, start);
        }
        if end < 1.0 {
            looks.push(1.0);
        }
        looks
    }
}

impl Tissue<'_> {
    /// Where a point of the edge is that comes from another place.
    fn place(&self, from: DVec3, to: DVec3, cuts: &Cuts) -> Place {
        let body = self.body;
        let seen = |node: u32, point: DVec3| !cuts.crosses(body.rest[node as usize], point);
        let Some(found) = self.frame.preimage(to, LEAST_VOLUME, &seen) else {
            let node = self.frame.nearest_node(to) as usize;
            let near = body.motion.positions()[node].distance(to) < body.spacing;
            return if near { Place::Gap } else { Place::Air };
        };
        let at = found.position;
        if body.solid.contains(at) {
            let came = found.jacobian.inverse() * (to - from);
            Place::Inside { at, came }
        } else {
            Place::Outside { at }
        }
    }

    /// Nodes that move a place of the edge with them: those of the nearest node's row, itself included, that are
    /// no farther than [`CARRYING`] spacings, on both sides of a cut. None in the air.
    fn around(&self, at: DVec3) -> Vec<u32> {
        let (body, nearest) = (self.body, self.frame.nearest_node(at));
        let positions = body.motion.positions();
        let reach = CARRYING * body.spacing;
        let row = body.neighborhoods.row(nearest as usize).iter();
        row.chain([&nearest])
            .copied()
            .filter(|&node| positions[node as usize].distance(at) < reach)
            .collect()
    }

    /// Pairs that a sweep of the blade passes and whose factors do not know of it.
    fn passed(&self, sweep: &[[DVec3; 3]]) -> Vec<SweptPair> {
        let body = self.body;
        let present = Graph::trusted(
            body.motion.positions(),
            body.neighborhoods.offsets(),
            body.neighborhoods.indices(),
        );
        let known = |pair| self.factors.factor(pair) < 1.0;
        swept_pairs(&present, &body.rest, sweep, &known)
    }
}

/// Number of pieces of a length that is `ratio` of them.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to what fits"
)]
fn pieces(ratio: f64) -> u32 {
    // So that a length of a whole number of pieces is not one more, whatever the last bit says.
    let rounding = 1.0 - 1e-9;
    (ratio * rounding).ceil().clamp(1.0, 1e6) as u32
}

/// Shares of a segment at which it is divided, its start included: `ratio` pieces would be its whole length.
fn shares(part: Option<(f64, f64)>, ratio: f64) -> Vec<f64> {
    let Some((start, end)) = part else {
        return vec![0.0];
    };
    let count = pieces((end - start) * ratio);
    let share = |piece: u32| start + (end - start) * (f64::from(piece) / f64::from(count));
    let mut shares: Vec<f64> = (0..count).map(share).collect();
    if start > 0.0 {
        shares.insert(0, 0.0);
    }
    if end < 1.0 {
        shares.push(end);
    }
    shares
}

/// Divides each segment of a polyline at its shares.
fn divided(line: &[DVec3], shares: &[Vec<f64>]) -> Vec<DVec3> {
    let mut points = Vec::new();
    for (ends, shares) in line.windows(2).zip(shares) {
        points.extend(shares.iter().map(|&share| ends[0].lerp(ends[1], share)));
    }
    points.extend(line.last());
    points
}

/// Equally spaced points along a polyline, its ends included.
fn resampled(line: &[DVec3], count: usize) -> Vec<DVec3> {
    let lengths: Vec<f64> = line
        .windows(2)
        .map(|ends| ends[0].distance(ends[1]))
        .collect();
    let total: f64 = lengths.iter().sum();
    let mut points = Vec::with_capacity(count);
    let (mut segment, mut passed, mut reached) = (0, 0.0, 0.0);
    for k in 0..count {
        while segment + 1 < lengths.len() && passed + lengths[segment] < reached {
            passed += lengths[segment];
            segment += 1;
        }
        let length = lengths[segment];
        let share = if length > 0.0 {
            ((reached - passed) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        points.push(line[segment].lerp(line[segment + 1], share));
        if k + 1 < count {
            #[allow(clippy::cast_precision_loss, reason = "a blade has few samples")]
            let next = (k + 1) as f64 / (count - 1) as f64;
            reached = total * next;
        }
    }
    points
}

fn largest_move(from: &[DVec3], to: &[DVec3]) -> f64 {
    let moves = from.iter().zip(to).map(|(from, to)| from.distance(*to));
    moves.fold(0.0, f64::max)
}

/// The surface between two places of the edge.
fn swept(from: &[DVec3], to: &[DVec3]) -> Vec<[DVec3; 3]> {
    let pairs = from.windows(2).zip(to.windows(2));
    pairs
        .flat_map(|(a, b)| [[a[0], a[1], b[0]], [b[0], a[1], b[1]]])
        .collect()
}

/// The box round some points, grown on every side by its diagonal: farther off nothing is cut.
pub(super) fn reach_of(points: &[DVec3]) -> Bounds {
    let bounds = Bounds::of(points);
    bounds.grown(bounds.low.distance(bounds.high))
}

/// The part of a way, from 0 to 1, that lies in a box, if any does.
fn within(from: DVec3, to: DVec3, reach: &Bounds) -> Option<(f64, f64)> {
    let (mut start, mut end) = (0.0_f64, 1.0_f64);
    for axis in 0..3 {
        let (x, way) = (from[axis], to[axis] - from[axis]);
        let (low, high) = (reach.low[axis], reach.high[axis]);
        if way == 0.0 {
            if !(low..=high).contains(&x) {
                return None;
            }
            continue;
        }
        let (a, b) = ((low - x) / way, (high - x) / way);
        start = start.max(a.min(b));
        end = end.min(a.max(b));
    }
    (start < end).then_some((start, end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_divided_edge_keeps_its_corners_and_has_no_long_piece() {
        let line = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 0.25, 0.0)];
        let blade = Blade::new(&line, 0.3, &Bounds::of(&line));
        for corner in line {
            assert!(blade.last.contains(&corner), "{corner} is lost");
        }
        for pair in blade.last.windows(2) {
            assert!(pair[0].distance(pair[1]) <= 0.3, "{pair:?} is too long");
        }
        assert_eq!(blade.last.len(), 6, "4 pieces and 1");
    }

    #[test]
    fn a_very_long_edge_is_divided_only_near_the_body() {
        let body = reach_of(&[DVec3::ZERO, DVec3::ONE]);
        let middle = DVec3::splat(0.5);
        let line = [middle - 1e6 * DVec3::X, middle + 1e6 * DVec3::X, middle];
        let blade = Blade::new(&line, 0.1, &body);
        assert!(blade.last.len() < 150, "{} points", blade.last.len());
        for corner in line {
            assert!(blade.last.contains(&corner), "{corner} is lost");
        }
        for pair in blade.last.windows(2) {
            let near = within(pair[0], pair[1], &Bounds::of(&[DVec3::ZERO, DVec3::ONE]));
            let length = pair[0].distance(pair[1]);
            assert!(near.is_none() || length < 0.11, "{pair:?} is too long");
        }
        let away = [DVec3::splat(50.0), DVec3::splat(1e6)];
        assert_eq!(Blade::new(&away, 0.1, &body).last, away, "not divided");
    }
}
