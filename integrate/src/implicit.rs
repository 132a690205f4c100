//! Implicit steps: backward Euler and Newmark's average acceleration.

use crate::audit::Audit;
use crate::contact::Contact;
use crate::contact::Pressed;
use crate::error::MotionError;
use crate::law::ForceLaw;
use crate::motion::Motion;
use crate::newton::{Newton, NewtonReport, NewtonSettings, Problem, SolveError};
use crate::tool::RigidTool;
use glam::DVec3;

/// Implicit scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ImplicitScheme {
    /// First order, damps what the step does not resolve (Aras 2014, eqs. (12)-(14), for the second
    /// order equation of motion).
    BackwardEuler,
    /// Newmark 1959 with β = 1/4, γ = 1/2 (average acceleration, trapezoidal rule): second order,
    /// no damping of its own.
    #[default]
    Newmark,
}

/// How to solve.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ImplicitSettings {
    /// Scheme.
    pub scheme: ImplicitScheme,
    /// Solver. Steps rarely need more than `tolerance = 1e-4`: the error of the scheme is larger.
    pub newton: NewtonSettings,
}

/// Implicit solver with its work arrays; moves a [`Motion`], so that explicit and implicit steps can
/// follow each other. Viscosity and forces applied from outside are for the explicit schemes; tools
/// press through [`Implicit::step_with`].
#[derive(Debug, Clone, Default)]
pub struct Implicit {
    settings: ImplicitSettings,
    newton: Newton,
    target: Vec<DVec3>,
    loads: Vec<DVec3>,
    start: Vec<DVec3>,
    prescribed: Vec<DVec3>,
    accelerations: Vec<DVec3>,
}

impl Implicit {
    /// A solver with these settings.
    ///
    /// # Errors
    /// [`MotionError::BadSetting`] if a tolerance is not positive and finite.
    pub fn new(settings: ImplicitSettings) -> Result<Self, MotionError> {
        let named = [
            ("tolerance", settings.newton.tolerance),
            ("linear_tolerance", settings.newton.linear_tolerance),
        ];
        for (name, value) in named {
            if !(value.is_finite() && value > 0.0) {
                return Err(MotionError::BadSetting { name, value });
            }
        }
        Ok(Self {
            settings,
            ..Self::default()
        })
    }

    /// Takes one step of `step` seconds.
    ///
    /// Solves `M a + damping · M v = f(x) + l` at the end of the step for the positions, with
    /// `v = (x − x0)/dt` and `a = (v − v0)/dt` for backward Euler, and `v = 2 (x − x0)/dt − v0`,
    /// `a = 2 (v − v0)/dt − a0` for Newmark. The audit's balance then shows what the scheme damps.
    ///
    /// # Errors
    /// [`SolveError`]; the motion is then as before the step.
    pub fn step(
        &mut self,
        motion: &mut Motion,
        step: f64,
        law: &mut dyn ForceLaw,
    ) -> Result<NewtonReport, SolveError> {
        if !(step.is_finite() && step > 0.0) {
            return Err(SolveError::BadStep { step });
        }
        let viscosity = motion.settings.viscosity;
        if viscosity > 0.0 {
            return Err(SolveError::Viscosity { viscosity });
        }
        if motion.state.forces.is_empty() {
            let refreshed = motion.refresh(|x, f| law.forces_into(x, f));
            if let Err(crate::error::StepError::ForceNotFinite { node, .. }) = refreshed {
                return Err(SolveError::NotFinite { node });
            }
        }
        let n = motion.node_count();
        let damping = motion.settings.damping;
        let newmark = self.settings.scheme == ImplicitScheme::Newmark;
        self.gather(motion);
        let inverse = step.recip();
        let c = if newmark {
            inverse * (4.0 * inverse + 2.0 * damping)
        } else {
            inverse * (inverse + damping)
        };
        // y such that M (c x - c y) = M (a + damping v).
        let state = &motion.state;
        self.target.clear();
        self.target.extend((0..n).map(|i| {
            let v = state.velocities[i];
            let past = if newmark {
                v * (4.0 * inverse + damping) + self.accelerations[i]
            } else {
                v * inverse
            };
            state.positions[i] + past / c
        }));
        let end = state.time + step;
        self.start.clone_from(&state.positions);
        let driven = self.prescribe(motion, end);
        let mut x = self.start.clone();
        let problem = Problem {
            supports: &motion.nodes.supports,
            loads: &self.loads,
            inertia: Some((c, &motion.nodes.masses, &self.target)),
        };
        let prescribed = driven.then_some(self.prescribed.as_slice());
        let settings = &self.settings.newton;
        let report = self
            .newton
            .solve(law, &problem, &mut x, prescribed, settings)?;
        motion.nodes.supports.place(end, &mut x);
        self.finish(motion, x, step, end, &report);
        Ok(report)
    }

