//! The explicit step: its order, driven nodes, energy sums, divergence.

use crate::error::{Cause, StepError};
use crate::motion::{DrivenNode, ExplicitScheme, Motion};
use crate::shares::{Pass, PassSums, Shares};
use crate::sweep::{Before, Kick, PassInput, Sums};
use crate::view::{NodeForces, StepView};
use glam::DVec3;

/// A closure that adds forces from outside (N) on nodes, once a step; [`crate::RigidTool::press`] makes them.
pub type Applied<'a> = dyn FnMut(&StepView<'_>, &mut [DVec3]) + 'a;

/// Who takes the passes over nodes and evaluates forces.
enum Passes<'a> {
    /// The motion itself, with internal forces (N) and their energy (J) by a closure.
    Here(&'a mut dyn FnMut(&[DVec3], &mut [DVec3]) -> f64),
    /// Shares of the nodes.
    Shared(&'a mut dyn Shares),
}

/// The fewest equal steps of a span (s), none above `largest` (s); none if the span is not positive.
#[allow(
    clippy::cast_possible_truncation,
    reason = "checked to be a whole number between 0 and 2^53"
)]
fn step_count(span: f64, largest: f64) -> Result<u64, StepError> {
    let bad = largest.is_nan() || largest <= 0.0;
    // A step longer by round-off does not cost a step more.
    let count = (span / largest * (1.0 - 1e-12)).ceil().max(1.0);
    if bad || count >= 9e15 {
        return Err(StepError::BadStep { step: largest });
    }
    Ok(if span > 0.0 { count as u64 } else { 0 })
}

impl Motion {
    /// Takes one step of `step` seconds. `forces` writes internal forces (N) for positions (m) and
    /// returns the energy (J); the first step calls it twice.
    ///
    /// # Errors
    /// [`StepError`]; positions and velocities stay finite.
    pub fn step(
        &mut self,
        step: f64,
        mut forces: impl FnMut(&[DVec3], &mut [DVec3]) -> f64,
    ) -> Result<(), StepError> {
        let end = self.state.time + step;
        self.one_step(step, end, &mut Passes::Here(&mut forces), None)
    }

    /// As [`Motion::step`], with forces from outside as well, whose work is audited.
    ///
    /// # Errors
    /// [`StepError`]; positions and velocities stay finite.
    pub fn step_with(
        &mut self,
        step: f64,
        mut forces: impl FnMut(&[DVec3], &mut [DVec3]) -> f64,
        applied: &mut Applied<'_>,
    ) -> Result<(), StepError> {
        let end = self.state.time + step;
        self.one_step(step, end, &mut Passes::Here(&mut forces), Some(applied))
    }

    /// As [`Motion::step`], with forces from outside as well if there are any, where the nodes are with
    /// `shares`. Vectors of the state are then current for monitored nodes alone, until [`Motion::fetch`].
    ///
    /// # Errors
    /// [`StepError`]; the state is then good for nothing but [`Motion::restore`].
    ///
    /// # Panics
    /// If forces were never evaluated: see [`Motion::refresh`].
    #[doc(hidden)]
    pub fn step_shared(
        &mut self,
        step: f64,
        shares: &mut dyn Shares,
        applied: Option<&mut Applied<'_>>,
    ) -> Result<(), StepError> {
        assert!(
            self.nodes.masses.is_empty() || !self.state.forces.is_empty(),
            "forces to begin with"
        );
        let end = self.state.time + step;
        self.one_step(step, end, &mut Passes::Shared(shares), applied)
    }

    /// Takes the fewest equal steps, none above `largest` (s), that end at the time `end` (s) exactly.
    /// Does nothing if `end` is not after the present.
    ///
    /// # Errors
    /// [`StepError`]; positions and velocities stay finite.
    pub fn advance_to(
        &mut self,
        end: f64,
        largest: f64,
        mut forces: impl FnMut(&[DVec3], &mut [DVec3]) -> f64,
    ) -> Result<(), StepError> {
        self.equal_steps(end, largest, &mut forces, None)
    }

    /// As [`Motion::advance_to`], with forces from outside as well.
    ///
    /// # Errors
    /// [`StepError`]; positions and velocities stay finite.
    pub fn advance_with(
        &mut self,
        end: f64,
        largest: f64,
        mut forces: impl FnMut(&[DVec3], &mut [DVec3]) -> f64,
        applied: &mut Applied<'_>,
    ) -> Result<(), StepError> {
        self.equal_steps(end, largest, &mut forces, Some(applied))
    }

