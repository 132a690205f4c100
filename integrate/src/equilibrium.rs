//! Static equilibrium: Newton with load steps, and dynamic relaxation without a tangent.

use crate::law::ForceLaw;
use crate::newton::{Newton, NewtonReport, NewtonSettings, Problem, SolveError};
use crate::supports::Supports;
use crate::vector::norm;
use glam::DVec3;

/// What acts on a body at rest.
#[derive(Debug, Clone, Copy)]
pub struct StaticLoad<'a> {
    /// Forces on nodes (N), gravity included; empty for none. They grow in proportion to the load
    /// steps.
    pub forces: &'a [DVec3],
    /// Times (s) of the supports' paths before and after.
    pub times: [f64; 2],
    /// Equal load steps to begin with, at least 1. A step that fails is halved.
    pub steps: u32,
}

impl Default for StaticLoad<'_> {
    fn default() -> Self {
        Self {
            forces: &[],
            times: [0.0; 2],
            steps: 1,
        }
    }
}

/// What a static solution took.
#[derive(Debug, Clone, PartialEq)]
pub struct StaticReport {
    /// One report per load step that succeeded.
    pub steps: Vec<NewtonReport>,
    /// Load steps that failed and were halved.
    pub halved: u32,
    /// Forces of the supports on the body (N), with their node.
    pub reactions: Vec<(u32, DVec3)>,
    /// Energy (J) that the force law states.
    pub energy: f64,
}

/// Smallest load step, as a share of the whole.
const SMALLEST_STEP: f64 = 1e-4;

/// Moves `positions` (m) to static equilibrium: `f(x) + l = 0` on free directions.
///
/// Inexact Newton on the potential energy, with line search, conjugate gradients on the matrix-free
/// tangent and a block-diagonal preconditioner where the law gives blocks. Driven supports go to where
/// their paths are, step by step, and the first iteration of a step moves the inside along with them.
///
/// # Errors
/// [`SolveError`]; `positions` are then those of the last load step in equilibrium.
///
/// # Panics
/// If `supports` or forces are for another number of nodes.
pub fn solve_static(
    law: &mut dyn ForceLaw,
    positions: &mut [DVec3],
    supports: &Supports,
    load: &StaticLoad<'_>,
    settings: &NewtonSettings,
) -> Result<StaticReport, SolveError> {
    let n = positions.len();
    assert_eq!(supports.node_count(), n, "supports for every node");
    let fits = load.forces.is_empty() || load.forces.len() == n;
    assert!(fits, "one force per node, or none");
    let mut newton = Newton::default();
    let mut report = StaticReport {
        steps: Vec::new(),
        halved: 0,
        reactions: Vec::new(),
        energy: 0.0,
    };
    let mut reached = 0.0;
    let mut size = f64::from(load.steps.max(1)).recip();
    let mut x = positions.to_vec();
    let mut forces = vec![DVec3::ZERO; load.forces.len()];
    while reached < 1.0 {
        let share = if reached + size > 1.0 - 1e-9 {
            1.0
        } else {
            reached + size
        };
        for (scaled, force) in forces.iter_mut().zip(load.forces) {
            *scaled = *force * share;
        }
        let time = load.times[0] + (load.times[1] - load.times[0]) * share;
        let mut moved = positions.to_vec();
        supports.place(time, &mut moved);
        let mut driven = false;
        for (moved, x) in moved.iter_mut().zip(positions.iter()) {
            *moved -= *x;
            driven |= *moved != DVec3::ZERO;
        }
        let problem = Problem {
            supports,
            loads: &forces,
            inertia: None,
        };
        x.copy_from_slice(positions);
        let prescribed = driven.then_some(moved.as_slice());
        match newton.solve(law, &problem, &mut x, prescribed, settings) {
            Ok(step) => {
                // Driven directions exactly where the path is, not where round-off left them.
                supports.place(time, &mut x);
                positions.copy_from_slice(&x);
                report.energy = step.energy;
                report.steps.push(step);
                reached = share;
            }
            // Forces that are not finite before anything moved will not become so by a smaller step.
            Err(error @ SolveError::NotFinite { .. }) if !driven && reached == 0.0 => {
                return Err(error);
            }
            Err(error) if size * 0.5 < SMALLEST_STEP => {
                let smallest = size;
                let stuck = SolveError::LoadStep { smallest, reached };
                return Err(if reached > 0.0 { stuck } else { error });
            }
            Err(_) => {
                size *= 0.5;
                report.halved += 1;
            }
        }
    }
    let entries = supports.entries().iter();
    report.reactions = entries
        .map(|s| {
            let node = s.node as usize;
            let load = load.forces.get(node).copied().unwrap_or_default();
            (s.node, -s.held(newton.forces[node] + load))
        })
        .collect();
    Ok(report)
}

