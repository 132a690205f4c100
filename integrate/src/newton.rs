//! Inexact Newton with line search for `f(x) + l − c M (x − y) = 0`: statics with `c = 0`, implicit
//! steps with `c ~ 1/dt²`.

use crate::law::ForceLaw;
use crate::linear::Conjugate;
use crate::supports::BoundaryConditions;
use crate::vector::{add_scaled, dot, largest, norm};
use glam::{DMat3, DVec3};

/// When to stop, and how hard to try.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NewtonSettings {
    /// Stops when the norm of the unbalanced forces is below this fraction of the largest of: loads,
    /// forces on supports there, unbalanced forces at the start.
    pub tolerance: f64,
    /// Newton iterations at most.
    pub iterations: usize,
    /// Conjugate gradient iterations at most, in each Newton iteration.
    pub linear_iterations: usize,
    /// First and largest relative tolerance of the linear solves; it falls with the square of the
    /// residual (Eisenstat and Walker 1996, doi:10.1137/0917003, choice 2), which keeps the
    /// convergence quadratic.
    pub linear_tolerance: f64,
}

impl Default for NewtonSettings {
    /// Tolerance 1e-8, 40 iterations of at most 2,000 linear ones, which begin at a tolerance of 0.1.
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            iterations: 40,
            linear_iterations: 2000,
            linear_tolerance: 0.1,
        }
    }
}

impl NewtonSettings {
    /// The default but for the fraction below which unbalanced forces are accepted.
    #[must_use]
    pub fn with_tolerance(tolerance: f64) -> Self {
        Self {
            tolerance,
            ..Self::default()
        }
    }
}

/// What a solve took.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct NewtonReport {
    /// Norm of the unbalanced forces (N) before each iteration and at the end.
    pub residuals: Vec<f64>,
    /// What the residuals are relative to (N).
    pub scale: f64,
    /// Tangent products in all.
    pub linear_iterations: usize,
    /// Force evaluations in all.
    pub evaluations: usize,
    /// Energy (J) that the force law states at the solution.
    pub energy: f64,
}

impl NewtonReport {
    /// Last residual over scale.
    #[must_use]
    pub fn relative_residual(&self) -> f64 {
        let last = self.residuals.last().copied().unwrap_or(0.0);
        if self.scale > 0.0 {
            last / self.scale
        } else {
            0.0
        }
    }
}

/// Why no solution was found.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// Forces are not finite at the start, or after the supports moved.
    #[error("force not finite at node {node}: take smaller load steps, or start elsewhere")]
    NotFinite {
        /// First such node.
        node: usize,
    },
    /// No shorter step lowers the energy or the residual.
    #[error(
        "no descent at relative residual {relative:.2e} (largest at node {node}): \
             the body may buckle or slide freely; add supports, or let it come to rest by damped motion"
    )]
    NoDescent {
        /// Unbalanced over scale.
        relative: f64,
        /// Node with the largest unbalanced force.
        node: usize,
    },
    /// Too many iterations.
    #[error(
        "relative residual {relative:.2e} after {iterations} iterations (largest at node {node})"
    )]
    TooManyIterations {
        /// Iterations taken.
        iterations: usize,
        /// Unbalanced over scale.
        relative: f64,
        /// Node with the largest unbalanced force.
        node: usize,
    },
    /// The motion broke off.
    #[error(transparent)]
    Motion(#[from] crate::error::StepError),
    /// No part of an implicit step, down to 1/256 of it, was solved.
    #[error(
        "an implicit step at {time:.6} s is not solved down to {step:.1e} s (last residual {relative:.1e}, \
         largest at node {node}): look there for inverted or torn nodes, or for a tool or support that moves \
         through the body"
    )]
    Step {
        /// Smallest part tried (s).
        step: f64,
        /// Time (s) that was reached within the step.
        time: f64,
        /// Unbalanced over scale; infinite if a force was not finite.
        relative: f64,
        /// Node with the largest unbalanced force.
        node: usize,
    },
    /// The load step was halved too often.
    #[error("load steps below {smallest:.1e} of the load still fail, at {reached:.4} of it")]
    LoadStep {
        /// Smallest step tried, as a fraction of the load.
        smallest: f64,
        /// Fraction of the load that was reached.
        reached: f64,
    },
    /// A tool under forces has no pose until the step is done.
    #[error("tool {tool} moves under forces: give it a path, or take explicit steps")]
    ForceDrivenTool {
        /// Index of the tool.
        tool: usize,
    },
    /// The motion asks for viscosity, which only explicit steps have.
    #[error("viscosity of {viscosity} s in an implicit step: set it to 0, or take explicit steps")]
    Viscosity {
        /// Viscosity (s).
        viscosity: f64,
    },
    /// The step is not positive and finite.
    #[error("a step of {step} s cannot be taken; it must be positive and finite")]
    BadStep {
        /// Step (s).
        step: f64,
    },
}

