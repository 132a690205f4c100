//! What forces from outside may know of a step.

use crate::supports::Supports;
use glam::{DMat3, DVec3};

/// The body at the end of a step, before its second kick: positions are those of the end, velocities
/// still those of the half step under velocity Verlet.
#[derive(Debug, Clone, Copy)]
pub struct StepView<'a> {
    /// Time (s) at the end of the step.
    pub time: f64,
    /// Step (s).
    pub step: f64,
    /// Positions (m).
    pub positions: &'a [DVec3],
    /// Velocities (m/s).
    pub velocities: &'a [DVec3],
    pub(crate) nodes: NodeForces<'a>,
}

impl StepView<'_> {
    /// Acceleration (m/s²) of a node under all forces but those still to come, on its free directions.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn acceleration(&self, node: usize) -> DVec3 {
        self.nodes.acceleration(node)
    }

    /// Mass of a node (kg).
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn mass(&self, node: usize) -> f64 {
        self.nodes.masses[node]
    }

    /// Projector on the free directions of a node.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn free(&self, node: usize) -> DMat3 {
        let support = self.nodes.supports.and_then(|supports| supports.of(node));
        support.map_or(DMat3::IDENTITY, |support| support.free)
    }
}

/// Read-only view of masses and forces, for node loops.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NodeForces<'a> {
    pub(crate) masses: &'a [f64],
    pub(crate) inverse_masses: &'a [f64],
    pub(crate) supports: Option<&'a Supports>,
    pub(crate) gravity: DVec3,
    pub(crate) forces: &'a [DVec3],
    pub(crate) loads: &'a [DVec3],
    pub(crate) applied: &'a [DVec3],
    pub(crate) viscous: &'a [DVec3],
}

impl NodeForces<'_> {
    #[inline]
    pub(crate) fn acceleration(&self, node: usize) -> DVec3 {
        let mut force = self.forces[node];
        for more in [self.loads, self.applied, self.viscous] {
            if let Some(f) = more.get(node) {
                force += *f;
            }
        }
        let acceleration = force * self.inverse_masses[node] + self.gravity;
        match self.supports.and_then(|supports| supports.of(node)) {
            Some(support) => support.free * acceleration,
            None => acceleration,
        }
    }
}
