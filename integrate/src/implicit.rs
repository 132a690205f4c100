//! Implicit steps: backward Euler, and the energy–momentum method.

mod scheme;

use crate::audit::Audit;
use crate::contact::Limit;
use crate::contact::pressed::Pressed;
use crate::error::MotionError;
use crate::law::ForceLaw;
use crate::motion::Motion;
use crate::newton::{Newton, NewtonReport, NewtonSettings, Problem, SolveError, check};
use crate::pieces::{RigidField, all};
use crate::tool::RigidTool;
use crate::vector::{add_scaled, dot};
use crate::watch::LARGEST_BALANCE;
use glam::{DMat3, DVec3};
use scheme::SchemeLaw;

/// Implicit scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum ImplicitScheme {
    /// First order, damps what the step does not resolve (Aras 2014, eqs. (12)-(14), for the second
    /// order equation of motion).
    BackwardEuler,
    /// Midpoint rule with a discrete gradient of the energy (Gonzalez 1996, doi:10.1007/BF02440162):
    /// second order. Internal forces keep the sum of kinetic and elastic energy at any step and of any law,
    /// and the momenta of a body without supports. Contact acts with its forces at the end of the step,
    /// which give a body no energy against a tool that stands still.
    #[default]
    EnergyMomentum,
}

/// How to solve.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ImplicitSettings {
    /// Scheme.
    pub scheme: ImplicitScheme,
    /// Solver. What a step leaves unbalanced works on the body: scenes have a tolerance of 1e-6. A cut block that is
    /// shaken for 3 s has 8 % of its energy unexplained at 1e-4, 0.6 % at 1e-5 and 0.04 % at 1e-6, which takes 1.5 times as long.
    pub newton: NewtonSettings,
}

/// What a step took.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct ImplicitReport {
    /// Parts in which the step was taken; 1 if it was solved as a whole.
    pub parts: u32,
    /// Parts that were not solved, or gained energy, and were halved.
    pub rejected: u32,
    /// Newton iterations of accepted parts.
    pub iterations: usize,
    /// Tangent products of accepted parts.
    pub linear_iterations: usize,
    /// Force evaluations of accepted parts.
    pub evaluations: usize,
}

/// Smallest parts of a step that are tried, a power of two.
const PARTS: u32 = 256;

/// Corrections of the midpoint's forces at most; each lowers the energy's error by some orders.
const CORRECTIONS: usize = 12;

/// Energy's error at which corrections end, over the kinetic and the elastic energy.
const ENERGY_ERROR: f64 = 1e-10;

/// Implicit solver with its work arrays; moves a [`Motion`], so that explicit and implicit steps can
/// follow each other. Viscosity and forces applied from outside are for the explicit schemes; tools
/// press through [`Implicit::step_with`].
///
/// # Examples
/// ```
/// use phyxel_integrate::{BoundaryConditions, ClosureLaw, Implicit, ImplicitSettings, Motion, MotionSettings};
/// use phyxel_integrate::glam::DVec3;
///
/// // 2 kg on a spring of 50 N/m, in steps of a twelfth of the period.
/// let mut stiffness = 50.0;
/// let mut spring = ClosureLaw::of(
///     &mut stiffness,
///     |k, x, f| {
///         f[0] = -x[0] * *k;
///         0.5 * *k * x[0].length_squared()
///     },
///     |k, v, out| out[0] = v[0] * *k,
/// );
/// let free = BoundaryConditions::free(1);
/// let mut motion = Motion::new(&[DVec3::X * 0.1], &[2.0], free, MotionSettings::default())?;
/// let mut implicit = Implicit::new(ImplicitSettings::default())?;
/// for _ in 0..100 {
///     implicit.step(&mut motion, 0.1, &mut spring)?;
/// }
/// assert!(motion.audit().energy_error().abs() < 1e-6 * motion.audit().initial);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Implicit {
    settings: ImplicitSettings,
    newton: Newton,
    target: Vec<DVec3>,
    /// Gravity and constant loads.
    loads: Vec<DVec3>,
    /// Those and the correction of the midpoint's forces.
    acting: Vec<DVec3>,
    start: Vec<DVec3>,
    prescribed: Vec<DVec3>,
    /// Internal forces of the scheme.
    internal: Vec<DVec3>,
    /// Internal forces at the end.
    end: Vec<DVec3>,
    /// Contact's forces at the end; empty without tools.
    applied: Vec<DVec3>,
    middle: Vec<DVec3>,
}