impl SolveError {
    /// The same of a part of an implicit step (s) that begins at `time` (s).
    pub(crate) fn in_step(self, step: f64, time: f64) -> Self {
        let (relative, node) = match self {
            Self::NotFinite { node } => (f64::INFINITY, node),
            Self::NoDescent { relative, node } | Self::TooManyIterations { relative, node, .. } => {
                (relative, node)
            }
            other => return other,
        };
        Self::Step {
            step,
            time,
            relative,
            node,
        }
    }
}

/// What is held fixed during a solve.
pub(crate) struct Problem<'a> {
    pub(crate) supports: &'a BoundaryConditions,
    /// Constant forces (N), gravity included.
    pub(crate) loads: &'a [DVec3],
    /// `c` (1/s²), masses (kg) and `y` (m).
    pub(crate) inertia: Option<(f64, &'a [f64], &'a [DVec3])>,
}

/// Work arrays, kept between solves.
#[derive(Debug, Clone, Default)]
pub(crate) struct Newton {
    pub(crate) conjugate: Conjugate,
    /// Internal forces at the solution (N).
    pub(crate) forces: Vec<DVec3>,
    residual: Vec<DVec3>,
    step: Vec<DVec3>,
    trial: Vec<DVec3>,
    trial_forces: Vec<DVec3>,
    trial_residual: Vec<DVec3>,
    blocks: Vec<DMat3>,
}

impl Problem<'_> {
    /// Residual on free directions from internal forces.
    fn residual(&self, x: &[DVec3], forces: &[DVec3], residual: &mut [DVec3]) {
        residual.copy_from_slice(forces);
        if !self.loads.is_empty() {
            add_scaled(residual, 1.0, self.loads);
        }
        if let Some((c, masses, y)) = self.inertia {
            crate::vector::update(residual, |i, r| *r -= (x[i] - y[i]) * (c * masses[i]));
        }
        self.supports.project(residual);
    }

    /// `(K + c M) v` on free directions.
    pub(crate) fn tangent_product(&self, law: &mut dyn ForceLaw, v: &[DVec3], out: &mut [DVec3]) {
        law.tangent_product_into(v, out);
        if let Some((c, masses, _)) = self.inertia {
            crate::vector::update(out, |i, out| *out += v[i] * (c * masses[i]));
        }
        self.supports.project(out);
    }

    /// The potential without the law's own energy.
    fn potential(&self, x: &[DVec3]) -> f64 {
        let loads = if self.loads.is_empty() {
            0.0
        } else {
            dot(self.loads, x)
        };
        let inertia = self.inertia.map_or(0.0, |(c, masses, y)| {
            let nodes = masses.iter().zip(x).zip(y);
            nodes
                .map(|((m, x), y)| 0.5 * c * m * (*x - *y).length_squared())
                .sum()
        });
        inertia - loads
    }
}

impl Newton {
    /// Solves from `x`; `prescribed` moves fixed directions in the first iteration, together with the
    /// tangent's answer to it.
    pub(crate) fn solve(
        &mut self,
        law: &mut dyn ForceLaw,
        problem: &Problem<'_>,
        x: &mut [DVec3],
        prescribed: Option<&[DVec3]>,
        settings: &NewtonSettings,
    ) -> Result<NewtonReport, SolveError> {
        let n = x.len();
        for array in [
            &mut self.forces,
            &mut self.residual,
            &mut self.step,
            &mut self.trial,
            &mut self.trial_forces,
            &mut self.trial_residual,
        ] {
            array.resize(n, DVec3::ZERO);
        }
        let mut report = NewtonReport::default();
        let mut energy = law.forces_into(x, &mut self.forces);
        report.evaluations = 1;
        check(&self.forces, energy)?;
        self.precondition(law, problem, n);
        let mut pending = prescribed;
        problem.residual(x, &self.forces, &mut self.residual);
        let mut size = norm(&self.residual);
        // Not of iterates on the way: after one with a residual of 1e12 N all was good enough.
        let least = size.max(norm(problem.loads));
        // Positions are known to round-off only, and inertia multiplies that.
        let noise = problem.inertia.map_or(0.0, |(c, masses, _)| {
            let nodes = masses.iter().zip(&*x);
            let sum: f64 = nodes.map(|(m, x)| (m * x.length()).powi(2)).sum();
            8.0 * f64::EPSILON * c * sum.sqrt()
        });
        let mut forcing = settings.linear_tolerance;
        loop {
            report.scale = least.max(self.held_force(problem));
            report.residuals.push(size);
            report.energy = energy;
            if pending.is_none() && size <= (settings.tolerance * report.scale).max(noise) {
                return Ok(report);
            }
            let done = report.residuals.len() - 1;
            if done >= settings.iterations {
                return Err(SolveError::TooManyIterations {
                    iterations: done,
                    relative: size / report.scale,
                    node: self.worst(),
                });
            }
            let moved = pending.take();
            if let Some(moved) = moved {
                // The tangent's answer to the prescribed motion goes to the right side.
                problem.tangent_product(law, moved, &mut self.trial_residual);
                add_scaled(&mut self.residual, -1.0, &self.trial_residual);
            }
            // No tighter than what ends the iteration.
            let enough = 0.3 * settings.tolerance * report.scale / norm(&self.residual);
            let tolerance = forcing.max(enough).min(settings.linear_tolerance);
            let limits = (tolerance, settings.linear_iterations);
            let (b, to) = (&self.residual, &mut self.step);
            let product = |v: &[DVec3], out: &mut [DVec3]| problem.tangent_product(law, v, out);
            report.linear_iterations += self.conjugate.solve(product, b, to, limits);
            if let Some(moved) = moved {
                add_scaled(&mut self.step, 1.0, moved);
                add_scaled(x, 1.0, &self.step);
                energy = law.forces_into(x, &mut self.forces);
                report.evaluations += 1;
                check(&self.forces, energy)?;
                problem.residual(x, &self.forces, &mut self.residual);
                size = norm(&self.residual);
                continue;
            }
            let Some(found) = self.line_search(law, problem, x, energy, &mut report.evaluations)
            else {
                return Err(SolveError::NoDescent {
                    relative: size / report.scale,
                    node: self.worst(),
                });
            };
            let before = size;
            (energy, size) = found;
            x.copy_from_slice(&self.trial);
            std::mem::swap(&mut self.forces, &mut self.trial_forces);
            std::mem::swap(&mut self.residual, &mut self.trial_residual);
            let rate = size / before;
            forcing = (0.9 * rate * rate).min(settings.linear_tolerance);
        }
    }

