//! Rank 0's view of all ranks: what its world takes for the shares of the body.

use std::time::Instant;

use glam::{DMat3, DVec3};
use phyxel::world::{BodyProblem, BodyShares, Member};
use phyxel_elastic::{Frame, StiffNode, WATCHED_NODES};
use phyxel_integrate::{
    Eigenvalue, EigenvalueError, EigenvalueSettings, Motion, Pass, PassSums, SHARED_NODES, Shares,
    State,
};

use crate::command::Command;
use crate::estimate::{GRADIENT, STIFF, stiffest_of, whole};
use crate::layout::Layout;
use crate::memory::Memory;
use crate::package::{Change, Locals, packages};
use crate::share::{Share, told};
use crate::traffic::{CHANGES, FETCHED, MODELS, STATES, Traffic};
use crate::wire::{
    FRONT, Wire, broadcast, gather, ranks, receive_vectors, received_vectors, send, send_vectors,
    vectors, wake,
};
use crate::worker::{Counted, write_nodes};

/// The shares of a body on all ranks.
#[derive(Debug, Default)]
pub(crate) struct Front {
    wire: Wire,
    /// Whether the other ranks have been told that the body is built.
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

    /// Gives all ranks the velocities (m/s) of watched nodes: after a step a rank has of a driven node's only what is
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

    /// Notes who is watched.
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