/// The part of a step that is tried.
#[derive(Clone, Copy)]
struct Attempt {
    /// (s).
    step: f64,
    /// Its end (s).
    end: f64,
    /// Whether there is no smaller one: gained energy is accepted, and reported.
    smallest: bool,
}

/// What an attempt found.
struct Solved {
    x: Vec<DVec3>,
    /// Elastic energy (J) at the end.
    energy: f64,
    report: NewtonReport,
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

    /// Takes one step of `step` seconds: [`Implicit::step_with`] without tools.
    ///
    /// # Errors
    /// [`SolveError`]; the motion is then as before the step.
    pub fn step(
        &mut self,
        motion: &mut Motion,
        step: f64,
        law: &mut dyn ForceLaw,
    ) -> Result<ImplicitReport, SolveError> {
        self.step_with(motion, step, law, &mut [])
    }

    /// Takes one step of `step` seconds with tools that press.
    ///
    /// Solves `M a + damping · M v = f + l + f_c(x1)` for the positions `x1` at the end of the step. With
    /// `d = x1 − x0`, backward Euler has `v1 = v = d/dt`, `a = (v1 − v0)/dt` and `f = f(x1)`. The
    /// energy–momentum method has `v = d/dt = (v0 + v1)/2`, `a = (v1 − v0)/dt` and `f = f(m) + α M d'` with
    /// `m = (x0 + x1)/2`; `d'` is `d` without what supports hold, and without the rigid part of each piece that none holds, and
    /// `α` makes `f·d = E0 − E1`. It is found in turns with the positions, as it is small against `2/dt²`.
    ///
    /// Where pieces are free ([`Motion::set_pieces`]), damping acts after that, relative to their rigid motion, as in
    /// explicit steps.
    ///
    /// A part of the step that Newton does not solve, or that gains more than 5 % of the energy there is, is halved, down
    /// to 1/256 of the step. Driven nodes are at their paths' positions at the end of each part.
    ///
    /// Tools go to where their paths are at the end and adopt the contact's forces there; friction acts with the
    /// limits of the step before, see [`Pressed`].
    ///
    /// # Errors
    /// [`SolveError`], among them [`SolveError::ForceDrivenTool`]; motion and tools are then as before
    /// the step.
    pub fn step_with(
        &mut self,
        motion: &mut Motion,
        step: f64,
        law: &mut dyn ForceLaw,
        tools: &mut [&mut RigidTool],
    ) -> Result<ImplicitReport, SolveError> {
        if !(step.is_finite() && step > 0.0) {
            return Err(SolveError::BadStep { step });
        }
        let viscosity = motion.settings.viscosity;
        if viscosity > 0.0 {
            return Err(SolveError::Viscosity { viscosity });
        }
        if let Some(tool) = tools.iter().position(|tool| tool.is_released()) {
            return Err(SolveError::ForceDrivenTool { tool });
        }
        if motion.state.forces.is_empty() {
            motion.refresh(|x, f| law.forces_into(x, f))?;
        }
        let state = motion.state.clone();
        let kept: Vec<RigidTool> = tools.iter().map(|tool| (**tool).clone()).collect();
        let taken = self.take_parts(motion, step, law, tools);
        let taken = taken.and_then(|report| Ok(motion.judge(step, None).map(|()| report)?));
        if taken.is_err() {
            motion.state = state;
            for (tool, kept) in tools.iter_mut().zip(kept) {
                **tool = kept;
            }
        }
        taken
    }

    /// Takes the parts of a step one after the other; a failure leaves those before it taken.
    fn take_parts(
        &mut self,
        motion: &mut Motion,
        step: f64,
        law: &mut dyn ForceLaw,
        tools: &mut [&mut RigidTool],
    ) -> Result<ImplicitReport, SolveError> {
        let begin = motion.state.time;
        let mut report = ImplicitReport::default();
        // In smallest parts.
        let (mut done, mut part) = (0, PARTS);
        while done < PARTS {
            let size = |parts: u32| step * (f64::from(parts) / f64::from(PARTS));
            let attempt = Attempt {
                step: size(part),
                end: begin + size(done + part),
                smallest: part == 1,
            };
            match self.advance(motion, attempt, law, tools) {
                Ok(solved) => {
                    done += part;
                    report.parts += 1;
                    report.iterations += solved.residuals.len() - 1;
                    report.linear_iterations += solved.linear_iterations;
                    report.evaluations += solved.evaluations;
                    while done < PARTS && done.is_multiple_of(2 * part) {
                        part *= 2;
                    }
                }
                Err(_) if !attempt.smallest => {
                    report.rejected += 1;
                    part /= 2;
                }
                Err(error) => return Err(error.in_step(attempt.step, motion.state.time)),
            }
        }
        Ok(report)
    }

