//! What forces from outside may know of a step.

use crate::nodes::NodeConstants;
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
    pub(crate) acting: NodeForces<'a>,
}

impl StepView<'_> {
    /// Acceleration (m/s²) of a node under all forces but those still to come, on its free directions.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn acceleration(&self, node: usize) -> DVec3 {
        self.acting.acceleration(node)
    }

    /// Mass of a node (kg).
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn mass(&self, node: usize) -> f64 {
        self.acting.nodes.masses[node]
    }

    /// Projector on the free directions of a node.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn free(&self, node: usize) -> DMat3 {
        let support = self.acting.nodes.supports.of(node);
        support.map_or(DMat3::IDENTITY, |support| support.free)
    }
}

/// Read-only view of masses and of all forces but those from outside.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NodeForces<'a> {
    pub(crate) nodes: &'a NodeConstants,
    pub(crate) gravity: DVec3,
    pub(crate) forces: &'a [DVec3],
    /// Internal forces of the step before.
    pub(crate) before: &'a [DVec3],
    /// Viscosity over step.
    pub(crate) viscosity: f64,
}

impl NodeForces<'_> {
    fn acceleration(&self, node: usize) -> DVec3 {
        let mut force = self.forces[node] + self.gravity * self.nodes.masses[node];
        if let Some(load) = self.nodes.loads.get(node) {
            force += *load;
        }
        if self.viscosity > 0.0 {
            force += (self.forces[node] - self.before[node]) * self.viscosity;
        }
        let acceleration = force * self.nodes.mobility.inverse[node];
        match self.nodes.supports.of(node) {
            Some(support) => support.free * acceleration,
            None => acceleration,
        }
    }
}
