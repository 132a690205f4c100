//! Rank 0's view of all ranks: what its world takes for the shares of the body.

mod model;
mod steps;

use glam::DVec3;
use phyxel_elastic::{Frame, WATCHED_NODES};
use phyxel_integrate::{PassSums, SHARED_NODES};

use crate::command::Command;
use crate::layout::Layout;
use crate::memory::Memory;
use crate::package::Locals;
use crate::share::{Share, told};
use crate::traffic::Traffic;
use crate::vtu::{write_index, write_piece};
use crate::wire::{FRONT, Wire, broadcast, gather, packed, ranks, send, unpacked, vectors, wake};
use crate::worker::Counted;

/// The shares of a body on all ranks.
#[derive(Debug, Default)]
pub(crate) struct Front {
    wire: Wire,
    /// Whether the other ranks have been notified that the body is built.
    awake: bool,
    layout: Option<Layout>,
    /// Which nodes each rank has.
    locals: Vec<Locals>,
    mine: Option<Share>,
    /// Models, changes of them and states given to the ranks, and states that came from them.
    traffic: [Traffic; Traffic::KINDS],
    memory: Memory,
    /// What the models were counted from.
    frame: Option<Frame>,
    watched: Vec<u32>,
    /// Watched nodes of each rank.
    watched_of: Vec<usize>,
    energy: f64,
    sums: Vec<PassSums>,
    indicators: Vec<f64>,
    ratio: f64,
    /// Offsets and bonds of each rank whose works it reports in this step.
    carried: Vec<[usize; 2]>,
    works: [f64; 2],
}

fn runs(count: usize) -> usize {
    count.div_ceil(WATCHED_NODES)
}

impl Front {
    /// A list of each rank's range.
    fn counts(&self) -> Vec<usize> {
        let layout = self.layout.as_ref();
        layout.map_or_else(Vec::new, |layout| {
            let all = 0..layout.ranks();
            all.map(|rank| layout.range(rank).len()).collect()
        })
    }

    /// Reads what all ranks said at the end of a step; of monitored nodes, two lists of vectors.
    fn hear(&mut self, all: &[f64], more: usize) -> Vec<Vec<DVec3>> {
        let mut rest = all;
        let mut take = |count: usize| {
            let (these, others) = rest.split_at(count);
            rest = others;
            these
        };
        self.sums.clear();
        self.indicators.clear();
        let mut energies = Vec::new();
        let (mut offsets, mut bonds, mut bond_energies) = (Vec::new(), Vec::new(), Vec::new());
        let mut lists = vec![Vec::new(); more];
        self.ratio = f64::INFINITY;
        for (rank, count) in self.counts().into_iter().enumerate() {
            let chunks = count.div_ceil(SHARED_NODES);
            let (sums, _) = take(chunks * PassSums::LENGTH).as_chunks();
            self.sums.extend(sums.iter().map(|sums| PassSums(*sums)));
            energies.extend_from_slice(take(runs(count)));
            self.indicators.extend_from_slice(take(runs(count)));
            self.ratio = self.ratio.min(take(1)[0]);
            let [carried, bond_count] = self.carried.get(rank).copied().unwrap_or_default();
            offsets.extend_from_slice(take(carried));
            bonds.extend_from_slice(take(bond_count));
            bond_energies.extend_from_slice(take(bond_count));
            for list in &mut lists {
                list.extend_from_slice(vectors(take(3 * self.watched_of[rank])));
            }
        }
        self.carried.clear();
        self.works = [offsets.iter().sum(), bonds.iter().sum()];
        let of_bonds = bond_energies.iter().fold(0.0, |sum, energy| sum + energy);
        self.energy = energies.iter().sum::<f64>() + of_bonds;
        lists
    }

    fn gather_told(&self, mine: &[f64], more: usize) -> Vec<f64> {
        let counts = self.counts().into_iter().zip(&self.watched_of).enumerate();
        let counts: Vec<usize> = counts
            .map(|(rank, (count, watched))| {
                let [offsets, bonds] = self.carried.get(rank).copied().unwrap_or_default();
                told(count) + offsets + 2 * bonds + 3 * more * watched
            })
            .collect();
        gather(mine, &counts)
    }

    /// Vectors of monitored nodes from all ranks, so many lists.
    fn gather_watched(&self, mine: &[f64], lists: usize) -> Vec<Vec<DVec3>> {
        let counts: Vec<usize> = self.watched_of.iter().map(|w| 3 * lists * w).collect();
        let all = gather(mine, &counts);
        let mut found = vec![Vec::new(); lists];
        let mut rest = &all[..];
        for watched in &self.watched_of {
            for list in &mut found {
                let (these, others) = rest.split_at(3 * watched);
                list.extend_from_slice(vectors(these));
                rest = others;
            }
        }
        found
    }

    fn picked(&self, list: &[DVec3]) -> Vec<f64> {
        let nodes = self.watched.iter();
        let picked = nodes.flat_map(|&node| list[node as usize].to_array());
        picked.collect()
    }

    fn put(&self, from: &[DVec3], to: &mut [DVec3]) {
        for (&node, value) in self.watched.iter().zip(from) {
            if let Some(to) = to.get_mut(node as usize) {
                *to = *value;
            }
        }
    }

    /// Gives all ranks the velocities (m/s) of monitored nodes: after a step a rank has of a driven node's only what is
    /// free, as the path is rank 0's.
    fn tell_velocities(&mut self, velocities: &[DVec3]) {
        if self.watched.is_empty() {
            return;
        }
        let mut velocities = self.picked(velocities);
        broadcast(&mut velocities);
        let (mine, _) = self.mine();
        mine.set_watched(&velocities, false);
    }

    /// Notes who is monitored.
    fn watch(&mut self, layout: &Layout, watched: &[u32]) {
        self.watched_of = (0..layout.ranks())
            .map(|rank| {
                let range = layout.range(rank);
                let inside = |node: &&u32| range.contains(&(**node as usize));
                watched.iter().filter(inside).count()
            })
            .collect();
        self.watched = watched.to_vec();
    }

    fn mine(&mut self) -> (&mut Share, &mut Wire) {
        let share = self.mine.as_mut().expect("a model is set before any step");
        (share, &mut self.wire)
    }

    /// Before the first command.
    fn wake(&mut self) {
        if !std::mem::replace(&mut self.awake, true) {
            wake();
        }
    }

    /// Lets every rank write its nodes into a folder.
    pub(crate) fn write(&mut self, folder: &std::path::Path) -> std::io::Result<()> {
        if self.mine.is_none() {
            return Ok(());
        }
        Command::Write.give();
        let name = folder.to_string_lossy().into_owned();
        for rank in 1..ranks() {
            send(rank, name.as_bytes());
        }
        let (mine, wire) = self.mine();
        mine.evaluate_if_due(wire);
        let written = write_piece(mine, folder, FRONT);
        gather(&[0.0], &vec![1; ranks()]);
        written?;
        write_index(folder, ranks())
    }

    /// Ends all ranks; what they counted, and what went between them and rank 0 besides steps.
    pub(crate) fn end(&mut self) -> (Vec<Counted>, [Traffic; Traffic::KINDS]) {
        self.wake();
        Command::End.give();
        let mine = Counted::of(self.mine.as_ref(), &self.memory, &self.wire);
        let mine: [f64; Counted::LENGTH] = packed(&mine);
        let all = gather(&mine, &vec![Counted::LENGTH; ranks()]);
        let counted = all.chunks(Counted::LENGTH).map(unpacked);
        let counted = counted.map(Result::unwrap_or_default);
        (counted.collect(), self.traffic)
    }
}
