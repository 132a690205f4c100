//! Lists of pairs that may meet, by a grid of cells.

use super::disks::{DiskSample, Placed, index};
use super::{CHUNK, CLOSE_MARGIN, DEEPEST, DeformableContact, FACING, NEAR, TURN};
use glam::DVec3;
use rayon::prelude::*;

/// Samples of one body that are closer than this at rest (spacings) and do not face each other across a gap are
/// neighbours in the tissue and never in contact.
const NEIGHBORS: f64 = 3.0;

/// Cells along an axis at most; those this many apart are one. Samples are tested one by one anyway, and a piece that has
/// fallen far leaves the cells of the others as small as they were.
const MOST_CELLS: usize = 64;

/// Samples of a piece since pairs were listed.
#[derive(Clone)]
struct Part {
    count: f64,
    /// How far (m) they moved together, and at most otherwise.
    drift: DVec3,
    off: f64,
    /// Where they were.
    low: DVec3,
    high: DVec3,
}

impl Default for Part {
    fn default() -> Self {
        Self {
            count: 0.0,
            drift: DVec3::ZERO,
            off: 0.0,
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
        }
    }
}

impl Part {
    fn add(&mut self, place: DVec3, by: DVec3) {
        self.count += 1.0;
        self.drift += by;
        (self.low, self.high) = (self.low.min(place), self.high.max(place));
    }

    /// Whether they are farther than `far` (m) from others.
    fn is_apart(&self, other: &Self, far: f64) -> bool {
        let far = far + self.off + other.off;
        let above = |a: &Self, b: &Self| (a.low + a.drift).cmpgt(b.high + b.drift + far).any();
        above(self, other) || above(other, self)
    }
}

/// Points with others that they meet, as ranges of the second list; both ascending.
///
/// # Arguments
/// * `open` -- whether a point may meet others at all.
/// * `far` -- distance (m) beyond which nothing meets.
/// * `meets` -- whether a point meets another at a squared distance (m²).
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "from 0 to 1e9"
)]
pub(super) fn candidates(
    points: &[DVec3],
    open: &[bool],
    far: f64,
    meets: impl Fn(u32, u32, f64) -> bool + Sync,
) -> (Vec<(u32, [u32; 2])>, Vec<u32>) {
    let all = || {
        (0_u32..)
            .zip(points)
            .zip(open)
            .filter(|(_, open)| **open)
            .map(|(point, _)| point)
    };
    let low = all().map(|(_, x)| *x).fold(DVec3::INFINITY, DVec3::min);
    let high = all().map(|(_, x)| *x).fold(DVec3::NEG_INFINITY, DVec3::max);
    let (mut found, mut lists) = (Vec::new(), Vec::new());
    if !(low.is_finite() && high.is_finite()) {
        return (found, lists);
    }
    let side = far
        .max((high - low).max_element() * 1e-9)
        .max(f64::MIN_POSITIVE);
    let cell = |x: DVec3| ((x - low) / side).floor().to_array().map(|c| c as usize);
    // With an empty one between the last and the first if there is room, and three that differ around each.
    let [nx, ny, nz] = cell(high).map(|last| (last + 2).clamp(3, MOST_CELLS));
    let mut starts = vec![0_usize; nx * ny * nz + 1];
    let number = |[i, j, k]: [usize; 3]| ((k % nz) * ny + j % ny) * nx + i % nx;
    for (_, x) in all() {
        starts[number(cell(*x)) + 1] += 1;
    }
    for c in 1..starts.len() {
        starts[c] += starts[c - 1];
    }
    // In the order of cells, so that memory is read in order.
    let (mut next, mut members) = (starts.clone(), vec![(DVec3::ZERO, 0); points.len()]);
    for (point, x) in all() {
        let at = &mut next[number(cell(*x))];
        members[*at] = (*x, point);
        *at += 1;
    }
    let (starts, members) = (&starts, &members);
    let around = |c: usize, n: usize| [c + n - 1, c, c + 1];
    // Appends what a point meets; how many.
    let meet = |met: &mut Vec<u32>, point: u32, x: DVec3| {
        let ([i, j, k], begin) = (cell(x), met.len());
        for c in around(k, nz) {
            for b in around(j, ny) {
                for a in around(i, nx) {
                    let cell = number([a, b, c]);
                    for &(y, other) in &members[starts[cell]..starts[cell + 1]] {
                        if other != point && meets(point, other, x.distance_squared(y)) {
                            met.push(other);
                        }
                    }
                }
            }
        }
        met[begin..].sort_unstable();
        met.len() - begin
    };
    let open: Vec<(u32, &DVec3)> = all().collect();
    let task = |points: &[(u32, &DVec3)]| {
        let mut met = Vec::new();
        let count = |(point, x): &(u32, &DVec3)| (*point, meet(&mut met, *point, **x));
        let counts: Vec<(u32, usize)> = points.iter().map(count).collect();
        (counts, met)
    };
    let tasks: Vec<_> = open.par_chunks(CHUNK).map(task).collect();
    for (counts, met) in tasks {
        let mut end = lists.len();
        lists.extend(met);
        for (point, count) in counts.into_iter().filter(|(_, count)| *count > 0) {
            found.push((point, [index(end), index(end + count)]));
            end += count;
        }
    }
    (found, lists)
}

