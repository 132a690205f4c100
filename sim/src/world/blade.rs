//! A blade on its way through a body: from its edge in the world to the front of its cut.

use glam::DVec3;
use phyxel_enrich::{Cuts, Front, Graph, Patch, Place, SweptPair, close_edge, swept_pairs};
use phyxel_mls::MapFrame;
use serde::{Deserialize, Serialize};

use super::body::Body;
use super::cutting::Sweep;
use super::error::BodyProblem;
use super::factors::Factors;

/// No point of a blade moves farther than this between two looks at where it is, in spacings.
const LARGEST_MOVE: f64 = 0.5;
/// Tissue that is pressed to a smaller share of its volume is not mapped: its gradients are none.
const LEAST_VOLUME: f64 = 0.2;
/// How often the front is led to pairs that it missed: each time it comes a spacing farther at most,
/// and a blade moves half of one.
const ROUNDS: usize = 3;

/// The blade of one stroke.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Blade {
    front: Front,
    /// Into how many pieces each segment of the edge is divided.
    divisions: Vec<u32>,
    /// Where the samples were last (m), in the world.
    last: Vec<DVec3>,
}

/// A body as a blade finds it.
pub(super) struct Tissue<'a> {
    pub(super) body: &'a Body,
    pub(super) frame: MapFrame<'a>,
    pub(super) factors: &'a Factors,
}

impl Blade {
    /// A blade whose edge (m) is looked at every `spacing` (m).
    pub(super) fn new(edge: &[DVec3], spacing: f64) -> Self {
        let divisions: Vec<u32> = edge
            .windows(2)
            .map(|ends| pieces(ends[0].distance(ends[1]) / spacing))
            .collect();
        let last = divided(edge, &divisions);
        Self {
            front: Front::new(last.len(), spacing),
            divisions,
            last,
        }
    }

    /// Leads the blade to where its edge is now, in steps of half a spacing through tissue that holds
    /// still; also the number of pairs that it passed and the cut does not cross.
    pub(super) fn sweep(
        &mut self,
        edge: &[DVec3],
        cuts: &mut Cuts,
        tissue: &Tissue<'_>,
    ) -> Result<(Sweep, usize), BodyProblem> {
        let now = if edge.len() == self.divisions.len() + 1 {
            divided(edge, &self.divisions)
        } else {
            resampled(edge, self.last.len())
        };
        let inside = |point: DVec3| tissue.body.solid.contains(point);
        let farthest = largest_move(&self.last, &now);
        let count = pieces(farthest / (LARGEST_MOVE * tissue.body.spacing));
        let mut patches = Vec::new();
        let before = self.front.ends();
        let mut from = self.last.clone();
        for step in 1..=count {
            let share = f64::from(step) / f64::from(count);
            let to: Vec<DVec3> = (self.last.iter().zip(&now))
                .map(|(last, now)| last.lerp(*now, share))
                .collect();
            let places: Vec<Place> = (from.iter().zip(&to))
                .map(|(from, to)| tissue.place(*from, *to, cuts))
                .collect();
            let moved = largest_move(&from, &to);
            patches.push(self.front.advance(cuts, &places, moved, &inside)?);
            from = to;
        }
        let sweep = swept(&self.last, &now);
        let mut missed = tissue.missed(&sweep, cuts);
        for _ in 0..ROUNDS {
            if missed.is_empty() {
                break;
            }
            let points: Vec<DVec3> = missed.iter().map(|pair| pair.point).collect();
            let patch = self.front.reach(cuts, &points, &inside)?;
            if patch.triangles.is_empty() {
                break;
            }
            patches.push(patch);
            missed = tissue.missed(&sweep, cuts);
        }
        // What no front is near to: the edge of the cut that ends beside it.
        let rest = |node: u32| tissue.body.rest[node as usize];
        for pair in std::mem::take(&mut missed) {
            if !cuts.crosses(rest(pair.nodes[0]), rest(pair.nodes[1])) {
                patches.push(close_edge(cuts, pair.point, tissue.body.spacing, &inside)?);
                missed = tissue.missed(&sweep, cuts);
            }
        }
        self.last = now;
        patches.retain(|patch: &Patch| !patch.triangles.is_empty());
        let ends = (!patches.is_empty()).then(|| {
            let first = patches.first().and_then(|patch| patch.vertices.first());
            let last = patches.last().and_then(|patch| patch.vertices.last());
            let [a, b] = [first, last].map(|end| end.copied().unwrap_or(DVec3::ZERO));
            let now = self.front.ends().unwrap_or([a, b]);
            [before.unwrap_or([a, b]), now]
        });
        Ok((Sweep { patches, ends }, missed.len()))
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

    /// Pairs that a sweep of the blade passes and the cut does not cross.
    fn missed(&self, sweep: &[[DVec3; 3]], cuts: &Cuts) -> Vec<SweptPair> {
        let body = self.body;
        let present = Graph {
            positions: body.motion.positions(),
            offsets: body.neighborhoods.offsets(),
            indices: body.neighborhoods.indices(),
        };
        let known = |pair| self.factors.factor(pair) < 1.0;
        swept_pairs(&present, &body.rest, sweep, cuts, body.spacing, &known)
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

/// Divides each segment of a polyline into equal pieces.
fn divided(line: &[DVec3], divisions: &[u32]) -> Vec<DVec3> {
    let mut points = Vec::new();
    for (ends, &count) in line.windows(2).zip(divisions) {
        let share = |piece: u32| f64::from(piece) / f64::from(count);
        points.extend((0..count).map(|piece| ends[0].lerp(ends[1], share(piece))));
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