    /// Takes a part of a step; all is as before if that fails.
    fn advance(
        &mut self,
        motion: &mut Motion,
        attempt: Attempt,
        law: &mut dyn ForceLaw,
        tools: &mut [&mut RigidTool],
    ) -> Result<NewtonReport, SolveError> {
        let solved = self.solve(motion, attempt, law, tools)?;
        self.applied.clear();
        let mut loads = Vec::with_capacity(tools.len());
        if !tools.is_empty() {
            self.applied.resize(solved.x.len(), DVec3::ZERO);
            for tool in &mut *tools {
                let pose = tool.pose_at(attempt.end).unwrap_or(tool.pose);
                let (shape, x, limit) = (tool.shape, &solved.x, Some(Limit::Lagged));
                loads.push(
                    tool.contact
                        .add_all(&shape, &pose, x, &mut self.applied, limit),
                );
            }
        }
        let audit = self.audit(motion, attempt, &solved);
        let before = motion.state.audit;
        let gained = before.numerical - audit.numerical;
        let there = audit.kinetic.max(before.kinetic) + audit.elastic.max(before.elastic);
        if !attempt.smallest && gained > LARGEST_BALANCE * there {
            let (relative, node) = (gained / there, 0);
            return Err(SolveError::NoDescent { relative, node });
        }
        for (tool, load) in tools.iter_mut().zip(loads) {
            let before = tool.pose;
            tool.follow(attempt.end);
            tool.take(load, &before);
            let pose = tool.pose;
            tool.contact.settle_friction(&pose);
        }
        self.finish(motion, attempt, solved.x, audit);
        Ok(solved.report)
    }

    /// Positions at the end, with the forces of the scheme in `internal` and those at the end in `end`.
    fn solve(
        &mut self,
        motion: &Motion,
        attempt: Attempt,
        law: &mut dyn ForceLaw,
        tools: &mut [&mut RigidTool],
    ) -> Result<Solved, SolveError> {
        let middle = self.settings.scheme == ImplicitScheme::EnergyMomentum;
        let c = self.prepare(motion, attempt.step);
        let mut prescribed = self.prescribe(motion, attempt.end);
        let (supports, masses) = (&motion.nodes.supports, &motion.nodes.masses);
        let before = motion.state.audit;
        let mut x = self.start.clone();
        let mut all = NewtonReport::default();
        let mut corrections = 0;
        loop {
            let mut own = SchemeLaw {
                law: &mut *law,
                start: middle.then_some(&*self.start),
                middle: std::mem::take(&mut self.middle),
                forces: std::mem::take(&mut self.internal),
            };
            let poses = tools.iter_mut().map(|tool| {
                let pose = tool.pose_at(attempt.end).unwrap_or(tool.pose);
                (&mut tool.contact, tool.shape, pose)
            });
            let mut pressed = Pressed {
                law: &mut own,
                contacts: poses.collect(),
                tool_forces: Vec::new(),
            };
            let problem = Problem {
                supports,
                loads: &self.acting,
                inertia: Some((c, masses, &self.target)),
            };
            let moved = prescribed.then_some(self.prescribed.as_slice());
            let settings = &self.settings.newton;
            let report = self
                .newton
                .solve(&mut pressed, &problem, &mut x, moved, settings);
            (self.middle, self.internal) = (own.middle, own.forces);
            let report = report?;
            let mut touched = vec![false; motion.pieces.count];
            for node in tools.iter().flat_map(|tool| tool.contact.touched()) {
                if let Some(piece) = motion.pieces.of_node.get(node as usize) {
                    touched[*piece as usize] = true;
                }
            }
            self.balance(motion, c, &touched, &mut x);
            all.linear_iterations += report.linear_iterations;
            all.evaluations += report.evaluations + 1;
            all.residuals.extend(report.residuals);
            prescribed = false;
            supports.place(attempt.end, &mut x);
            self.end.resize(x.len(), DVec3::ZERO);
            let energy = law.forces_into(&x, &mut self.end);
            check(&self.end, energy)?;
            let solved = |x, report| Solved { x, energy, report };
            if !middle {
                self.internal.clone_from(&self.end);
                return Ok(solved(x, all));
            }
            // What the forces of the middle miss of the energy, what is left with the correction that acted, which was
            // made where the nodes were then, and what a unit of the next gives.
            let moved = self.moved(&x);
            let gap = before.elastic - energy - dot(&self.internal, &moved);
            let missed = gap + dot(&self.loads, &moved) - dot(&self.acting, &moved);
            let direction = self.deformation(motion, &x, &moved);
            let unit = dot(&direction, &moved);
            let there = before.kinetic + before.elastic.abs() + energy.abs();
            let enough = missed.abs() <= ENERGY_ERROR * there || unit <= 0.0;
            // Energy that is lost is accepted at last, energy that is gained is not.
            let ends = corrections >= CORRECTIONS && (missed >= 0.0 || attempt.smallest);
            let next = gap / unit;
            if enough || ends {
                // The correction as it acted, so that the forces are those that were solved for.
                add_scaled(&mut self.internal, 1.0, &self.acting);
                add_scaled(&mut self.internal, -1.0, &self.loads);
                return Ok(solved(x, all));
            }
            if corrections >= CORRECTIONS || next.abs() > 0.5 * c {
                let (relative, node) = (missed.abs() / there, 0);
                return Err(SolveError::NoDescent { relative, node });
            }
            corrections += 1;
            self.acting.clone_from(&self.loads);
            add_scaled(&mut self.acting, next, &direction);
        }
    }

