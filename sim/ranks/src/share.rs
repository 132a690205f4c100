//! A rank's nodes in motion.

use std::ops::Range;
use std::time::{Duration, Instant};

use glam::DVec3;
use phyxel::BodyProblem;
use phyxel_elastic::{Elastic, WATCHED_NODES};
use phyxel_integrate::{Motion, Pass, State};

use crate::package::{Change, Package, RankModel};
use crate::wire::{Wire, flat, vectors};

/// A rank's nodes: their motion, and the model with what lies around them.
#[derive(Debug)]
pub(crate) struct Share {
    pub(crate) motion: Motion,
    pub(crate) elastic: Elastic,
    pub(crate) package: Package,
    /// Places (m) of and forces (N) on all local nodes.
    places: Vec<DVec3>,
    forces: Vec<DVec3>,
    own: Range<usize>,
    /// Forces from outside (N) on own nodes; empty without any.
    applied: Vec<DVec3>,
    /// Offsets and bonds of own nodes whose works the last decay has reported, if it was in this step.
    pub(crate) carried: [usize; 2],
    /// Whether forces were evaluated where the nodes are.
    evaluated: bool,
    /// Time in the force law.
    pub(crate) in_forces: Duration,
    /// Time in estimates of the largest eigenvalue, exchanges included.
    pub(crate) in_estimates: Duration,
}

impl Share {
    pub(crate) fn new(package: Package, model: &RankModel) -> Result<Self, BodyProblem> {
        let (motion, elastic) = (model.motion(&package)?, model.elastic(&package)?);
        let n = package.rest.len();
        let own = package.first..package.first + package.count;
        Ok(Self {
            motion,
            elastic,
            places: package.rest.clone(),
            forces: vec![DVec3::ZERO; n],
            own,
            applied: Vec::new(),
            carried: [0; 2],
            evaluated: false,
            in_forces: Duration::ZERO,
            in_estimates: Duration::ZERO,
            package,
        })
    }

    /// Heap bytes held.
    pub(crate) fn bytes(&self) -> usize {
        let motion = self.motion.bytes();
        self.elastic.bytes().all
            + motion.state
            + motion.supports
            + motion.loads
            + motion.viscous
            + motion.applied
            + size_of_val(&*self.places)
            + size_of_val(&*self.forces)
            + self.package.bytes()
    }

    /// Nodes of other ranks.
    pub(crate) fn ghosts(&self) -> usize {
        let receives = self.package.receives.iter();
        receives.map(|(_, _, count)| count).sum()
    }

    pub(crate) fn set_state(
        &mut self,
        state: State,
        loads: &[DVec3],
        viscosity: f64,
    ) -> Result<(), BodyProblem> {
        self.motion.set_viscosity(viscosity)?;
        self.motion.set_loads(loads)?;
        self.motion.restore(state);
        self.applied.clear();
        self.evaluated = false;
        Ok(())
    }

    /// Adopts what a cut changed.
    pub(crate) fn change(&mut self, change: Change) -> Result<(), BodyProblem> {
        change.apply(&mut self.elastic, &mut self.package)
    }

    /// Evaluates the forces after that, where the nodes are.
    pub(crate) fn evaluate_again(&mut self, wire: &mut Wire) -> Result<(), BodyProblem> {
        self.evaluate(wire);
        let own = &self.forces[self.own.clone()];
        self.motion.refresh(|_, forces| {
            forces.copy_from_slice(own);
            // Energies are the whole body's.
            0.0
        })?;
        Ok(())
    }

    pub(crate) fn begin(&mut self, pass: &Pass) {
        self.motion.begin_pass(pass);
    }

    /// Positions (m) of own nodes as they are read, where the forces were evaluated last: those of
    /// [`phyxel::Body::smoothed_positions`].
    pub(crate) fn smoothed_positions(&self) -> Vec<DVec3> {
        let own = self.own.clone();
        let mut smoothed = self.elastic.smoothed_positions(&self.places)[own.clone()].to_vec();
        let supports = self.motion.supports();
        supports.keep(&self.places[own], &mut smoothed);
        smoothed
    }

    /// Exchanges positions with the neighbours and evaluates the forces.
    pub(crate) fn evaluate(&mut self, wire: &mut Wire) {
        let Self {
            elastic,
            places,
            forces,
            ..
        } = self;
        places[self.own.clone()].copy_from_slice(self.motion.positions());
        wire.exchange(&self.package, places);
        let start = Instant::now();
        elastic.forces_into(places, forces);
        self.in_forces += start.elapsed();
        self.evaluated = true;
    }