    /// The first of `x + s/2^k` along the step `s` that is low enough, which goes to the trial arrays: its energy (J) and the
    /// norm of its residual (N). `energy` (J) is that at `x`.
    fn line_search(
        &mut self,
        law: &mut dyn ForceLaw,
        problem: &Problem<'_>,
        x: &[DVec3],
        energy: f64,
        evaluations: &mut usize,
    ) -> Option<(f64, f64)> {
        let potential = energy + problem.potential(x);
        let slope = dot(&self.residual, &self.step);
        let mut length = 1.0;
        for _ in 0..25 {
            self.trial.copy_from_slice(x);
            add_scaled(&mut self.trial, length, &self.step);
            let trial_energy = law.forces_into(&self.trial, &mut self.trial_forces);
            *evaluations += 1;
            if check(&self.trial_forces, trial_energy).is_ok() {
                problem.residual(&self.trial, &self.trial_forces, &mut self.trial_residual);
                let change = trial_energy + problem.potential(&self.trial) - potential;
                // Near the solution the energy's change drowns in round-off (at a strain of 1e-5
                // it is known to 1e-6); there its slope decides (approximate Wolfe condition: Hager and Zhang 2005,
                // doi:10.1137/030601880).
                let noise = 1e-5 * (energy.abs() + potential.abs() + (potential - energy).abs());
                let slope_there = dot(&self.trial_residual, &self.step);
                if change <= -1e-4 * length * slope
                    || (change <= noise && slope_there.abs() <= 0.9 * slope.abs())
                {
                    return Some((trial_energy, norm(&self.trial_residual)));
                }
            }
            length *= 0.5;
        }
        None
    }

    /// Forces (N) that the last solve left unbalanced.
    pub(crate) fn residual(&self) -> &[DVec3] {
        &self.residual
    }

    /// The node with the largest of them.
    fn worst(&self) -> usize {
        largest(self.residual.iter().map(|force| force.length_squared()))
    }

    fn precondition(&mut self, law: &mut dyn ForceLaw, problem: &Problem<'_>, n: usize) {
        self.blocks.resize(n, DMat3::ZERO);
        let known = law.tangent_blocks_into(&mut self.blocks);
        if !known {
            self.blocks.fill(DMat3::ZERO);
        }
        match problem.inertia {
            Some((c, masses, _)) => {
                for (block, m) in self.blocks.iter_mut().zip(masses) {
                    *block += DMat3::from_diagonal(DVec3::splat(c * m));
                }
            }
            None if !known => {
                self.conjugate.inverse_blocks.clear();
                return;
            }
            None => {}
        }
        self.conjugate.set_blocks(&self.blocks, problem.supports);
    }

    /// Norm of the internal forces on fixed directions.
    fn held_force(&self, problem: &Problem<'_>) -> f64 {
        let entries = problem.supports.entries().iter();
        let sum: f64 = entries
            .map(|s| s.held(self.forces[s.node as usize]).length_squared())
            .sum();
        sum.sqrt()
    }
}

/// Refuses forces or an energy that are not finite.
pub(crate) fn check(forces: &[DVec3], energy: f64) -> Result<(), SolveError> {
    let bad = forces.iter().position(|f| !f.is_finite());
    match bad.or_else(|| (!energy.is_finite()).then_some(0)) {
        Some(node) => Err(SolveError::NotFinite { node }),
        None => Ok(()),
    }
}
