//! Static equilibrium: Newton with load steps.

use crate::law::ForceLaw;
use crate::newton::{Newton, NewtonReport, NewtonSettings, Problem, SolveError};
use crate::supports::BoundaryConditions;
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

impl<'a> StaticLoad<'a> {
    /// These forces on nodes (N), in one step.
    #[must_use]
    pub fn of(forces: &'a [DVec3]) -> Self {
        Self {
            forces,
            ..Self::default()
        }
    }
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
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
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

/// Smallest load step, as a fraction of the whole.
const SMALLEST_STEP: f64 = 1e-4;
/// The same of the first: what does not bear this share bears none. (A thin mesh failed for 290 s down to 1e-4.)
const SMALLEST_FIRST_STEP: f64 = 1.0 / 64.0;

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
    supports: &BoundaryConditions,
    load: &StaticLoad<'_>,
    settings: &NewtonSettings,
) -> Result<StaticReport, SolveError> {
    let n = positions.len();
    assert_eq!(supports.node_count(), n, "supports for every node");
    let fits = load.forces.is_empty() || load.forces.len() == n;
    assert!(fits, "one force per node, or none");
    let mut newton = Newton::default();
    let mut report = StaticReport::default();
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
        let smallest = if reached > 0.0 {
            SMALLEST_STEP
        } else {
            SMALLEST_FIRST_STEP
        };
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
            Err(error) if size * 0.5 < smallest => {
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

#[cfg(test)]
#[path = "equilibrium_tests.rs"]
mod tests;