impl DeformableContact {
    /// Makes lists of pairs again if samples have moved too far since the last, apart from the common motion of a free piece
    /// far from all others (`pieces` as in [`super::Moved`], empty: none is free); whether it did. [`Self::add_forces`] does so by
    /// itself.
    pub fn update_lists(&mut self, positions: &[DVec3], pieces: &[u32]) -> bool {
        let stays = |from: &[DVec3], room: f64| {
            let room = room / self.amplification;
            let stays = |(a, b): (&DVec3, &DVec3)| a.distance_squared(*b) < room * room;
            from.len() == positions.len() && positions.iter().zip(from).all(stays)
        };
        // Not after samples have changed.
        if self.state.listed_at.len() == positions.len() {
            if stays(&self.state.listed_at, 0.5 * self.margin())
                || stays(&self.held_at, self.held_for)
            {
                return false;
            }
            self.held_for = self.room_left(positions, pieces);
            if self.held_for >= 0.0 {
                self.held_at.clear();
                self.held_at.extend_from_slice(positions);
                return false;
            }
        }
        self.state.listed_at.clear();
        self.state.listed_at.extend_from_slice(positions);
        self.rebuilds += 1;
        self.list_pairs();
        true
    }

    /// How far (m) samples may move before two could have come nearer to each other than lists allow; negative if they could
    /// have by now: those of a piece by how far they moved otherwise than all of it, those of two pieces by their motions, too,
    /// unless the pieces are apart.
    fn room_left(&self, positions: &[DVec3], pieces: &[u32]) -> f64 {
        let (margin, far) = (self.margin(), self.fars().into_iter().fold(0.0, f64::max));
        let of = |sample: usize| {
            let first = self.disks.row(sample).start;
            let piece = pieces.get(self.disks.nodes[first] as usize);
            piece.map_or(0, |piece| piece.wrapping_add(1) as usize)
        };
        let moves = |(sample, place): (usize, &DVec3)| {
            (of(sample), self.disks.gather(sample, positions).0 - *place)
        };
        let moves: Vec<(usize, DVec3)> = self.places.iter().enumerate().map(moves).collect();
        let count = moves.iter().map(|(piece, _)| piece + 1).max().unwrap_or(0);
        let mut parts = vec![Part::default(); count];
        for ((piece, by), place) in moves.iter().zip(&self.places) {
            parts[*piece].add(*place, *by);
        }
        for (piece, part) in parts.iter_mut().enumerate() {
            // What is held drifts nowhere, nor does a piece without samples.
            part.drift *= if piece == 0 {
                0.0
            } else {
                part.count.max(1.0).recip()
            };
        }
        for (piece, by) in &moves {
            let part = &mut parts[*piece];
            part.off = part.off.max(by.distance(part.drift));
        }
        // Samples that move by 1 change what is off by 2, as the drift may be 1 against them.
        let mut room = f64::INFINITY;
        for (k, a) in parts.iter().enumerate() {
            room = room.min((0.5 * margin - a.off) / 2.0);
            for b in &parts[..k] {
                let left = (margin - a.off - b.off - a.drift.distance(b.drift)) / 6.0;
                let is_apart = left < 0.0 && a.is_apart(b, far);
                room = room.min(if is_apart { 0.0 } else { left });
            }
        }
        room
    }