    /// Ends all ranks; what they counted, and what went between them and rank 0 besides steps.
    pub(crate) fn end(&mut self) -> (Vec<Counted>, [Traffic; Traffic::KINDS]) {
        self.wake();
        command(Command::End);
        let mine = Counted::of(self.mine.as_ref(), &self.memory, &self.wire);
        let all = gather(&mine.encode(), &vec![Counted::LENGTH; ranks()]);
        let (all, _) = all.as_chunks();
        let counted = all.iter().map(|numbers| Counted::decode(*numbers));
        (counted.collect(), self.traffic)
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
        let begun = Instant::now();
        command(Command::Fetch);
        self.tell_velocities(&state.velocities);
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
                    self.traffic[FETCHED].bytes += size_of_val(to);
                }
            }
        }
        self.traffic[FETCHED].add(begun);
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
        let begun = Instant::now();
        let layout = Layout::new(member.body.rest.len(), ranks());
        let mut mine = None;
        self.wake();
        command(Command::Model);
        let (packages, locals) = packages(&layout, member, watched);
        for (rank, package) in packages.into_iter().enumerate() {
            if rank == FRONT {
                mine = Some(package);
            } else {
                let bytes = encoded(&package)?;
                send(rank, &bytes);
                self.traffic[MODELS].bytes += bytes.len();
            }
        }
        self.watch(&layout, watched);
        self.locals = locals;
        self.frame = Some(member.body.elastic.frame());
        self.layout = Some(layout);
        let built = mine.map(Share::new).transpose();
        let fine = gather(&[f64::from(u8::from(built.is_ok()))], &vec![1; ranks()]);
        self.mine = built?;
        self.traffic[MODELS].add(begun);
        all_fine(&fine)
    }

    fn change_model(
        &mut self,
        member: &Member,
        changed: &[u32],
        watched: &[u32],
    ) -> Result<(), BodyProblem> {
        let Some(layout) = self.layout.clone() else {
            return Ok(());
        };
        if self.frame != Some(member.body.elastic.frame()) {
            self.set_model(member, watched)?;
            return self.set_state(&member.body.motion);
        }
        let begun = Instant::now();
        command(Command::Change(!changed.is_empty()));
        let others = (watched != self.watched).then_some(watched);
        let mut made = Ok(());
        for (rank, locals) in self.locals.iter().enumerate() {
            let change = Change::new(locals, member, changed, others);
            if rank == FRONT {
                let mine = self.mine.as_mut();
                made = mine.map_or(Ok(()), |mine| mine.change(change));
            } else {
                let bytes = encoded(&change)?;
                send(rank, &bytes);
                self.traffic[CHANGES].bytes += bytes.len();
            }
        }
        self.watch(&layout, watched);
        let fine = gather(&[f64::from(u8::from(made.is_ok()))], &vec![1; ranks()]);
        made?;
        all_fine(&fine)?;
        self.traffic[CHANGES].add(begun);
        if !changed.is_empty() {
            let (mine, wire) = self.mine();
            mine.evaluate_again(wire)?;
        }
        Ok(())
    }

    fn set_state(&mut self, motion: &Motion) -> Result<(), BodyProblem> {
        let Some(layout) = self.layout.clone() else {
            return Ok(());
        };
        let begun = Instant::now();
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
            let viscosity = motion.settings().viscosity;
            if rank == FRONT {
                let (mine, _) = self.mine();
                mine.set_state(state, loads, viscosity)?;
            } else {
                let bytes = encoded(&(state, loads, viscosity))?;
                send(rank, &bytes);
                self.traffic[STATES].bytes += bytes.len();
            }
        }
        self.traffic[STATES].add(begun);
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

    fn estimate(&mut self, settings: &EigenvalueSettings) -> Result<Eigenvalue, EigenvalueError> {
        command(Command::Estimate(*settings));
        let mut vector = std::mem::take(&mut self.memory.vector);
        let (mine, wire) = self.mine();
        let found = mine.estimate(wire, settings, &mut vector);
        let bad = found.as_ref().err().map(|error| mine.bad_node(error));
        self.memory.vector = vector;
        if let Some(bad) = bad {
            let nodes = gather(&[bad], &vec![1; ranks()]);
            let first = nodes.into_iter().fold(f64::INFINITY, f64::min);
            // Without such a node anywhere it was the sum that left the range of numbers.
            let node = if first.is_finite() { whole(first) } else { 0 };
            return Err(EigenvalueError::NotFinite { node });
        }
        found
    }

    fn set_vector(&mut self, vector: &[DVec3]) {
        let Some(layout) = &self.layout else {
            return;
        };
        command(Command::SetVector);
        for rank in 0..layout.ranks() {
            let part = vector.get(layout.range(rank)).unwrap_or_default();
            if rank == FRONT {
                self.memory.vector = part.to_vec();
            } else {
                send_vectors(rank, part);
            }
        }
    }

    fn vector(&mut self) -> Vec<DVec3> {
        command(Command::Vector);
        let mut vector = self.memory.vector.clone();
        for rank in FRONT + 1..ranks() {
            vector.extend(received_vectors(rank));
        }
        vector
    }

    fn stiffest_nodes(&mut self, count: usize, runs: Option<&[usize]>) -> Vec<StiffNode> {
        command(Command::Stiffest(count, runs.map(<[usize]>::len)));
        #[allow(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
        let mut list: Vec<f64> = (runs.unwrap_or_default().iter())
            .map(|run| *run as f64)
            .collect();
        broadcast(&mut list);
        let (mine, wire) = self.mine();
        let told = mine.stiffest(wire, count, runs.map(|_| &list[..]));
        let all = gather(&told, &vec![STIFF * count; ranks()]);
        stiffest_of(&all, count)
    }

    fn read(&mut self, gradients: &[u32], positions: &[u32]) -> (Vec<DMat3>, Vec<DVec3>) {
        command(Command::Read(gradients.len(), positions.len()));
        let nodes = gradients.iter().chain(positions);
        let mut nodes: Vec<f64> = nodes.map(|node| f64::from(*node)).collect();
        broadcast(&mut nodes);
        let (mine, wire) = self.mine();
        let told = mine.read(wire, &nodes, gradients.len());
        let among = |nodes: &[u32], rank: usize| {
            let layout = self.layout.as_ref();
            let own = layout.map_or(0..0, |layout| layout.range(rank));
            let before = |end: usize| nodes.partition_point(|node| (*node as usize) < end);
            before(own.end) - before(own.start)
        };
        let counts: Vec<[usize; 2]> = (0..ranks())
            .map(|rank| [among(gradients, rank), among(positions, rank)])
            .collect();
        let lengths = counts.iter().map(|[rows, ends]| GRADIENT * rows + 3 * ends);
        let all = gather(&told, &lengths.collect::<Vec<_>>());
        let (mut found, mut places, mut rest) = (Vec::new(), Vec::new(), &all[..]);
        for [rows, ends] in counts {
            let (these, others) = rest.split_at(GRADIENT * rows);
            found.extend(these.as_chunks().0.iter().map(DMat3::from_cols_array));
            let (these, others) = others.split_at(3 * ends);
            places.extend_from_slice(vectors(these));
            rest = others;
        }
        (found, places)
    }

    fn keep(&mut self, velocities: &[DVec3]) {
        command(Command::Keep);
        self.tell_velocities(velocities);
        if let Some(mine) = &self.mine {
            self.memory.keep(mine.motion.state());
        }
    }

    fn kept(&mut self, state: &mut State, vector: &mut Vec<DVec3>) {
        command(Command::Kept);
        let lists = [
            &mut state.positions,
            &mut state.velocities,
            &mut state.forces,
            &mut state.viscous,
            vector,
        ];
        let mut lists = lists.map(|list| {
            list.clear();
            list
        });
        for (list, mine) in lists.iter_mut().zip(self.memory.kept()) {
            list.extend_from_slice(mine);
        }
        for rank in FRONT + 1..ranks() {
            for list in &mut lists {
                list.extend(received_vectors(rank));
            }
        }
    }
}

/// Whether all ranks have said that they could do what they were told.
fn all_fine(said: &[f64]) -> Result<(), BodyProblem> {
    match said.iter().all(|fine| *fine > 0.0) {
        true => Ok(()),
        false => Err(BodyProblem::Damaged("rows of a rank")),
    }
}

fn encoded<T: serde::Serialize>(value: &T) -> Result<Vec<u8>, BodyProblem> {
    postcard::to_stdvec(value).map_err(|_| BodyProblem::Damaged("messages to a rank"))
}
