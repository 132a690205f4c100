//! Lists of pairs that may meet.

use super::blocks::{Blocks, Room};
use super::disks::{DiskSample, index};
use super::{DEEPEST, DeformableContact, FACING};
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
        let (widest, margin) = (self.widest, self.margin());
        move |reach, thickness| {
            let apart = DEEPEST * widest + thickness;
            (reach * reach + apart * apart).sqrt() + margin
        }
    }

    fn margin(&self) -> f64 {
        self.margin * self.widest
    }

    /// Where samples are (m), and how far (m) their disks reach, with nodes at `positions` (m).
    fn places(&self, positions: &[DVec3]) -> (Vec<DVec3>, Vec<f64>) {
        let place = |sample| self.disks.stretched(sample, positions);
        let places: Vec<(DVec3, f64)> = (0..self.disks.len()).into_par_iter().map(place).collect();
        places.into_iter().unzip()
    }

    /// Blocks of samples that have changed.
    pub(super) fn renew_blocks(&mut self) {
        self.blocks = Blocks::new(&self.disks, self.widest);
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
        let found = |p: usize, q: usize, square: f64, met: &mut Vec<(usize, u32)>| {
            let (a, b) = (&samples[p], &samples[q]);
            let own = a.body == b.body;
            let near = own && is_near(a, b);
            if (near && a.normal.dot(b.normal) >= FACING)
                || self.between_bodies(a.body, b.body).is_none()
            {
                return;
            }
            let thickness = thickness(p) + thickness(q);
            for (p, q, a, b) in [(p, q, a, b), (q, p, b, a)] {
                let meets = reaches[q] > 0.0
                    && !(near && is_behind(a, b))
                    && square < far(reaches[q], thickness).powi(2)
                    && !(own && !a.flank && self.disks.share_nodes(index(p), index(q)));
                if meets {
                    met.push((p, index(q)));
                }
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