    /// As [`Implicit::step`], with tools that press. They go to where their paths are at the end of the
    /// step and take over the contact's forces there; their work is audited. Friction acts with the
    /// limits of the step before, see [`Pressed`].
    ///
    /// # Errors
    /// [`SolveError`], among them [`SolveError::ForceDrivenTool`]; motion, tools and contacts are then
    /// as before the step.
    pub fn step_with(
        &mut self,
        motion: &mut Motion,
        step: f64,
        law: &mut dyn ForceLaw,
        tools: &mut [(&mut RigidTool, &mut Contact)],
    ) -> Result<NewtonReport, SolveError> {
        let end = motion.time() + step;
        let mut contacts = Vec::with_capacity(tools.len());
        for (index, (tool, contact)) in tools.iter_mut().enumerate() {
            let Some(pose) = tool.pose_at(end) else {
                return Err(SolveError::ForceDrivenTool { tool: index });
            };
            contacts.push((&mut **contact, tool.shape, pose));
        }
        let mut law = Pressed {
            law,
            contacts,
            tool_forces: Vec::new(),
        };
        let report = self.step(motion, step, &mut law)?;
        // The accepted state was the last one evaluated.
        let sums = law.tool_forces;
        for ((tool, contact), sum) in tools.iter_mut().zip(sums) {
            let (before, work) = (tool.pose, tool.contact_work);
            tool.follow(end);
            tool.take(sum, &before);
            contact.settle_friction(&tool.pose);
            motion.state.audit.applied_work -= tool.contact_work - work;
        }
        Ok(report)
    }

    /// Loads with gravity, and the accelerations at the start of the step.
    fn gather(&mut self, motion: &Motion) {
        let n = motion.node_count();
        let gravity = motion.settings.gravity;
        self.loads.clear();
        self.accelerations.clear();
        for i in 0..n {
            let load = motion.nodes.loads.get(i).copied().unwrap_or_default();
            let load = load + gravity * motion.nodes.masses[i];
            self.loads.push(load);
            let force = motion.state.forces[i] + load;
            let damping = motion.state.velocities[i] * motion.settings.damping;
            self.accelerations
                .push(force * motion.nodes.mobility.inverse[i] - damping);
        }
        motion.nodes.supports.project(&mut self.accelerations);
    }

    /// Motion of driven directions over the step; `false` if there is none.
    fn prescribe(&mut self, motion: &Motion, end: f64) -> bool {
        self.prescribed.clear();
        if motion.nodes.supports.paths().is_empty() {
            return false;
        }
        self.prescribed.extend_from_slice(&self.start);
        motion.nodes.supports.place(end, &mut self.prescribed);
        let mut driven = false;
        for (moved, start) in self.prescribed.iter_mut().zip(&self.start) {
            *moved -= *start;
            driven |= *moved != DVec3::ZERO;
        }
        driven
    }

    fn finish(
        &mut self,
        motion: &mut Motion,
        x: Vec<DVec3>,
        step: f64,
        end: f64,
        report: &NewtonReport,
    ) {
        let newmark = self.settings.scheme == ImplicitScheme::Newmark;
        let (before, damping) = (motion.state.audit, motion.settings.damping);
        let s = &mut motion.state;
        let mut audit = Audit {
            kinetic: 0.0,
            momentum: DVec3::ZERO,
            elastic: report.energy,
            ..before
        };
        // Work of supports: what inertia and all other forces take on held directions.
        for support in motion.nodes.supports.entries() {
            if support.path.is_none() {
                continue;
            }
            let i = support.node as usize;
            let (m, moved) = (motion.nodes.masses[i], x[i] - self.start[i]);
            let (_, velocity) = motion
                .nodes
                .supports
                .target(support, end)
                .unwrap_or((DVec3::ZERO, DVec3::ZERO));
            let (old, new) = (support.held(s.velocities[i]), support.held(velocity));
            let change = 0.5 * m * (new.length_squared() - old.length_squared());
            let force = 0.5 * (s.forces[i] + self.newton.forces[i]) + self.loads[i];
            audit.support_work += change - support.held(force).dot(moved);
        }
        for (i, x) in x.iter().enumerate() {
            let moved = *x - self.start[i];
            let old = s.velocities[i];
            let mean = moved / step;
            let mut v = if newmark { mean * 2.0 - old } else { mean };
            if let Some(support) = motion.nodes.supports.of(i) {
                let driven = motion.nodes.supports.target(support, end);
                let held = driven.map_or(DVec3::ZERO, |(_, v)| support.held(v));
                v = support.free * v + held;
            }
            s.velocities[i] = v;
            let m = motion.nodes.masses[i];
            audit.kinetic += 0.5 * m * v.length_squared();
            audit.momentum += v * m;
            let free = motion
                .nodes
                .supports
                .of(i)
                .map_or(mean, |support| support.free * mean);
            audit.dissipated += damping * m * free.length_squared() * step;
        }
        s.positions = x;
        s.forces.clone_from(&self.newton.forces);
        s.applied.clear();
        s.viscous.clear();
        s.time = end;
        s.steps += 1;
        s.frame = None;
        s.audit = audit;
        motion.state.audit.load_work = motion.state.load_origin - motion.load_potential();
    }
}

#[cfg(test)]
#[path = "implicit_tests.rs"]
mod tests;