    fn equal_steps(
        &mut self,
        end: f64,
        largest: f64,
        forces: &mut dyn FnMut(&[DVec3], &mut [DVec3]) -> f64,
        mut applied: Option<&mut Applied<'_>>,
    ) -> Result<(), StepError> {
        let start = self.state.time;
        let count = step_count(end - start, largest)?;
        for done in 1..=count {
            let reached = if done == count {
                end
            } else {
                start + (end - start) * (done as f64 / count as f64)
            };
            let step = (end - start) / count as f64;
            let (passes, applied) = (&mut Passes::Here(forces), applied.as_deref_mut());
            self.one_step(step, reached, passes, applied)?;
        }
        Ok(())
    }

    /// Evaluates the forces again where the nodes are, after the force law changed (a cut), records the
    /// jump of its energy and returns it (J). The slice that `forces` writes holds the forces of before.
    ///
    /// # Errors
    /// [`StepError::ForceNotFinite`].
    pub fn refresh(
        &mut self,
        mut forces: impl FnMut(&[DVec3], &mut [DVec3]) -> f64,
    ) -> Result<f64, StepError> {
        if self.state.forces.is_empty() {
            self.evaluate_first(&mut forces)?;
            return Ok(0.0);
        }
        self.next_forces.clone_from(&self.state.forces);
        let energy = forces(&self.state.positions, &mut self.next_forces);
        self.check_forces(energy)?;
        std::mem::swap(&mut self.state.forces, &mut self.next_forces);
        let jump = energy - self.state.audit.elastic;
        self.state.audit.elastic = energy;
        self.correct_energy(jump);
        self.find_lag();
        Ok(jump)
    }

    /// Finds the lag again after what acts on nodes changed between two steps; before the first there is none.
    pub(crate) fn find_lag(&mut self) {
        if self.state.step > 0.0 && !self.state.forces.is_empty() {
            self.state.lag = self.lag();
        }
    }

    /// [`crate::State::lag`] (J) of the last step and the forces as they are.
    fn lag(&self) -> f64 {
        let half = 0.5 * self.state.step;
        let masses = self.nodes.masses.iter().enumerate();
        let sum = masses.map(|(node, mass)| {
            let force = self.total_force(node);
            let support = self.nodes.supports.of(node);
            let force = support.map_or(force, |support| support.free * force);
            self.lag_of(*mass, self.state.velocities[node], force * (half / mass))
        });
        sum.sum()
    }

    /// The lag (J) of a mass (kg) with its velocity (m/s) and what it gains in half a step (m/s).
    pub(crate) fn lag_of(&self, mass: f64, velocity: DVec3, gained: DVec3) -> f64 {
        match self.settings.scheme {
            ExplicitScheme::VelocityVerlet => 0.5 * mass * gained.length_squared(),
            ExplicitScheme::SymplecticEuler => -mass * velocity.dot(gained),
        }
    }

    fn evaluate_first(
        &mut self,
        forces: &mut dyn FnMut(&[DVec3], &mut [DVec3]) -> f64,
    ) -> Result<(), StepError> {
        let energy = forces(&self.state.positions, &mut self.next_forces);
        self.check_forces(energy)?;
        self.state.forces.clone_from(&self.next_forces);
        self.state.audit.elastic = energy;
        self.state.audit.initial += energy;
        Ok(())
    }

    fn check_forces(&self, energy: f64) -> Result<(), StepError> {
        let bad = self.next_forces.iter().position(|f| !f.is_finite());
        let bad = bad.or_else(|| (!energy.is_finite()).then_some(0));
        match bad {
            Some(node) => Err(StepError::ForceNotFinite {
                node,
                time: self.state.time,
                cause: Cause::BrokenForceLaw,
            }),
            None => Ok(()),
        }
    }

