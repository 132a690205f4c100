//! A blade on its path through a body: from its edge in the world to the front of its cut.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::bounds::Bounds;
use crate::cuts::Cuts;
use crate::error::CutError;
use crate::front::{EdgePlace, Front, LAST_SKIN, Patch, SKIN, SweptPair, close_edge, swept_pairs};
use crate::graph::Graph;
use crate::polyline::{
    divided, largest_distance, pieces, resampled, shares, swept_surface, within,
};

/// No point of a blade moves farther than this between two looks at where it is, in spacings.
const LARGEST_MOVE: f64 = 0.5;
/// A blade continues for this distance, in spacings, before its front is moved to a pair that it passed. The map is not
/// exact to the last hair: most such pairs lie so little ahead of the front that its next step takes them. With 0
/// releases of `prove invariance` differ by up to 1.6 %.
const PATIENCE: f64 = 1.0;
/// How far the front runs ahead at once where tissue tears, in spacings: as far as a blade is looked at. With 0.25 and 0.5 a cut
/// that tears by itself (`benches -- griffith --quick`) ends at 0.89 and 0.86 of the toughness.
const TEAR: f64 = LARGEST_MOVE;

/// Positions of an edge from which they are sought on several threads.
const PARALLEL: usize = 8;

/// Nodes within so many spacings of a position of the edge carry it: fewer would be those of one side of the cut. With 1
/// a block of 2 kPa of `benches -- matrix` does not end.
const CARRYING: f64 = 1.5;

/// A blade of more points than this is looked at only around the body.
const MOST_POINTS: u32 = 4096;

/// The blade of one stroke: its edge, looked at every half a spacing of its path, and the front of the cut
/// that it makes.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Blade {
    front: Front,
    /// Samples on each segment of the edge, its start included, as fractions of it.
    shares: Vec<Vec<f64>>,
    /// Where the samples were last (m), in the world.
    last: Vec<DVec3>,
    /// Nodes around each sample there, and where all nodes were then (m); empty before.
    around: Vec<Vec<u32>>,
    then: Vec<DVec3>,
    /// Pairs that it passed and that the cut does not cross yet, with its path length (m) since.
    owed: Vec<(SweptPair, f64)>,
}

/// Finds the material point and `∂x/∂X` there of a world point (m), seen from nodes of which `seen(node, material
/// point)` holds; `None` where there is no tissue.
pub type MaterialPlace<'a> =
    dyn Fn(DVec3, &dyn Fn(u32, DVec3) -> bool) -> Option<(DVec3, DMat3)> + Sync + 'a;

/// A body as a blade finds it, deformed.
#[derive(Clone, Copy)]
pub struct DeformedBody<'a> {
    /// Rest positions X (m), shape `(n)`.
    pub rest: &'a [DVec3],
    /// Its pairs, with present positions x (m) instead of rest positions.
    pub present: Graph<'a>,
    /// Mean distance (m) between neighbouring nodes.
    pub spacing: f64,
    /// Whether a material point (m) lies in the uncut body.
    pub inside: &'a (dyn Fn(DVec3) -> bool + Sync),
    /// Map from the world to the material.
    pub preimage: &'a MaterialPlace<'a>,
    /// Node nearest to a world point (m), if one is no farther than a distance (m).
    pub nearest: &'a (dyn Fn(DVec3, f64) -> Option<u32> + Sync),
    /// Whether a directed pair is known to be crossed by the cut.
    pub known: &'a (dyn Fn(usize) -> bool + Sync),
}

impl std::fmt::Debug for DeformedBody<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let nodes = self.rest.len();
        write!(f, "DeformedBody({nodes} nodes {} m apart)", self.spacing)
    }
}

/// What a blade's edge added to its cut, all in the material: adding it again gives the same cut.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sweep {
    /// Strips, in the order in which they were added.
    pub patches: Vec<Patch>,
    /// Ends (m) of the front before and after it; `None` if nothing was added.
    pub ends: Option<[[DVec3; 2]; 2]>,
}

impl Sweep {
    /// Whether all of it is finite, as one that was read from a file may not be.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let vertices = self.patches.iter().flat_map(|patch| &patch.vertices);
        let ends = self.ends.iter().flatten().flatten();
        vertices.chain(ends).all(|x| x.is_finite())
    }
}

