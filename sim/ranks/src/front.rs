//! Rank 0's view of all ranks: what its world takes for the shares of the body.

mod model;
mod steps;

use glam::DVec3;
use phyxel_elastic::{Settings, WATCHED_NODES};
use phyxel_integrate::{PassSums, SHARED_NODES};

use crate::command::Command;
use crate::layout::Layout;
use crate::memory::Memory;
use crate::package::Locals;
use crate::share::Share;
use crate::traffic::Traffic;
use crate::vtu::{write_index, write_piece};
use crate::wire::{
    FRONT, Wire, broadcast, gather, gather_kinds, packed, ranks, send, unpacked, vectors, wake,
};
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
    /// What the models were built with.
    settings: Option<Settings>,
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

impl Front {
    /// A list of each rank's range.
    fn counts(&self) -> Vec<usize> {
        let layout = self.layout.as_ref();
        layout.map_or_else(Vec::new, |layout| {
            let all = 0..layout.ranks();
            all.map(|rank| layout.range(rank).len()).collect()
        })
    }

    /// Hears what all ranks say at the end of a step, beside rank 0's own; of monitored nodes, two lists of vectors, if
    /// `watched` is true.
    fn hear(&mut self, mine: &[f64], watched: bool) -> [Vec<f64>; 2] {
        let of_rank = |(rank, count): (usize, usize)| {
            let runs = count.div_ceil(WATCHED_NODES);
            let sums = count.div_ceil(SHARED_NODES) * PassSums::LENGTH;
            let [offsets, bonds] = self.carried.get(rank).copied().unwrap_or_default();
            let more = if watched {
                3 * self.watched_of[rank]
            } else {
                0
            };
            [sums, runs, runs, 1, offsets, bonds, bonds, more, more]
        };
        let counts: Vec<_> = self.counts().into_iter().enumerate().map(of_rank).collect();
        let [
            sums,
            energies,
            indicators,
            ratios,
            offsets,
            bonds,
            bond_energies,
            first,
            second,
        ] = gather_kinds(mine, &counts);
        let (sums, _) = sums.as_chunks();
        self.sums = sums.iter().map(|sums| PassSums(*sums)).collect();
        self.indicators = indicators;
        self.ratio = ratios.into_iter().fold(f64::INFINITY, f64::min);
        self.carried.clear();
        self.works = [offsets.iter().sum(), bonds.iter().sum()];
        let of_bonds = bond_energies.iter().fold(0.0, |sum, energy| sum + energy);
        self.energy = energies.iter().sum::<f64>() + of_bonds;
        [first, second]
    }

    /// Vectors of monitored nodes from all ranks, `N` lists.
    fn gather_watched<const N: usize>(&self, mine: &[f64]) -> [Vec<f64>; N] {
        let counts: Vec<_> = self.watched_of.iter().map(|w| [3 * w; N]).collect();
        gather_kinds(mine, &counts)
    }

    fn picked(&self, list: &[DVec3]) -> Vec<f64> {
        let nodes = self.watched.iter();
        let picked = nodes.flat_map(|&node| list[node as usize].to_array());
        picked.collect()
    }

    fn put(&self, from: &[f64], to: &mut [DVec3]) {
        for (&node, value) in self.watched.iter().zip(vectors(from)) {
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