    /// Loads, and what inertia draws the nodes to: `M (c x1 − c y) = M (a + damping v)`. Returns `c` (1/s²).
    fn prepare(&mut self, motion: &Motion, step: f64) -> f64 {
        let gravity = motion.settings.gravity;
        let masses = &motion.nodes.masses;
        self.loads.clear();
        self.loads.extend(masses.iter().map(|mass| gravity * *mass));
        if !motion.nodes.loads.is_empty() {
            add_scaled(&mut self.loads, 1.0, &motion.nodes.loads);
        }
        self.acting.clone_from(&self.loads);
        let rate = self.rate() / step;
        let c = (rate + damping_within(motion)) / step;
        let state = &motion.state;
        self.start.clone_from(&state.positions);
        self.target.clone_from(&state.positions);
        add_scaled(&mut self.target, rate / c, &state.velocities);
        c
    }

    /// `a dt² = rate (d − v0 dt)`.
    fn rate(&self) -> f64 {
        match self.settings.scheme {
            ImplicitScheme::BackwardEuler => 1.0,
            ImplicitScheme::EnergyMomentum => 2.0,
        }
    }

    /// Motion of driven directions until `end` (s); `false` if there is none.
    fn prescribe(&mut self, motion: &Motion, end: f64) -> bool {
        self.prescribed.clear();
        if motion.nodes.supports.paths().is_empty() {
            return false;
        }
        self.prescribed.extend_from_slice(&self.start);
        motion.nodes.supports.place(end, &mut self.prescribed);
        add_scaled(&mut self.prescribed, -1.0, &self.start);
        self.prescribed.iter().any(|moved| *moved != DVec3::ZERO)
    }

    /// `x − x0`.
    fn moved(&self, x: &[DVec3]) -> Vec<DVec3> {
        let pairs = x.iter().zip(&self.start);
        pairs.map(|(x, start)| *x - *start).collect()
    }

    /// Takes the net force and torque that Newton left on each piece named free by the piece's rigid motion, which strains
    /// nothing: linear momentum is kept to round-off, angular momentum to first order in the step's motion. Not done to
    /// pieces that are touched.
    fn balance(&self, motion: &Motion, c: f64, touched: &[bool], x: &mut [DVec3]) {
        let (masses, left) = (&motion.nodes.masses, self.newton.residual());
        let free = motion.pieces.free.iter();
        for (_, nodes) in free.filter(|(piece, _)| !touched[*piece as usize]) {
            let rigid = RigidField::with_moments_of(all(nodes), masses, x, |i| left[i]);
            for i in all(nodes) {
                x[i] += rigid.at(x[i]) / c;
            }
        }
    }