impl Blade {
    /// A blade that begins a stroke with its edge at a position (m, in the world).
    ///
    /// # Arguments
    /// * `edge` -- corners (m), at least two; samples lie `spacing` apart on it.
    /// * `spacing` -- mean distance (m) between neighbouring nodes, positive.
    /// * `positions` -- where the body's nodes are (m). An edge of more than 4,096 samples has them only
    ///   in their box, grown by its diagonal.
    ///
    /// # Panics
    /// If the spacing is not positive.
    #[must_use]
    pub fn new(edge: &[DVec3], spacing: f64, positions: &[DVec3]) -> Self {
        let reach = &reach_of(positions);
        let segments = || edge.windows(2).map(|ends| (ends[0], ends[1]));
        let whole: f64 = segments().map(|(from, to)| from.distance(to)).sum();
        let everywhere = whole <= f64::from(MOST_POINTS) * spacing;
        let shares: Vec<Vec<f64>> = segments()
            .map(|(from, to)| {
                let all = everywhere.then_some((0.0, 1.0));
                let part = all.or_else(|| within(from, to, reach));
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

    /// Drives the blade to where its edge is now, in steps of half a spacing through the tissue as it lies now:
    /// from where tissue has carried the positions that the edge had in it, which a lobe that swings past the blade
    /// moves farther than the user does. A pair that it passed in the world and that the cut does not cross a
    /// spacing of its path later, or when the stroke ends, is moved to. At the end those less than a tenth of a spacing ahead of
    /// a front that is at its blade are left.
    ///
    /// # Arguments
    /// * `edge` -- corners (m) of the edge in the world; with another number of them than at the start it is
    ///   divided evenly.
    /// * `cuts` -- takes what the blade cuts.
    /// * `ends` -- whether the stroke ends here.
    ///
    /// # Returns
    /// What it added, and the number of pairs that it passed and the cut does not cross.
    ///
    /// # Errors
    /// [`CutError::NotFinite`]; what the blade cut before that position stays in the cut until [`Cuts::truncate`], and the
    /// blade itself is to be used no more.
    ///
    /// # Panics
    /// If the body has another number of nodes than at the last call.
    pub fn sweep(
        &mut self,
        edge: &[DVec3],
        cuts: &mut Cuts,
        body: &DeformedBody<'_>,
        ends: bool,
    ) -> Result<(Sweep, usize), CutError> {
        let now = if edge.len() == self.shares.len() + 1 {
            divided(edge, &self.shares)
        } else {
            resampled(edge, self.last.len())
        };
        let positions = body.present.positions();
        self.carry(positions);
        let mut patches = Vec::new();
        let before = self.front.line;
        let mut from = self.last.clone();
        let looks = self.looks(&now, body);
        let last_look = looks.last().copied();
        for share in looks {
            let to: Vec<DVec3> = (self.last.iter().zip(&now))
                .map(|(last, now)| last.lerp(*now, share))
                .collect();
            let found = |(from, to): (&DVec3, &DVec3)| body.place(*from, *to, cuts);
            let places: Vec<EdgePlace> = if from.len() < PARALLEL {
                from.iter().zip(&to).map(found).collect()
            } else {
                from.par_iter().zip(&to).map(found).collect()
            };
            let moved = largest_distance(&from, &to);
            let least = least_step(ends && Some(share) == last_look);
            let patch = self
                .front
                .advance(cuts, &places, moved, body.inside, least)?;
            patches.push(patch);
            from = to;
        }
        let missed = self.settle_debts(&now, cuts, body, ends, &mut patches)?;
        self.then.clear();
        if ends {
            // Where tissue tears the front is kept, for which they play no part.
            (self.around, self.owed) = Default::default();
        } else {
            self.around = now.iter().map(|at| body.around(*at)).collect();
            self.then.extend_from_slice(positions);
        }
        self.last = now;
        Ok((self.swept(patches, before), missed))
    }

    /// Whether tissue tears somewhere along the front, as where the energy release rate exceeds the toughness (Griffith 1921). `tears`
    /// says so of a position (m) and unit vectors: that in which the front as a whole moves, and that along it. All are material.
    pub fn tears(&self, tears: &dyn Fn([DVec3; 3]) -> bool) -> bool {
        self.front.tearing(tears).any(|tears| tears)
    }

    /// Lets the front run ahead of the blade by half a spacing where tissue tears, see [`Blade::tears`]. The blade that
    /// comes after finds the gap.
    ///
    /// # Arguments
    /// * `cuts` -- takes what tears.
    /// * `tears` -- as of [`Blade::tears`].
    /// * `inside` -- whether a material point (m) lies in the uncut body.
    ///
    /// # Returns
    /// What it added.
    ///
    /// # Errors
    /// As [`Blade::sweep`].
    pub fn tear(
        &mut self,
        cuts: &mut Cuts,
        tears: &dyn Fn([DVec3; 3]) -> bool,
        inside: &dyn Fn(DVec3) -> bool,
    ) -> Result<Sweep, CutError> {
        let before = self.front.line;
        let tearing: Vec<bool> = self.front.tearing(tears).collect();
        let patches = self.front.tear(cuts, &tearing, TEAR, inside)?;
        Ok(self.swept(patches, before))
    }

    /// Strips as what was added to the cut, with the front's line of before.
    fn swept(&self, mut patches: Vec<Patch>, before: Option<[[DVec3; 2]; 2]>) -> Sweep {
        patches.retain(|patch| !patch.triangles.is_empty());
        let ends = self.front.line.filter(|_| !patches.is_empty());
        let ends = ends.map(|[start, now]| [before.map_or(start, |[_, before]| before), now]);
        Sweep { patches, ends }
    }

    /// Moves the last positions of the edge with the tissue around them.
    fn carry(&mut self, positions: &[DVec3]) {
        for (last, around) in self.last.iter_mut().zip(&self.around) {
            let moved = |&node: &u32| positions[node as usize] - self.then[node as usize];
            let sum: DVec3 = around.iter().map(moved).sum();
            *last += sum / around.len().max(1) as f64;
        }
    }

    /// Extends the front to pairs that the blade passed a while ago and the cut does not cross; the number of
    /// those that stay.
    fn settle_debts(
        &mut self,
        now: &[DVec3],
        cuts: &mut Cuts,
        body: &DeformedBody<'_>,
        ends: bool,
        patches: &mut Vec<Patch>,
    ) -> Result<usize, CutError> {
        let (rest, spacing) = (body.rest, body.spacing);
        let moved = largest_distance(&self.last, now);
        for (_, way) in &mut self.owed {
            *way += moved;
        }
        let sweep = swept_surface(&self.last, now);
        let passed = swept_pairs(&body.present, rest, &sweep, body.known);
        self.owed.extend(passed.into_iter().map(|pair| (pair, 0.0)));
        let is_missed = |pair: &SweptPair, cuts: &Cuts| pair.is_missed(rest, cuts, spacing);
        self.owed.retain(|(pair, _)| is_missed(pair, cuts));
        if ends {
            self.owed
                .retain(|(pair, _)| !self.front.is_at_blade(pair.point));
        }
        let is_due = |&(_, way): &(SweptPair, f64)| ends || way > PATIENCE * spacing;
        let (due, owed): (Vec<_>, Vec<_>) = self.owed.drain(..).partition(is_due);
        self.owed = owed;
        let mut due: Vec<SweptPair> = due.into_iter().map(|(pair, _)| pair).collect();
        if !due.is_empty() {
            let points: Vec<DVec3> = due.iter().map(|pair| pair.point).collect();
            let least = least_step(ends);
            patches.push(self.front.reach(cuts, &points, body.inside, least)?);
        }
        // What no front is near to: the edge of the cut that ends beside it.
        for pair in &due {
            if is_missed(pair, cuts) {
                patches.push(close_edge(cuts, pair.point, spacing, body.inside)?);
            }
        }
        due.retain(|pair| is_missed(pair, cuts));
        Ok(due.len())
    }

    /// Whether it can continue in a body of so many nodes, as one that was read from a file may not.
    #[must_use]
    pub fn is_sound(&self, nodes: usize) -> bool {
        let shares = self.shares.iter().flatten();
        let count = 1 + shares.clone().count();
        let exists = |node: &u32| (*node as usize) < nodes;
        self.last.len() == count
            && self.front.sample_count() == count
            && self.front.is_sound()
            && shares.clone().all(|share| share.is_finite())
            && self.last.iter().chain(&self.then).all(|x| x.is_finite())
            && self.then.len() == if self.around.is_empty() { 0 } else { nodes }
            && (self.around.is_empty() || self.around.len() == count)
            && self.around.iter().flatten().all(exists)
            && self.owed.iter().all(|(pair, way)| {
                pair.nodes.iter().all(exists) && pair.point.is_finite() && way.is_finite()
            })
    }

    /// Fractions of the path to the next place of the edge at which the blade is looked at: every half a spacing
    /// while it is near the body, and at the end.
    fn looks(&self, now: &[DVec3], body: &DeformedBody<'_>) -> Vec<f64> {
        let reach = reach_of(body.present.positions());
        let ways = self.last.iter().zip(now);
        let near = ways.filter_map(|(last, now)| within(*last, *now, &reach));
        let near = near.reduce(|(a, b), (start, end)| (a.min(start), b.max(end)));
        let Some((start, end)) = near else {
            return vec![1.0];
        };
        let farthest = (end - start) * largest_distance(&self.last, now);
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

impl DeformedBody<'_> {
    /// Where a point of the edge is that comes from another position.
    fn place(&self, from: DVec3, to: DVec3, cuts: &Cuts) -> EdgePlace {
        let seen = |node: u32, point: DVec3| !cuts.crosses(self.rest[node as usize], point);
        let Some((at, jacobian)) = (self.preimage)(to, &seen) else {
            let nearest = (self.nearest)(to, self.spacing);
            let away = |node: u32| self.present.positions[node as usize].distance(to);
            let near = nearest.is_some_and(|node| away(node) < self.spacing);
            return if near { EdgePlace::Gap } else { EdgePlace::Air };
        };
        if (self.inside)(at) {
            // Of tissue that is pressed flat the way may be none.
            let came = jacobian.inverse() * (to - from);
            let came = if came.is_finite() { came } else { DVec3::ZERO };
            EdgePlace::Inside { at, came }
        } else {
            EdgePlace::Outside { at }
        }
    }

    /// Nodes that move a position of the edge with them: those of the nearest node's row, itself included, that are
    /// no farther than [`CARRYING`] spacings, on both sides of a cut. None in the air.
    fn around(&self, at: DVec3) -> Vec<u32> {
        let (positions, reach) = (self.present.positions, CARRYING * self.spacing);
        let Some(nearest) = (self.nearest)(at, reach) else {
            return Vec::new();
        };
        let row = self.present.row(nearest as usize).iter().copied();
        row.chain([nearest])
            .filter(|&node| positions[node as usize].distance(at) < reach)
            .collect()
    }
}

/// The least step of a front (in spacings), the last of a stroke or not.
fn least_step(is_last: bool) -> f64 {
    if is_last { LAST_SKIN } else { SKIN }
}

/// The box around some points, grown on every side by its diagonal: farther off nothing is cut.
fn reach_of(points: &[DVec3]) -> Bounds {
    let bounds = Bounds::of(points);
    bounds.grown(bounds.low.distance(bounds.high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_divided_edge_keeps_its_corners_and_has_no_long_piece() {
        let line = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 0.25, 0.0)];
        let blade = Blade::new(&line, 0.3, &line);
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
        let body = [DVec3::ZERO, DVec3::ONE];
        let middle = DVec3::splat(0.5);
        let line = [middle - 1e6 * DVec3::X, middle + 1e6 * DVec3::X, middle];
        let blade = Blade::new(&line, 0.1, &body);
        assert!(blade.last.len() < 150, "{} points", blade.last.len());
        for corner in line {
            assert!(blade.last.contains(&corner), "{corner} is lost");
        }
        for pair in blade.last.windows(2) {
            let near = within(pair[0], pair[1], &Bounds::of(&body));
            let length = pair[0].distance(pair[1]);
            assert!(near.is_none() || length < 0.11, "{pair:?} is too long");
        }
        let away = [DVec3::splat(50.0), DVec3::splat(1e6)];
        assert_eq!(Blade::new(&away, 0.1, &body).last, away, "not divided");
    }

    /// A block of 7 x 7 x 7 nodes at rest, one apart: the material is the world. Cuts it from y = -5 on with an edge at x = 0.4 that
    /// goes from place to place, and ends; what a blade adds to the cut.
    fn cut_through(ys: &[f64], cuts: &mut Cuts) -> Vec<Sweep> {
        let block = crate::tests::slow::Cloud::block();
        let nodes = &block.x;
        let nearest = |world: DVec3| {
            let away = |k: &u32| nodes[*k as usize].distance_squared(world);
            let order = |a: &u32, b: &u32| away(a).total_cmp(&away(b));
            (0..343).min_by(order).unwrap()
        };
        let inside = |x: DVec3| x.abs().max_element() <= 3.0;
        let body = DeformedBody {
            rest: nodes,
            present: block.graph(),
            spacing: 1.0,
            inside: &inside,
            preimage: &|world, seen| {
                let found = inside(world) && seen(nearest(world), world);
                found.then_some((world, DMat3::IDENTITY))
            },
            nearest: &|world, reach| {
                let found = Some(nearest(world));
                found.filter(|node| nodes[*node as usize].distance(world) <= reach)
            },
            known: &|_| false,
        };
        let edge = |y: f64| [DVec3::new(0.4, y, -5.0), DVec3::new(0.4, y, 5.0)];
        let mut blade = Blade::new(&edge(-5.0), 1.0, nodes);
        let mut sweeps = Vec::new();
        for (k, y) in ys.iter().enumerate() {
            let swept = blade.sweep(&edge(*y), cuts, &body, k + 1 == ys.len());
            let (sweep, missed) = swept.unwrap();
            assert!(sweep.is_finite() && missed == 0, "{missed} missed");
            assert!(blade.is_sound(nodes.len()), "it can be kept");
            sweeps.push(sweep);
        }
        sweeps
    }

    /// It crosses each pair across its plane, in however many sweeps, and no other.
    #[test]
    fn a_blade_through_a_block_crosses_the_pairs_across_its_plane() {
        let block = crate::tests::slow::Cloud::block();
        for sweeps in [1, 2, 9] {
            let mut cuts = Cuts::new(&crate::cuts::CutSettings::for_spacing(1.0));
            let at = |k: u32| -5.0 + 10.0 * f64::from(k) / f64::from(sweeps);
            cut_through(&(0..=sweeps).map(at).collect::<Vec<_>>(), &mut cuts);
            for (i, j) in block.pairs() {
                let (a, b) = (block.x[i], block.x[j]);
                let across = (a.x < 0.4) != (b.x < 0.4);
                assert_eq!(cuts.crosses(a, b), across, "{a} {b} in {sweeps} sweeps");
            }
        }
    }

    /// However far apart the blade's places are, and wherever the last but one, the cut ends where the blade does; and its strips
    /// alone give the same cut, the narrow last ones too.
    #[test]
    fn a_cut_ends_where_its_blade_does() {
        for step in [0.04, 0.07, 0.13, 0.3, 0.47] {
            let mut cuts = Cuts::new(&crate::cuts::CutSettings::for_spacing(1.0));
            let mut again = cuts.clone();
            again.set_weld_tolerance(0.0);
            let places = (0..).map(|k| -5.0 + step * f64::from(k));
            let mut ys: Vec<f64> = places.take_while(|y| *y < 0.16).collect();
            ys.push(0.16);
            for patch in cut_through(&ys, &mut cuts).iter().flat_map(|s| &s.patches) {
                let added = again.add_surface(&patch.vertices, &patch.triangles);
                assert!(!added.unwrap().is_empty(), "every {step}");
            }
            let (vertices, _) = cuts.surface();
            let within = vertices.iter().filter(|x| x.z.abs() < 2.5);
            let end = within.map(|x| x.y).fold(-9.0, f64::max);
            assert!((end - 0.16).abs() <= 0.01, "every {step}: {end}");
            assert_eq!(cuts.surface(), again.surface(), "every {step}");
        }
    }
}
