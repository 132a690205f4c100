//! Rank 0's view of all ranks: what its world takes for the shares of the body.

use glam::DVec3;
use phyxel::world::{BodyProblem, BodyShares, Member};
use phyxel_elastic::WATCHED_NODES;
use phyxel_integrate::{Motion, Pass, PassSums, SHARED_NODES, Shares, State};

use crate::command::Command;
use crate::layout::Layout;
use crate::package::packages;
use crate::share::{Share, told};
use crate::wire::{
    FRONT, Wire, broadcast, gather, ranks, receive_vectors, send, send_vectors, vectors,
};
use crate::worker::{Counted, write_nodes};

/// The shares of a body on all ranks.
#[derive(Debug, Default)]
pub(crate) struct Front {
    wire: Wire,
    layout: Option<Layout>,
    mine: Option<Share>,
    watched: Vec<u32>,
    /// Watched nodes of each rank.
    watched_of: Vec<usize>,
    energy: f64,
    sums: Vec<PassSums>,
    indicators: Vec<f64>,
    ratio: f64,
    /// Offsets and bonds of each rank whose works it tells of in this step.
    carried: Vec<[usize; 2]>,
    works: [f64; 2],
}

fn command(command: Command) {
    broadcast(&mut command.encode());
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

    /// Reads what all ranks said at the end of a step; of watched nodes, two lists of vectors.
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

    /// Vectors of watched nodes from all ranks, so many lists.
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

    fn mine(&mut self) -> (&mut Share, &mut Wire) {
        let share = self.mine.as_mut().expect("a model is set before any step");
        (share, &mut self.wire)
    }

    /// Lets every rank write its nodes into a folder.
    pub(crate) fn write(&mut self, folder: &std::path::Path) -> std::io::Result<()> {
        if self.mine.is_none() {
            return Ok(());
        }
        command(Command::Write);
        let name = folder.to_string_lossy().into_owned();
        for rank in 1..ranks() {
            send(rank, name.as_bytes());
        }
        let written = self.mine.as_ref().map(|mine| write_nodes(mine, folder));
        gather(&[0.0], &vec![1; ranks()]);
        written.unwrap_or(Ok(()))?;
        crate::vtu::write_index(folder, ranks())
    }

    /// Ends all ranks; what they counted.
    pub(crate) fn end(&mut self) -> Vec<Counted> {
        command(Command::End);
        let mine = Counted::of(self.mine.as_ref(), &self.wire);
        let all = gather(&mine.encode(), &vec![Counted::LENGTH; ranks()]);
        let (all, _) = all.as_chunks();
        all.iter()
            .map(|numbers| Counted::decode(*numbers))
            .collect()
    }
}

impl Shares for Front {
    fn begin(&mut self, pass: &Pass, state: &mut State) {
        if self.watched.is_empty() {
            command(Command::Step(*pass));
            let (mine, wire) = self.mine();
            mine.clear_applied();
            mine.begin(pass);
            mine.evaluate(wire);
            let told = mine.end(pass);
            let all = self.gather_told(&told, 0);
            self.hear(&all, 0);
            return;
        }
        command(Command::Watched(*pass));
        let mut velocities = self.picked(&state.velocities);
        broadcast(&mut velocities);
        let (mine, _) = self.mine();
        mine.set_watched(&velocities, false);
        mine.begin(pass);
        let told = mine.watched(&[mine.motion.positions(), mine.motion.velocities()]);
        let found = self.gather_watched(&told, 2);
        self.put(&found[0], &mut state.positions);
        self.put(&found[1], &mut state.velocities);
    }

    fn evaluate(&mut self, state: &mut State, forces: &mut [DVec3]) {
        if self.watched.is_empty() {
            return;
        }
        let mut positions = self.picked(&state.positions);
        broadcast(&mut positions);
        let (mine, wire) = self.mine();
        mine.set_watched(&positions, true);
        mine.evaluate(wire);
        let told = mine.watched(&[mine.own_forces()]);
        let found = self.gather_watched(&told, 1);
        self.put(&found[0], forces);
    }

    fn end(
        &mut self,
        pass: &Pass,
        applied: &[DVec3],
        state: &mut State,
        viscous: &mut [DVec3],
    ) -> (f64, Vec<PassSums>) {
        if !self.watched.is_empty() {
            let acts = !applied.is_empty();
            let mut numbers = vec![f64::from(u8::from(acts))];
            if acts {
                numbers.extend(self.picked(applied));
            } else {
                numbers.resize(1 + 3 * self.watched.len(), 0.0);
            }
            broadcast(&mut numbers);
            let (mine, _) = self.mine();
            let told = mine.end_watched(pass, &numbers);
            let all = self.gather_told(&told, 2);
            let found = self.hear(&all, 2);
            self.put(&found[0], &mut state.velocities);
            self.put(&found[1], viscous);
        }
        (self.energy, std::mem::take(&mut self.sums))
    }

