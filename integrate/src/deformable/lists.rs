//! Lists of pairs that may meet.

use super::blocks::Blocks;
use super::disks::{DiskSample, Placed, index};
use super::{CHUNK, CLOSE_MARGIN, DEEPEST, DeformableContact, FACING, NEAR, TURN};
use glam::DVec3;
use rayon::prelude::*;

/// Samples of one body that are closer than this at rest (spacings) and do not face each other across a gap are
/// neighbours in the tissue and never in contact.
const NEIGHBORS: f64 = 3.0;

/// Largest thickness (spacings) and reach (of the largest at rest) of most samples; the few that have more are searched for
/// apart.
const THIN: f64 = 0.1;
const SHORT: f64 = 1.1;

/// Share of restless samples from which on all pairs are listed. Contact of a cut liver (`run liver --threads 1 --set
/// contact="Some(())"`) takes 1.6, 1.2 and 1.6 times as long as forces with 0.1, 0.25 and 0.5.
const MOST_RESTLESS: f64 = 0.25;

/// Cells along an axis at most; those this many apart are one. Samples are tested one by one anyway, and a piece that has
/// fallen far leaves the cells of the others as small as they were.
const MOST_CELLS: usize = 64;

/// A point, and others that it meets, ascending.
type Met = (u32, Vec<u32>);

/// Points with others that they meet, both ascending.
///
/// # Arguments
/// * `points`, `others` -- whether one is a point, and an other.
/// * `far` -- distance (m) from which on nothing meets.
/// * `meets` -- whether a point meets another at a squared distance (m²).
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "from 0 to 1e9"
)]
pub(super) fn candidates(
    places: &[DVec3],
    [points, others]: [&[bool]; 2],
    far: f64,
    meets: impl Fn(u32, u32, f64) -> bool + Sync,
) -> Vec<Met> {
    let of = |which| {
        let of = |((sample, x), is_one): ((u32, &DVec3), &bool)| is_one.then_some((sample, *x));
        (0_u32..).zip(places).zip(which).filter_map(of)
    };
    let all = || of(others).map(|(_, x)| x);
    let (low, high) = (
        all().fold(DVec3::INFINITY, DVec3::min),
        all().fold(DVec3::NEG_INFINITY, DVec3::max),
    );
    let is_any = points.iter().any(|is_one| *is_one);
    if !(is_any && low.is_finite() && high.is_finite()) {
        return Vec::new();
    }
    let side = far
        .max((high - low).max_element() * 1e-9)
        .max(f64::MIN_POSITIVE);
    let cell = |x: DVec3| ((x - low) / side).floor().to_array().map(|c| c as usize);
    // With an empty one between the last and the first if there is room, and three that differ around each.
    let [nx, ny, nz] = cell(high).map(|last| (last + 2).clamp(3, MOST_CELLS));
    let mut starts = vec![0_usize; nx * ny * nz + 1];
    let at = |[i, j, k]: [usize; 3]| (k * ny + j) * nx + i;
    let number = |x| {
        let [i, j, k] = cell(x);
        at([i % nx, j % ny, k % nz])
    };
    for x in all() {
        starts[number(x) + 1] += 1;
    }
    for c in 1..starts.len() {
        starts[c] += starts[c - 1];
    }
    // In the order of cells, so that memory is read in order.
    let (mut next, mut members) = (starts.clone(), vec![(DVec3::ZERO, 0); places.len()]);
    for (sample, x) in of(others) {
        let place = &mut next[number(x)];
        members[*place] = (x, sample);
        *place += 1;
    }
    let (starts, members) = (&starts, &members);
    let around = |c: usize, n: usize| [n - 1, 0, 1].map(|by| (c % n + by) % n);
    let meet = |(point, x): (u32, DVec3)| {
        let ([i, j, k], mut met) = (cell(x), Vec::new());
        let (i, j, k) = (around(i, nx), around(j, ny), around(k, nz));
        for cell in (0..27).map(|n| at([i[n % 3], j[n / 3 % 3], k[n / 9]])) {
            for &(y, other) in &members[starts[cell]..starts[cell + 1]] {
                let square = x.distance_squared(y);
                if other != point && square < far * far && meets(point, other, square) {
                    met.push(other);
                }
            }
        }
        met.sort_unstable();
        (point, met)
    };
    let points: Vec<_> = of(points).collect();
    let met = points.into_par_iter().with_min_len(CHUNK).map(meet);
    met.filter(|(_, met)| !met.is_empty()).collect()
}