    fn one_step(
        &mut self,
        step: f64,
        end: f64,
        passes: &mut Passes<'_>,
        applied: Option<&mut Applied<'_>>,
    ) -> Result<(), StepError> {
        if !(step.is_finite() && step > 0.0) {
            return Err(StepError::BadStep { step });
        }
        if let (Passes::Here(forces), true) = (&mut *passes, self.state.forces.is_empty()) {
            self.evaluate_first(forces)?;
        }
        if self.state.step == 0.0 {
            self.state.step = step;
            self.state.lag = self.lag();
        }
        // Where rigid motions are spared, damping acts after the kicks, and for itself.
        let relative = self.has_free_pieces();
        let damping = if relative { 0.0 } else { self.settings.damping };
        // Time of the first kick, of the second, and what damping leaves in each.
        let (first, second) = match self.settings.scheme {
            ExplicitScheme::VelocityVerlet => {
                let half = (0.5 * step, (-0.5 * damping * step).exp());
                (half, half)
            }
            ExplicitScheme::SymplecticEuler => ((step, (-damping * step).exp()), (0.0, 1.0)),
        };
        let pass = Pass {
            step,
            first: [first.0, first.1],
            second: [second.0, second.1],
        };
        let mut dissipated = self.release_driven() * (1.0 - first.1 * first.1);
        let mut energy = 0.0;
        match passes {
            Passes::Here(forces) => {
                self.begin_pass(&pass);
                self.place_driven(end);
                energy = forces(&self.state.positions, &mut self.next_forces);
            }
            Passes::Shared(shares) => {
                shares.begin(&pass, &mut self.state);
                self.place_driven(end);
                shares.evaluate(&mut self.state, &mut self.next_forces);
            }
        }
        self.ask_outside(applied, step, end);
        let (time, decay) = second;
        let chunks = match passes {
            Passes::Here(_) => self.finish(Kick { time, decay, step }),
            Passes::Shared(shares) => {
                self.make_room_for_viscous();
                let (applied, viscous) = (&self.next_applied, &mut self.next_viscous);
                let (found, chunks) = shares.end(&pass, applied, &mut self.state, viscous);
                energy = found;
                chunks.iter().map(PassSums::sums).collect()
            }
        };
        let sums = chunks.into_iter().fold(Sums::default(), Sums::add);
        if sums.bad || !energy.is_finite() {
            return Err(self.not_finite(step, end));
        }
        dissipated += sums.dissipated;
        self.take_forces();
        let s = &mut self.state;
        s.time = end;
        s.steps += 1;
        s.audit.dissipated += dissipated;
        self.book(&sums, energy, step, first.1);
        if relative {
            if let Passes::Shared(shares) = passes {
                shares.fetch(&mut self.state);
            }
            self.spare_rigid_motions(step, second.0);
            if let Passes::Shared(shares) = passes {
                shares.store(&self.state);
            }
        }
        self.finish_driven(end);
        self.judge(
            step,
            match passes {
                Passes::Here(_) => None,
                Passes::Shared(shares) => Some(&mut **shares),
            },
        )
    }

    /// Asks for the forces from outside that act at the end of a step (s), at a time (s).
    fn ask_outside(&mut self, applied: Option<&mut Applied<'_>>, step: f64, time: f64) {
        self.next_applied.clear();
        if let Some(applied) = applied {
            self.next_applied
                .resize(self.nodes.masses.len(), DVec3::ZERO);
            let view = StepView {
                time,
                step,
                positions: &self.state.positions,
                velocities: &self.state.velocities,
                acting: NodeForces {
                    nodes: &self.nodes,
                    gravity: self.settings.gravity,
                    forces: &self.next_forces,
                    before: &self.state.forces,
                    viscosity: self.settings.viscosity / step,
                },
            };
            applied(&view, &mut self.next_applied);
        }
    }

    /// Takes energies and sums after a step (s) into the audit; `left` is what damping left in the first kick.
    fn book(&mut self, sums: &Sums, energy: f64, step: f64, left: f64) {
        let s = &mut self.state;
        s.audit.kinetic = sums.kinetic;
        s.audit.momentum = sums.momentum;
        s.audit.elastic = energy;
        // Of this step's length, at its end and at its begin.
        let ratio = step / s.step;
        let before = match self.settings.scheme {
            ExplicitScheme::VelocityVerlet => ratio * ratio,
            ExplicitScheme::SymplecticEuler => ratio * left,
        };
        s.audit.staggered += sums.lag - s.lag * before;
        (s.lag, s.step) = (sums.lag, step);
        s.audit.applied_work += sums.applied;
        s.audit.load_work = s.load_origin - sums.potential;
    }

    /// Makes the new forces those of the state.
    pub(crate) fn take_forces(&mut self) {
        let (s, next) = (&mut self.state, &mut self.next_forces);
        std::mem::swap(&mut s.forces, next);
        std::mem::swap(&mut s.applied, &mut self.next_applied);
        std::mem::swap(&mut s.viscous, &mut self.next_viscous);
    }

    fn make_room_for_viscous(&mut self) {
        let viscous = self.settings.viscosity > 0.0;
        let count = if viscous { self.nodes.masses.len() } else { 0 };
        self.next_viscous.resize(count, DVec3::ZERO);
    }