    /// Distance (m) of the rows of a point and a disk beyond which they do not meet.
    fn far(&self, disk: usize, (widest, thickness): (f64, f64)) -> f64 {
        let apart = DEEPEST * widest + thickness.abs() + self.disks.thickness[disk].abs();
        self.disks.reach[disk].hypot(apart) + self.margin * widest
    }

    /// The same of each disk and any point.
    fn fars(&self) -> Vec<f64> {
        let thickness = self.disks.thickness.iter();
        let thickest = thickness.fold(0.0, |most: f64, x| most.max(x.abs()));
        let any = (self.widest(), thickest);
        (0..self.disks.len())
            .map(|disk| self.far(disk, any))
            .collect()
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
        // The inverse of the disk's smallest stretch; feet on one that is all but flat may be anywhere.
        let [aa, ab, bb] = q.inverse;
        let steep = (0.5 * (aa + bb) + (0.25 * (aa - bb).powi(2) + ab * ab).sqrt()).sqrt();
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

    /// Lists pairs as nodes were at [`DeformableState::listed_at`].
    pub(super) fn list_pairs(&mut self) {
        let positions = &self.state.listed_at;
        let all = 0..if positions.is_empty() {
            0
        } else {
            self.disks.len()
        };
        self.places.clear();
        self.places
            .extend(all.map(|s| self.disks.gather(s, positions).0));
        let (places, samples) = (&self.places, &self.disks.samples);
        let bodies = self.frictions.len().isqrt();
        let (fars, widest) = (self.fars(), self.widest());
        let far = fars.iter().copied().fold(0.0, f64::max);
        let mut boxes = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); bodies];
        for (sample, place) in samples.iter().zip(places) {
            let (low, high) = &mut boxes[sample.body as usize];
            (*low, *high) = (low.min(*place), high.max(*place));
        }
        let allowed = |a: u32, b: u32| self.frictions[a as usize * bodies + b as usize].is_some();
        // Samples that lie near to another body, or touch their own.
        let is_open = |(sample, place): (&DiskSample, &DVec3)| {
            let mut others = (0_u32..).zip(&boxes);
            sample.area > 0.0
                && others.any(|(body, (low, high))| {
                    allowed(sample.body, body)
                        && (body == sample.body
                            || place.cmpge(*low - far).all() && place.cmple(*high + far).all())
                })
        };
        let open: Vec<bool> = samples.iter().zip(places).map(is_open).collect();
        let meets = |p: u32, q: u32, distance_squared: f64| {
            let far = fars[q as usize];
            if distance_squared >= far * far {
                return false;
            }
            let point = (widest, self.disks.thickness[p as usize]);
            let (a, b) = (&samples[p as usize], &samples[q as usize]);
            self.disks.reach[q as usize] > 0.0
                && allowed(a.body, b.body)
                && (a.body != b.body
                    || !are_neighbors(a, b) && (a.flank || !self.disks.share_nodes(p, q)))
                && distance_squared < self.far(q as usize, point).powi(2)
        };
        (self.points, self.lists) = candidates(places, &open, far, meets);
        self.close_at.clear();
        self.held_at.clear();
        let mut slots = vec![u32::MAX; samples.len()];
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