    fn fetch(&mut self, state: &mut State) {
        let Some(layout) = self.layout.clone() else {
            return;
        };
        command(Command::Fetch);
        let (mine, _) = self.mine();
        let own = mine.motion.state().clone();
        let n = layout.range(layout.ranks() - 1).end;
        let viscous = state.viscous.len() == n && n > 0;
        for rank in 0..layout.ranks() {
            let range = layout.range(rank);
            let lists = [
                (&mut state.positions, &own.positions),
                (&mut state.velocities, &own.velocities),
                (&mut state.forces, &own.forces),
                (&mut state.viscous, &own.viscous),
            ];
            for (k, (to, from)) in lists.into_iter().enumerate() {
                let none = k == 3 && !viscous;
                let to = &mut to[if none { 0..0 } else { range.clone() }];
                if rank == FRONT {
                    to.copy_from_slice(from);
                } else {
                    receive_vectors(rank, to);
                }
            }
        }
    }

    fn store(&mut self, state: &State) {
        let Some(layout) = self.layout.clone() else {
            return;
        };
        command(Command::Store);
        for rank in 0..layout.ranks() {
            let range = layout.range(rank);
            let velocities = &state.velocities[range.clone()];
            let viscous = state.viscous.get(range).unwrap_or_default();
            if rank == FRONT {
                let (mine, _) = self.mine();
                mine.motion.places_mut().1.copy_from_slice(velocities);
                mine.motion.viscous_mut().copy_from_slice(viscous);
            } else {
                send_vectors(rank, velocities);
                send_vectors(rank, viscous);
            }
        }
    }
}

impl BodyShares for Front {
    fn set_model(&mut self, member: &Member, watched: &[u32]) -> Result<(), BodyProblem> {
        let layout = Layout::new(member.body.rest.len(), ranks());
        let mut mine = None;
        command(Command::Model);
        for (rank, package) in packages(&layout, member, watched).into_iter().enumerate() {
            if rank == FRONT {
                mine = Some(package);
            } else {
                send(rank, &encoded(&package)?);
            }
        }
        self.watched_of = (0..layout.ranks())
            .map(|rank| {
                let range = layout.range(rank);
                let inside = |node: &&u32| range.contains(&(**node as usize));
                watched.iter().filter(inside).count()
            })
            .collect();
        self.watched = watched.to_vec();
        self.layout = Some(layout);
        let built = mine.map(Share::new).transpose();
        let fine = gather(&[f64::from(u8::from(built.is_ok()))], &vec![1; ranks()]);
        self.mine = built?;
        match fine.iter().all(|fine| *fine > 0.0) {
            true => Ok(()),
            false => Err(BodyProblem::Damaged("rows of a rank")),
        }
    }

    fn set_state(&mut self, motion: &Motion) -> Result<(), BodyProblem> {
        let Some(layout) = self.layout.clone() else {
            return Ok(());
        };
        command(Command::State);
        for rank in 0..layout.ranks() {
            let range = layout.range(rank);
            let part = |list: &Vec<DVec3>| list.get(range.clone()).unwrap_or_default().to_vec();
            let whole = motion.state();
            let state = State {
                positions: part(&whole.positions),
                velocities: part(&whole.velocities),
                forces: part(&whole.forces),
                applied: part(&whole.applied),
                viscous: part(&whole.viscous),
                ..State::default()
            };
            let loads = motion.loads().get(range.clone()).unwrap_or_default();
            if rank == FRONT {
                let (mine, _) = self.mine();
                mine.set_state(state, loads)?;
            } else {
                send(rank, &encoded(&(state, loads))?);
            }
        }
        let (mine, wire) = self.mine();
        if mine.package.carries {
            mine.evaluate(wire);
        }
        Ok(())
    }

    fn smallest_volume_ratio(&self) -> f64 {
        self.ratio
    }

    fn stiffness_indicators(&self) -> Vec<f64> {
        self.indicators.clone()
    }

    fn decay(&mut self, factor: f64) -> f64 {
        command(Command::Decay(factor));
        let (mine, _) = self.mine();
        let works = mine.decay(factor);
        #[allow(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
        let mine = works.each_ref().map(|works| works.len() as f64);
        let counts = gather(&mine, &vec![2; ranks()]);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "they were counts"
        )]
        let counts: Vec<[usize; 2]> = counts
            .as_chunks::<2>()
            .0
            .iter()
            .map(|counts| counts.map(|count| count as usize))
            .collect();
        let lengths: Vec<usize> = counts.iter().map(|[a, b]| a + b).collect();
        let all = gather(&works.concat(), &lengths);
        let (mut offsets, mut bonds, mut rest) = (0.0, 0.0, &all[..]);
        for &[carried, bond_count] in &counts {
            let (these, others) = rest.split_at(carried);
            offsets = these.iter().fold(offsets, |sum, work| sum + work);
            let (these, others) = others.split_at(bond_count);
            bonds = these.iter().fold(bonds, |sum, work| sum + work);
            rest = others;
        }
        self.carried = counts;
        offsets + bonds
    }

    fn decay_works(&self) -> [f64; 2] {
        self.works
    }
}

fn encoded<T: serde::Serialize>(value: &T) -> Result<Vec<u8>, BodyProblem> {
    postcard::to_stdvec(value).map_err(|_| BodyProblem::Damaged("messages to a rank"))
}