impl DeformableContact {
    /// Makes lists of pairs again if samples could have come nearer to each other than these allow; whether it did.
    /// [`Self::add_forces`] does so by itself.
    pub fn update_lists(&mut self, positions: &[DVec3]) -> bool {
        let stays = |from: &[DVec3], room: f64| {
            let stays = |(a, b): (&DVec3, &DVec3)| a.distance_squared(*b) < room * room;
            from.len() == positions.len() && positions.iter().zip(from).all(stays)
        };
        if self.state.listed_at.len() != positions.len() {
            self.list_again(vec![true; self.disks.len()], &[], positions);
            return true;
        }
        if stays(&self.state.held_at, self.state.held_for) {
            return false;
        }
        let from = [&self.state.listed_at[..], &self.state.listed_again_at];
        let may_meet = |a, b| self.between_bodies(a, b).is_some();
        let lists = (self.margin(), self.far(), may_meet);
        let (room, spent) = (self.blocks).room_left((&self.disks, from), positions, lists);
        if room < 0.0 {
            self.list_again(self.is_restless(), &spent, positions);
            return true;
        }
        self.state.held_for = room;
        positions.clone_into(&mut self.state.held_at);
        false
    }

    /// Lists pairs again of samples that are restless, and of all those of their blocks and of some `blocks`, with nodes at
    /// `positions` (m); all pairs if these are too many.
    pub(super) fn list_again(
        &mut self,
        mut is_restless: Vec<bool>,
        blocks: &[usize],
        positions: &[DVec3],
    ) {
        self.blocks.rouse(blocks, &mut is_restless);
        self.state.held_at.clear();
        self.state.is_bounded = false;
        let restless = (0..).zip(&is_restless).filter(|(_, is_one)| **is_one);
        self.state.restless = restless.map(|(sample, _)| sample).collect();
        if self.state.restless.len() as f64 >= MOST_RESTLESS * is_restless.len() as f64 {
            self.state.restless.clear();
            self.state.listed_again_at.clear();
            positions.clone_into(&mut self.state.listed_at);
            self.list();
        } else {
            positions.clone_into(&mut self.state.listed_again_at);
            self.list_pairs(Some(&is_restless));
        }
    }

    /// Lists pairs as the state says that they were.
    pub(super) fn list(&mut self) {
        let mut is_restless = self.is_restless();
        self.blocks.rouse(&[], &mut is_restless);
        self.list_pairs(None);
        if !self.state.restless.is_empty() {
            self.list_pairs(Some(&is_restless));
        }
    }

    /// Of each sample.
    pub(super) fn is_restless(&self) -> Vec<bool> {
        let mut all = vec![false; self.disks.len()];
        for sample in &self.state.restless {
            all[*sample as usize] = true;
        }
        all
    }

    /// Distance (m), margin included, from which on a point and a disk are in no list, by the disk's reach and the sum of their
    /// thicknesses (m).
    fn far(&self) -> impl Fn(f64, f64) -> f64 + use<> {
        let (widest, margin) = (self.widest(), self.margin());
        move |reach, thickness| {
            let apart = DEEPEST * widest + thickness;
            (reach * reach + apart * apart).sqrt() + margin
        }
    }

    /// Sees to it that close lists name all pairs that may act: a sample that has moved by half of [`CLOSE_MARGIN`] or turned by
    /// [`TURN`] since it was last looked at is looked at again with its pairs, and those that have come half as far. What pairs
    /// do is the same with any such lists.
    pub(super) fn update_close(&mut self, placed: &[Placed]) {
        let room = 0.5 * CLOSE_MARGIN * self.widest();
        let is_first = self.close_at.len() != placed.len();
        if is_first {
            self.close_at.clear();
            self.close_at.extend_from_slice(placed);
            self.close_points.clear();
            self.close_points.resize(self.points.len(), [0; 2]);
        }
        let goes = |part: f64| {
            let (far, turn) = (part * part * room * room, part * part * TURN * TURN);
            move |(now, then): (&Placed, &Placed)| {
                let turns = [now.n - then.n, now.t[0] - then.t[0], now.t[1] - then.t[1]];
                now.x.distance_squared(then.x) >= far
                    || turns.iter().any(|by| by.length_squared() >= turn)
            }
        };
        let pairs = || placed.iter().zip(&self.close_at);
        if !is_first && !pairs().any(goes(1.0)) {
            return;
        }
        let gone = pairs().map(goes(if is_first { 0.0 } else { 0.5 }));
        let gone: Vec<bool> = gone.collect();
        for ((then, now), gone) in self.close_at.iter_mut().zip(placed).zip(&gone) {
            if *gone {
                *then = *now;
            }
        }
        let task = |points: &[(u32, [u32; 2])], closes: &[[u32; 2]]| {
            let mut ends = Vec::with_capacity(points.len());
            let mut close: Vec<u32> = Vec::new();
            for ((point, range), close_range) in points.iter().zip(closes) {
                let mut were = self.close_list(close_range).iter().peekable();
                let all = gone[*point as usize];
                let stays = |other: &&u32| {
                    let was = were.next_if_eq(other).is_some();
                    if all || gone[**other as usize] {
                        self.may_act(*point, **other, room)
                    } else {
                        was
                    }
                };
                close.extend(self.listed(range).iter().filter(stays));
                ends.push(close.len());
            }
            (close, ends)
        };
        let tasks = self.points.par_chunks(CHUNK);
        let tasks: Vec<_> = (tasks.zip(self.close_points.par_chunks(CHUNK)))
            .map(|(points, closes)| task(points, closes))
            .collect();
        self.close.clear();
        self.close_points.clear();
        for (close, ends) in tasks {
            let first = self.close.len();
            self.close.extend(close);
            let mut begin = index(first);
            for end in ends {
                let end = index(first + end);
                self.close_points.push([begin, end]);
                begin = end;
            }
        }
    }