    /// Damping of a step (s) whose last kick was of `time` (s), where pieces are free.
    fn spare_rigid_motions(&mut self, step: f64, time: f64) {
        let viscous = self.balance_viscous_forces(time);
        self.state.audit.kinetic += viscous;
        let damped = self.damp_relative(step);
        self.state.audit.dissipated += damped - viscous;
        if self.settings.scheme == ExplicitScheme::SymplecticEuler {
            self.find_lag();
        }
    }

    /// First pass over nodes, with the forces of the last evaluation.
    pub(crate) fn drift(&mut self, kick: Kick) {
        let s = &mut self.state;
        let sweep = PassInput {
            nodes: &self.nodes,
            gravity: self.settings.gravity,
            forces: &s.forces,
            applied: &s.applied,
        };
        sweep.drift(&s.viscous, kick, &mut s.positions, &mut s.velocities);
    }

    /// Second pass over nodes, with the new forces; the sums of chunks.
    pub(crate) fn finish(&mut self, kick: Kick) -> Vec<Sums> {
        self.make_room_for_viscous();
        let s = &mut self.state;
        let sweep = PassInput {
            nodes: &self.nodes,
            gravity: self.settings.gravity,
            forces: &self.next_forces,
            applied: &self.next_applied,
        };
        let before = Before {
            forces: &s.forces,
            applied: &s.applied,
            viscous: &s.viscous,
            viscosity: self.settings.viscosity / kick.step,
        };
        let (v, viscous) = (&mut s.velocities, &mut self.next_viscous);
        sweep.finish(before, kick, &s.positions, v, viscous)
    }

    /// Remembers driven nodes and takes the driven part out of their velocities; returns the kinetic
    /// energy (J) of what is left.
    fn release_driven(&mut self) -> f64 {
        self.driven.clear();
        let mut kinetic = self.state.audit.kinetic;
        if self.nodes.supports.paths().is_empty() {
            return kinetic;
        }
        for support in self.nodes.supports.entries() {
            if support.path.is_none() {
                continue;
            }
            let node = support.node as usize;
            let at = |v: &Vec<DVec3>| v.get(node).copied().unwrap_or_default();
            let velocity = self.state.velocities[node];
            let held = support.held(velocity);
            kinetic -= 0.5 * self.nodes.masses[node] * held.length_squared();
            self.driven.push(DrivenNode {
                support: *support,
                position: self.state.positions[node],
                velocity: held,
                force: self.total_force(node),
                applied: at(&self.state.applied),
                viscous: at(&self.state.viscous),
            });
            self.state.velocities[node] = support.free * velocity;
        }
        kinetic
    }

    fn place_driven(&mut self, time: f64) {
        if !self.driven.is_empty() {
            self.nodes.supports.place(time, &mut self.state.positions);
        }
    }

    /// Gives driven nodes their path's velocity and adds up the work of their drive.
    fn finish_driven(&mut self, time: f64) {
        for driven in &self.driven {
            let support = &driven.support;
            let node = support.node as usize;
            let Some((_, velocity)) = self.nodes.supports.target(support, time) else {
                continue;
            };
            let mass = self.nodes.masses[node];
            let velocity = support.held(velocity);
            let moved = support.held(self.state.positions[node] - driven.position);
            let force = 0.5 * (driven.force + self.total_force(node));
            let mean = |before: DVec3, now: &Vec<DVec3>| {
                0.5 * (before + now.get(node).copied().unwrap_or_default()).dot(moved)
            };
            let s = &mut self.state;
            let kinetic = 0.5 * mass * velocity.length_squared();
            let before = 0.5 * mass * driven.velocity.length_squared();
            s.velocities[node] += velocity;
            s.audit.kinetic += kinetic;
            s.audit.momentum += velocity * mass;
            s.audit.support_work += kinetic - before - force.dot(moved);
            s.audit.applied_work += mean(driven.applied, &s.applied);
            s.audit.dissipated -= mean(driven.viscous, &s.viscous);
        }
    }

    fn not_finite(&self, step: f64, time: f64) -> StepError {
        let bad = |v: &[DVec3]| v.iter().position(|f| !f.is_finite());
        let outside = bad(&self.next_applied);
        let node = bad(&self.next_forces).or(outside).unwrap_or(0);
        let cause = match self.critical_step {
            Some(critical) if step > critical => Cause::StepTooLarge { step, critical },
            _ if outside.is_some() => Cause::ContactTooStiff,
            _ => Cause::BrokenForceLaw,
        };
        StepError::ForceNotFinite { node, time, cause }
    }
}

#[cfg(test)]
#[path = "explicit_tests.rs"]
mod tests;