/// How to relax.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RelaxSettings {
    /// Stops when the norm of the unbalanced forces is below this share of the largest of: loads,
    /// forces on supports, unbalanced forces at the start.
    pub tolerance: f64,
    /// Force evaluations at most.
    pub evaluations: usize,
}

impl Default for RelaxSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            evaluations: 100_000,
        }
    }
}

/// What a relaxation took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelaxReport {
    /// Force evaluations.
    pub evaluations: usize,
    /// Norm of the unbalanced forces (N) at the end.
    pub residual: f64,
    /// What it is relative to (N).
    pub scale: f64,
    /// Energy (J) that the force law states.
    pub energy: f64,
}

/// Moves `positions` (m) to static equilibrium with forces alone: explicit motion from rest whose
/// velocities are set to zero at each peak of the kinetic energy (kinetic damping: Cundall 1976; Barnes
/// 1999, doi:10.1260/0266351991494722).
///
/// * `masses` -- any positive masses; those that make all nodes equally fast converge best.
/// * `step` -- below the critical one of these masses (s).
///
/// # Errors
/// [`SolveError::NotFinite`], [`SolveError::TooManyIterations`], [`SolveError::BadStep`].
///
/// # Panics
/// If slices are not for the same number of nodes.
pub fn relax(
    mut forces: impl FnMut(&[DVec3], &mut [DVec3]) -> f64,
    positions: &mut [DVec3],
    masses: &[f64],
    supports: &Supports,
    loads: &[DVec3],
    step: f64,
    settings: &RelaxSettings,
) -> Result<RelaxReport, SolveError> {
    let n = positions.len();
    assert_eq!(masses.len(), n, "one mass per node");
    assert_eq!(supports.node_count(), n, "supports for every node");
    assert!(
        loads.is_empty() || loads.len() == n,
        "one load per node, or none"
    );
    if !(step.is_finite() && step > 0.0) {
        return Err(SolveError::BadStep { step });
    }
    let mut velocities = vec![DVec3::ZERO; n];
    let mut f = vec![DVec3::ZERO; n];
    let mut scale = norm(loads);
    let mut before = 0.0;
    let mut at_peak = positions.to_vec();
    for evaluations in 1..=settings.evaluations {
        let energy = forces(positions, &mut f);
        if let Some(node) = f.iter().position(|f| !f.is_finite()) {
            return Err(SolveError::NotFinite { node });
        }
        for (f, load) in f.iter_mut().zip(loads) {
            *f += *load;
        }
        let whole = norm(&f);
        supports.project(&mut f);
        let residual = norm(&f);
        // What is not on free directions is carried by the supports.
        scale = scale.max((whole * whole - residual * residual).max(0.0).sqrt());
        if evaluations == 1 {
            scale = scale.max(residual);
        }
        if residual <= settings.tolerance * scale || scale == 0.0 {
            return Ok(RelaxReport {
                evaluations,
                residual,
                scale,
                energy,
            });
        }
        let mut kinetic = 0.0;
        for (((v, f), m), x) in velocities.iter_mut().zip(&f).zip(masses).zip(&*positions) {
            debug_assert!(x.is_finite(), "positions stay finite");
            *v += *f * (step / m);
            kinetic += 0.5 * m * v.length_squared();
        }
        if kinetic < before {
            // The peak lay a step ago: back there, and from rest.
            positions.copy_from_slice(&at_peak);
            velocities.fill(DVec3::ZERO);
            before = 0.0;
            continue;
        }
        before = kinetic;
        at_peak.copy_from_slice(positions);
        for (x, v) in positions.iter_mut().zip(&velocities) {
            *x += *v * step;
        }
    }
    Err(SolveError::TooManyIterations {
        iterations: settings.evaluations,
        relative: norm(&f) / scale,
        node: 0,
    })
}

#[cfg(test)]
#[path = "equilibrium_tests.rs"]
mod tests;