    /// Whether a point may come to act on a disk before one of them has moved by `room` (m) or turned by [`TURN`] from where
    /// it was last looked at.
    fn may_act(&self, point: u32, other: u32, room: f64) -> bool {
        let [p, q] = [point, other].map(|slot| &self.close_at[slot as usize]);
        if p.n.dot(q.n) > FACING + 2.5 * TURN {
            return false;
        }
        let arm = p.x - q.x;
        let raw = q.n.dot(arm);
        let gap = raw - p.thickness - q.thickness;
        let spacing = p.spacing.min(q.spacing);
        let wander = 2.0 * room + TURN * (arm.length() + 2.0 * room);
        if gap > NEAR * spacing + wander || gap < -DEEPEST * spacing - wander {
            return false;
        }
        let [a, b] = q.solve([q.t[0].dot(arm), q.t[1].dot(arm)]);
        let foot = (a * a + b * b).sqrt();
        // Feet on a disk that is all but flat may be anywhere.
        let steep = q.steep();
        let turned = 1.5 * TURN * steep;
        let feet = 2.0 * room * steep + turned * (foot + raw.abs() * steep);
        turned > 0.5 || foot < q.reach + feet / (1.0 - turned)
    }

    fn widest(&self) -> f64 {
        let samples = self.disks.samples.iter();
        samples.map(|sample| sample.spacing).fold(0.0, f64::max)
    }

    fn margin(&self) -> f64 {
        self.margin * self.widest()
    }

    /// Where samples are (m), and how far (m) their disks reach, with nodes at `positions` (m).
    fn places(&self, positions: &[DVec3]) -> (Vec<DVec3>, Vec<f64>) {
        let place = |sample| self.disks.stretched(sample, positions);
        let places: Vec<(DVec3, f64)> = (0..self.disks.len()).into_par_iter().map(place).collect();
        places.into_iter().unzip()
    }

    /// Blocks of samples that have changed.
    pub(super) fn renew_blocks(&mut self) {
        self.blocks = Blocks::new(&self.disks, self.widest());
        let positions = &self.state.listed_at;
        if !positions.is_empty() {
            let (places, reaches) = self.places(positions);
            (self.blocks).list(false, &self.disks, (&places, &reaches), positions);
        }
    }

