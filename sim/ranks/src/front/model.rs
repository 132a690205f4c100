//! The body's model and state, as the world asks for them.

use std::time::Instant;

use glam::{DMat3, DVec3};
use phyxel::{Body, BodyProblem, BodyShares};
use phyxel_elastic::StiffNode;
use phyxel_integrate::{Eigenvalue, EigenvalueError, EigenvalueSettings, Motion, State};

use super::Front;
use crate::command::Command;
use crate::estimate::{GRADIENT, STIFF, stiffest_of, whole};
use crate::layout::Layout;
use crate::memory::moving_mut;
use crate::package::{Change, Models, packages};
use crate::share::Share;
use crate::traffic::{CHANGES, MODELS, STATES};
use crate::wire::{
    FRONT, all_fine, broadcast, gather, gather_kinds, ranks, received_vectors, send, send_vectors,
    vectors,
};

impl BodyShares for Front {
    fn set_model(&mut self, body: &Body, watched: &[u32]) -> Result<(), BodyProblem> {
        let begun = Instant::now();
        let layout = Layout::new(body.rest.len(), ranks());
        let mut mine = None;
        self.wake();
        Command::RankModel.give();
        let (packages, locals) = packages(&layout, body, watched);
        let models = Models::new(body);
        for (rank, (package, locals)) in packages.into_iter().zip(&locals).enumerate() {
            let model = models.of(locals);
            if rank == FRONT {
                mine = Some(Share::new(package, &model));
            } else {
                let bytes = encoded(&(package, model))?;
                send(rank, &bytes);
                self.traffic[MODELS].bytes += bytes.len();
            }
        }
        self.watch(&layout, watched);
        self.locals = locals;
        self.settings = Some(*body.elastic().settings());
        self.layout = Some(layout);
        let built = mine.transpose();
        let fine = all_fine(built.is_ok());
        self.mine = built?;
        self.traffic[MODELS].add(begun);
        fine_rows(fine)
    }

    fn change_model(
        &mut self,
        body: &Body,
        changed: &[u32],
        watched: &[u32],
    ) -> Result<(), BodyProblem> {
        let Some(layout) = self.layout.clone() else {
            return Ok(());
        };
        if self.settings != Some(body.of_model(|elastic| *elastic.settings())) {
            self.set_model(body, watched)?;
            return self.set_state(body.motion());
        }
        let begun = Instant::now();
        Command::Change(!changed.is_empty()).give();
        let others = (watched != self.watched).then_some(watched);
        let mut made = Ok(());
        for (rank, locals) in self.locals.iter().enumerate() {
            let change = Change::new(locals, body, changed, others);
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
        let fine = all_fine(made.is_ok());
        made?;
        fine_rows(fine)?;
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
        Command::State.give();
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
        Command::Decay(factor).give();
        let (mine, _) = self.mine();
        let works = mine.decay(factor);
        let mine = works.each_ref().map(|works| works.len() as f64);
        let counts = gather(&mine, &vec![2; ranks()]);
        let counts: Vec<[usize; 2]> = counts
            .as_chunks::<2>()
            .0
            .iter()
            .map(|counts| counts.map(|count| count as usize))
            .collect();
        let [offsets, bonds] = gather_kinds(&works.concat(), &counts)
            .map(|works| works.iter().fold(0.0, |sum, work| sum + work));
        self.carried = counts;
        offsets + bonds
    }

    fn decay_works(&self) -> [f64; 2] {
        self.works
    }

    fn estimate(&mut self, settings: &EigenvalueSettings) -> Result<Eigenvalue, EigenvalueError> {
        Command::Estimate(*settings).give();
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
        Command::SetVector.give();
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
        Command::Vector.give();
        let mut vector = self.memory.vector.clone();
        for rank in FRONT + 1..ranks() {
            vector.extend(received_vectors(rank));
        }
        vector
    }

    fn stiffest_nodes(&mut self, count: usize, runs: Option<&[usize]>) -> Vec<StiffNode> {
        Command::Stiffest(count, runs.map(<[usize]>::len)).give();
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
        Command::Read(gradients.len(), positions.len()).give();
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
        let of_rank = |rank| {
            [
                GRADIENT * among(gradients, rank),
                3 * among(positions, rank),
            ]
        };
        let counts: Vec<[usize; 2]> = (0..ranks()).map(of_rank).collect();
        let [found, places] = gather_kinds(&told, &counts);
        let found = found.as_chunks().0.iter().map(DMat3::from_cols_array);
        (found.collect(), vectors(&places).to_vec())
    }

    fn keep(&mut self, velocities: &[DVec3]) {
        Command::Keep.give();
        self.tell_velocities(velocities);
        if let Some(mine) = &self.mine {
            self.memory.keep(mine.motion.state());
        }
    }

    fn kept(&mut self, state: &mut State, vector: &mut Vec<DVec3>) {
        Command::Kept.give();
        let mut lists: Vec<&mut Vec<DVec3>> = moving_mut(state).into_iter().collect();
        lists.push(vector);
        for (list, mine) in lists.iter_mut().zip(self.memory.kept()) {
            list.clone_from(mine);
        }
        for rank in FRONT + 1..ranks() {
            for list in &mut lists {
                list.extend(received_vectors(rank));
            }
        }
    }
}

fn fine_rows(fine: bool) -> Result<(), BodyProblem> {
    let damaged = BodyProblem::Damaged("rows of a rank");
    if fine { Ok(()) } else { Err(damaged) }
}

fn encoded<T: serde::Serialize>(value: &T) -> Result<Vec<u8>, BodyProblem> {
    postcard::to_stdvec(value).map_err(|_| BodyProblem::Damaged("messages to a rank"))
}