    /// Mass times the part of `moved` that the correction acts along: without what is held, and in what nothing
    /// holds without the rigid motion about the middle, so that it has no force and no torque there.
    fn deformation(&self, motion: &Motion, x: &[DVec3], moved: &[DVec3]) -> Vec<DVec3> {
        let (masses, supports) = (&motion.nodes.masses, &motion.nodes.supports);
        let weighted = |i: usize| moved[i] * masses[i];
        let mut direction: Vec<DVec3> = (0..moved.len()).map(weighted).collect();
        supports.project(&mut direction);
        let pairs = x.iter().zip(&self.start);
        let middle: Vec<DVec3> = pairs.map(|(x, start)| x.midpoint(*start)).collect();
        let mut spare = |nodes: &[u32]| {
            let rigid = RigidField::with_moments_of(all(nodes), masses, &middle, weighted);
            for i in all(nodes) {
                direction[i] -= rigid.at(middle[i]) * masses[i];
            }
        };
        if motion.has_pieces() {
            motion
                .pieces
                .free
                .iter()
                .for_each(|(_, nodes)| spare(nodes));
        } else if supports.entries().is_empty() {
            let nodes = 0..u32::try_from(moved.len()).expect("fewer than 2^32 nodes");
            spare(&nodes.collect::<Vec<u32>>());
        }
        direction
    }

    /// Energies after the step.
    fn audit(&self, motion: &Motion, attempt: Attempt, solved: &Solved) -> Audit {
        let (state, supports) = (&motion.state, &motion.nodes.supports);
        let damping = damping_within(motion);
        let euler = self.settings.scheme == ImplicitScheme::BackwardEuler;
        let moved = self.moved(&solved.x);
        let mut audit = Audit {
            kinetic: 0.0,
            momentum: DVec3::ZERO,
            elastic: solved.energy,
            ..state.audit
        };
        // What the forces of the scheme do less than the elastic energy falls.
        audit.numerical += state.audit.elastic - solved.energy - dot(&self.internal, &moved);
        if !self.applied.is_empty() {
            audit.applied_work += dot(&self.applied, &moved);
        }
        for (i, moved) in moved.iter().enumerate() {
            let (mass, old) = (motion.nodes.masses[i], state.velocities[i]);
            let velocity = self.velocity(motion, attempt, i, *moved);
            audit.kinetic += 0.5 * mass * velocity.length_squared();
            audit.momentum += velocity * mass;
            let support = supports.of(i);
            let free = support.map_or(DMat3::IDENTITY, |support| support.free);
            let mean = free * *moved / attempt.step;
            audit.dissipated += damping * mass * mean.length_squared() * attempt.step;
            if euler {
                let change = free * (velocity - old);
                audit.numerical += 0.5 * mass * change.length_squared();
            }
            // Work of a drive: what inertia and all other forces take in fixed directions.
            if let Some(support) = support.filter(|support| support.path.is_some()) {
                let held = |v: DVec3| support.held(v).length_squared();
                let applied = self.applied.get(i).copied().unwrap_or_default();
                let force = self.internal[i] + self.loads[i] + applied;
                audit.support_work +=
                    0.5 * mass * (held(velocity) - held(old)) - support.held(force).dot(*moved);
            }
        }
        audit
    }

    /// Velocity (m/s) of a node at the end, from how far it moved (m).
    fn velocity(&self, motion: &Motion, attempt: Attempt, node: usize, moved: DVec3) -> DVec3 {
        let old = motion.state.velocities[node];
        let rate = self.rate();
        // v1 − v0 = rate (d/dt − v0).
        let velocity = old + (moved / attempt.step - old) * rate;
        let supports = &motion.nodes.supports;
        supports.of(node).map_or(velocity, |support| {
            let driven = supports.target(support, attempt.end);
            let held = driven.map_or(DVec3::ZERO, |(_, v)| support.held(v));
            support.free * velocity + held
        })
    }

    fn finish(&mut self, motion: &mut Motion, attempt: Attempt, x: Vec<DVec3>, audit: Audit) {
        let moved = self.moved(&x);
        for (i, moved) in moved.iter().enumerate() {
            motion.state.velocities[i] = self.velocity(motion, attempt, i, *moved);
        }
        let s = &mut motion.state;
        s.positions = x;
        s.forces.clone_from(&self.end);
        s.applied.clone_from(&self.applied);
        s.viscous.clear();
        s.time = attempt.end;
        s.steps += 1;
        // Explicit steps after this one find their lag again.
        (s.step, s.lag) = (0.0, 0.0);
        s.audit = audit;
        motion.state.audit.load_work = motion.state.load_origin - motion.load_potential();
        if motion.has_free_pieces() {
            motion.state.audit.dissipated += motion.damp_relative(attempt.step);
        }
    }
}

/// Damping (1/s) that is solved for; where pieces are free, it acts after the step, as in explicit ones.
fn damping_within(motion: &Motion) -> f64 {
    if motion.has_free_pieces() {
        0.0
    } else {
        motion.settings.damping
    }
}

#[cfg(test)]
#[path = "implicit_tests.rs"]
mod tests;