    /// For each sample those that it meets as a point, with samples at `places` (m) and reaches (m): of restless ones as found
    /// there, of others as listed before; of all as found where none is.
    fn find_met(
        &self,
        restless: Option<&[bool]>,
        (places, reaches): (&[DVec3], &[f64]),
    ) -> Vec<Vec<u32>> {
        let all = places.len();
        let (far, widest) = (self.far(), self.widest());
        let samples = &self.disks.samples;
        let thickness = |sample: usize| self.disks.thickness[sample].abs();
        let meets = |p: u32, q: u32, distance_squared: f64| {
            let (point, disk) = (p as usize, q as usize);
            let (a, b) = (&samples[point], &samples[disk]);
            let reach = reaches[disk];
            let allowed = self.between_bodies(a.body, b.body);
            if reach == 0.0 || allowed.is_none() || a.body == b.body && are_neighbors(a, b) {
                return false;
            }
            distance_squared.sqrt() < far(reach, thickness(point) + thickness(disk))
                && (a.body != b.body || a.flank || !self.disks.share_nodes(p, q))
        };
        let is_new = |sample: u32| restless.is_none_or(|restless| restless[sample as usize]);
        let most = |of: &dyn Fn(usize) -> f64, which: &[bool]| {
            let all = (0..all).filter(|sample| which[*sample]);
            all.map(of).fold(0.0, f64::max)
        };
        let acts: Vec<bool> = (0..all).map(|sample| samples[sample].area > 0.0).collect();
        // Few are thick or stretched much.
        let (thin, short) = (
            THIN * widest,
            SHORT * most(&|disk| self.disks.reach[disk], &acts),
        );
        let is_first = |sample: usize| match restless {
            Some(restless) => restless[sample],
            None => thickness(sample) > thin || reaches[sample] > short,
        };
        let which = |first: bool| -> Vec<bool> {
            let of = |sample: usize| acts[sample] && is_first(sample) == first;
            (0..all).map(of).collect()
        };
        let (first, others) = (which(true), which(false));
        let search = |points: &[bool], disks: &[bool], either: bool| {
            let [one, two] = [points, disks].map(|which| most(&thickness, which));
            let reach = |which| most(&|disk| reaches[disk], which);
            let reach = reach(disks).max(if either { reach(points) } else { 0.0 });
            let meet = |p, q, square| meets(p, q, square) || either && meets(q, p, square);
            candidates(places, [points, disks], far(reach, one + two), meet)
        };
        let mut found = search(&first, &first, false);
        if restless.is_none() {
            found.extend(search(&others, &others, false));
        }
        let between = search(&first, &others, true);
        let mut of = vec![Vec::new(); self.disks.len()];
        // Of lists of before what is between others.
        for (slot, range) in &self.points {
            let point = self.near[*slot as usize];
            let list = self
                .listed(range)
                .iter()
                .map(|slot| self.near[*slot as usize]);
            of[point as usize].extend(list.filter(|other| !is_new(point) && !is_new(*other)));
        }
        for (point, met) in found {
            of[point as usize].extend(met);
        }
        for (point, met) in between {
            for other in met {
                let [x, y] = [point, other].map(|sample| places[sample as usize]);
                for (p, q) in [(point, other), (other, point)] {
                    if meets(p, q, x.distance_squared(y)) {
                        of[p as usize].push(q);
                    }
                }
            }
        }
        of
    }

    /// Lists all pairs as nodes were at [`super::DeformableState::listed_at`], or those of restless samples as nodes were at
    /// [`super::DeformableState::listed_again_at`].
    fn list_pairs(&mut self, restless: Option<&[bool]>) {
        let positions = match restless {
            Some(_) => &self.state.listed_again_at,
            None => &self.state.listed_at,
        };
        let (places, reaches) = if positions.is_empty() {
            Default::default()
        } else {
            self.places(positions)
        };
        let placed = (&places[..], &reaches[..]);
        let of = self.find_met(restless, placed);
        if !places.is_empty() {
            (self.blocks).list(restless.is_some(), &self.disks, placed, positions);
        }
        self.points.clear();
        self.lists.clear();
        for (point, mut list) in (0..).zip(of).filter(|(_, list)| !list.is_empty()) {
            list.sort_unstable();
            let begin = self.lists.len();
            self.lists.extend(list);
            self.points
                .push((point, [begin, self.lists.len()].map(index)));
        }
        self.close_at.clear();
        let mut slots = vec![u32::MAX; self.disks.len()];
        let named = || self.points.iter().map(|(point, _)| point);
        for &sample in named().chain(&self.lists) {
            slots[sample as usize] = sample;
        }
        self.near = slots.iter().copied().filter(|s| *s != u32::MAX).collect();
        for (slot, &sample) in (0..).zip(&self.near) {
            slots[sample as usize] = slot;
        }
        for (point, _) in &mut self.points {
            *point = slots[*point as usize];
        }
        for sample in &mut self.lists {
            *sample = slots[*sample as usize];
        }
    }
}

/// Whether two samples of a body are joined by tissue at rest: they are near, and do not face each other across a gap.
fn are_neighbors(a: &DiskSample, b: &DiskSample) -> bool {
    let arm = a.position - b.position;
    let near = NEIGHBORS * a.spacing.max(b.spacing);
    let faces = a.normal.dot(b.normal) < FACING;
    // Behind the other: back to back, with tissue between, as thin as it may be beside a cut along the surface. Taken for
    // flanks, the sides of such a feather edge pushed each other apart for ever (`random --all`, seed 91, scene 006).
    let behind = a.flank != b.flank || b.normal.dot(arm) < -0.05 * b.spacing;
    arm.length_squared() < near * near && (!faces || behind)
}

#[cfg(test)]
#[path = "lists_tests.rs"]
mod tests;