    /// Evaluates the forces unless they are those where the nodes are; on all ranks at once.
    pub(crate) fn evaluate_if_due(&mut self, wire: &mut Wire) {
        if !self.evaluated {
            self.evaluate(wire);
        }
    }

    /// Takes the second pass and reports its sums.
    pub(crate) fn end(&mut self, pass: &Pass) -> Vec<f64> {
        let forces = &self.forces[self.own.clone()];
        let sums = self.motion.end_pass(pass, forces, &self.applied);
        let runs = self.own.start / WATCHED_NODES..self.own.end.div_ceil(WATCHED_NODES);
        let indicators: Vec<f64> = self.elastic.stiffness_indicators().collect();
        let mut told: Vec<f64> = sums.iter().flat_map(|sums| sums.0).collect();
        let (energies, bonds) = self.elastic.energies();
        told.extend_from_slice(&energies[runs.clone()]);
        told.extend_from_slice(&indicators[runs]);
        told.push(self.elastic.smallest_volume_ratio());
        if std::mem::take(&mut self.carried) != [0; 2] {
            let works = self.elastic.decay_works().clone();
            for works in [works.offsets, works.bonds, bonds] {
                told.extend(self.of_own(&works));
            }
        }
        told
    }

    /// What is reported of own nodes.
    fn of_own(&self, all: &[(u32, f64)]) -> Vec<f64> {
        let own = all
            .iter()
            .filter(|(node, _)| self.own.contains(&(*node as usize)));
        own.map(|(_, value)| *value).collect()
    }

    /// Lets offsets and bonds decay; the works (J) of own ones.
    pub(crate) fn decay(&mut self, factor: f64) -> [Vec<f64>; 2] {
        let works = self.elastic.decay(factor, &self.places).clone();
        let works = [self.of_own(&works.offsets), self.of_own(&works.bonds)];
        self.carried = [works[0].len(), works[1].len()];
        works
    }

    /// Sets velocities (m/s), or positions (m), of monitored nodes as rank 0 has them.
    pub(crate) fn set_watched(&mut self, of_all: &[f64], places: bool) {
        let (positions, velocities) = self.motion.places_mut();
        let to = if places { positions } else { velocities };
        for &(node, place) in &self.package.watched {
            to[node as usize] = vectors(of_all)[place as usize];
        }
    }

    /// As [`Share::end`], with forces from outside (N) on monitored nodes, if the first number says that there are
    /// any; reports the velocities and viscous forces of monitored nodes as well.
    pub(crate) fn end_watched(&mut self, pass: &Pass, of_all: &[f64]) -> Vec<f64> {
        self.applied.clear();
        if let [acts, forces @ ..] = of_all
            && *acts > 0.0
        {
            self.applied.resize(self.package.count, DVec3::ZERO);
            for &(node, place) in &self.package.watched {
                self.applied[node as usize] = vectors(forces)[place as usize];
            }
        }
        let mut told = self.end(pass);
        let state = self.motion.state();
        told.extend(self.watched(&[&state.velocities, &state.viscous]));
        told
    }

    /// A whole step in which nothing acts from outside; what [`Share::end`] reports.
    pub(crate) fn step(&mut self, pass: &Pass, wire: &mut Wire) -> Vec<f64> {
        self.applied.clear();
        self.begin(pass);
        self.evaluate(wire);
        self.end(pass)
    }

    /// Some vectors of watched own nodes, one list after the other.
    pub(crate) fn watched(&self, lists: &[&[DVec3]]) -> Vec<f64> {
        let nodes = || self.package.watched.iter();
        let of = |list: &&[DVec3]| {
            let get = |(node, _): &(u32, u32)| list.get(*node as usize).copied();
            let picked: Vec<DVec3> = nodes().map(|at| get(at).unwrap_or(DVec3::ZERO)).collect();
            picked
        };
        lists
            .iter()
            .flat_map(|list| flat(&of(list)).to_vec())
            .collect()
    }

    /// Internal forces (N) on own nodes, as last evaluated.
    pub(crate) fn own_forces(&self) -> &[DVec3] {
        &self.forces[self.own.clone()]
    }

    /// Local numbers of own nodes.
    pub(crate) fn own(&self) -> Range<usize> {
        self.own.clone()
    }
}
