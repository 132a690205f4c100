//! Lists of pairs that may meet.

use super::blocks::{Blocks, Room};
use super::disks::{DiskSample, Placed, index};
use super::{CHUNK, CLOSE_MARGIN, DEEPEST, DeformableContact, FACING, NEAR, TURN};
use glam::DVec3;
use rayon::prelude::*;

/// Samples of one body that are closer than this at rest (spacings) and do not face each other across a gap are
/// neighbours in the tissue and never in contact.
const NEIGHBORS: f64 = 3.0;

/// Share of restless samples from which on all pairs are listed. Contact of a cut liver (`run liver --threads 1 --set
/// contact="Some(())"`) takes 1.6, 1.2 and 1.6 times as long as forces with 0.1, 0.25 and 0.5.
const MOST_RESTLESS: f64 = 0.25;

impl DeformableContact {
    /// Makes lists of pairs again if samples could have come nearer to each other than these allow; whether it did.
    /// [`Self::add_forces`] does so by itself.
    pub fn update_lists(&mut self, positions: &[DVec3]) -> bool {
        if self.state.listed_at.len() != positions.len() {
            self.list_again(vec![true; self.disks.len()], &[], positions);
            return true;
        }
        let held_at = &self.state.held_at;
        let squares = positions
            .iter()
            .zip(held_at)
            .map(|(a, b)| a.distance_squared(*b));
        let moved = if held_at.is_empty() {
            f64::MAX
        } else {
            squares.fold(0.0, f64::max).sqrt()
        };
        let closest = self.room.pairs.partition_point(|(room, _)| *room <= moved);
        let is_all = moved >= self.room.others;
        if closest == 0 && !is_all {
            return false;
        }
        let closest = (!is_all).then_some(&self.room.pairs[..closest]);
        let (room, spent) = self.room_left(positions, closest);
        if room.pairs.first().is_some_and(|(room, _)| *room < 0.0) {
            self.list_again(self.is_restless(), &spent, positions);
            return true;
        }
        if is_all {
            self.room = room;
            positions.clone_into(&mut self.state.held_at);
        }
        false
    }

    /// How far nodes may move from `positions` (m) before lists lack a pair, as [`Blocks::room_left`] has it.
    fn room_left(
        &self,
        positions: &[DVec3],
        closest: Option<&[(f64, [usize; 2])]>,
    ) -> (Room, Vec<usize>) {
        let from = [&self.state.listed_at[..], &self.state.listed_again_at];
        let may_meet = |a, b| self.between_bodies(a, b).is_some();
        let lists = (self.margin(), self.far(), may_meet);
        (self.blocks).room_left((&self.disks, from), positions, lists, closest)
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
        if !self.state.held_at.is_empty() {
            (self.room, _) = self.room_left(&self.state.held_at, None);
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
        let far = self.far();
        let samples = &self.disks.samples;
        let thickness = |sample: usize| self.disks.thickness[sample].abs();
        let meets = |p: usize, q: usize, square: f64| {
            let (a, b, reach) = (&samples[p], &samples[q], reaches[q]);
            let own = a.body == b.body;
            reach > 0.0
                && square.sqrt() < far(reach, thickness(p) + thickness(q))
                && !(own && is_near(a, b) && is_behind(a, b))
                && !(own && !a.flank && self.disks.share_nodes(index(p), index(q)))
        };
        let found = |p: usize, q: usize, square: f64, met: &mut Vec<(usize, u32)>| {
            let (a, b) = (&samples[p], &samples[q]);
            let joined = a.body == b.body && a.normal.dot(b.normal) >= FACING && is_near(a, b);
            if !joined && self.between_bodies(a.body, b.body).is_some() {
                let both = [(p, q), (q, p)].into_iter();
                let both = both.filter(|(p, q)| meets(*p, *q, square));
                met.extend(both.map(|(p, q)| (p, index(q))));
            }
        };
        let mut of = vec![Vec::new(); self.disks.len()];
        if let Some(restless) = restless {
            for (slot, range) in &self.points {
                let point = self.near[*slot as usize] as usize;
                let list = self.listed(range).iter();
                let list = list.map(|slot| self.near[*slot as usize]);
                of[point].extend(list.filter(|q| !restless[point] && !restless[*q as usize]));
            }
        }
        let again = restless.is_some();
        for (point, other) in (self.blocks).near_samples(again, places, &far, found) {
            of[point].push(other);
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
        let of = if places.is_empty() {
            Vec::new()
        } else {
            (self.blocks).list(restless.is_some(), &self.disks, placed, positions);
            self.find_met(restless, placed)
        };
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

/// Whether two samples are near at rest. Those of a body are then joined by tissue and never in contact, unless they face each
/// other across a gap.
fn is_near(a: &DiskSample, b: &DiskSample) -> bool {
    let near = NEIGHBORS * a.spacing.max(b.spacing);
    a.position.distance_squared(b.position) < near * near
}

/// Whether samples that face away from each other have tissue between them, as thin as it may be beside a cut along the surface.
/// Taken for flanks, the sides of such a feather edge pushed each other apart for ever (`random --all`, seed 91, scene 006).
fn is_behind(a: &DiskSample, b: &DiskSample) -> bool {
    a.flank != b.flank || b.normal.dot(a.position - b.position) < -0.05 * b.spacing
}

#[cfg(test)]
#[path = "lists_tests.rs"]
mod tests;
