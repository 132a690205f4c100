//! Damping that leaves rigid motion alone.
//!
//! Damping stands for what tissue and its surroundings do to vibration. Applied to whole velocities it
//! lets a lobe that a cut has freed sink as in syrup, and stops its turning; forces of stiffness-
//! proportional damping, differences of internal forces at two times, have a torque on a body that
//! turns. In a piece that nothing supports, both act on what is left of the motion when the rigid part
//! is taken out: the velocity `V + ω × (x - c)` with the piece's momenta.

use glam::{DMat3, DVec3};

use crate::motion::Motion;

/// Connected pieces, as far as they were named.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Pieces {
    /// Piece of each node; empty where none were named.
    of_node: Vec<u32>,
    /// Nodes of those that no support holds, rising within each.
    free: Vec<Vec<u32>>,
}

/// A field `a + b × (x - center)`.
#[derive(Debug, Clone, Copy)]
struct RigidField {
    center: DVec3,
    a: DVec3,
    b: DVec3,
}

impl RigidField {
    fn at(&self, x: DVec3) -> DVec3 {
        self.a + self.b.cross(x - self.center)
    }

    /// The field whose mass-weighted sum and moment are those of `weighted(i)` (mass times field) over
    /// some nodes.
    fn with_moments_of(
        nodes: &[u32],
        masses: &[f64],
        positions: &[DVec3],
        weighted: impl Fn(usize) -> DVec3,
    ) -> Self {
        let (mut mass, mut first) = (0.0, DVec3::ZERO);
        for &node in nodes {
            let node = node as usize;
            mass += masses[node];
            first += positions[node] * masses[node];
        }
        let center = first / mass;
        let sum: DVec3 = nodes.iter().map(|&node| weighted(node as usize)).sum();
        let a = sum / mass;
        let (mut moment, mut inertia) = (DVec3::ZERO, DMat3::ZERO);
        for &node in nodes {
            let node = node as usize;
            let arm = positions[node] - center;
            // Without the mean: arms that are round-off, as of a single node, would make a spin of it.
            moment += arm.cross(weighted(node) - a * masses[node]);
            let square = DMat3::from_diagonal(DVec3::splat(arm.length_squared()));
            let outer = DMat3::from_cols(arm * arm.x, arm * arm.y, arm * arm.z);
            inertia += (square - outer) * masses[node];
        }
        // One node, or nodes on a line, cannot turn in every way: those ways are left out.
        let b = solve_semidefinite(inertia, moment);
        Self { center, a, b }
    }
}

/// `A⁻¹ b` of a symmetric positive semidefinite matrix on the span where it is not singular.
fn solve_semidefinite(a: DMat3, b: DVec3) -> DVec3 {
    let trace = a.x_axis.x + a.y_axis.y + a.z_axis.z;
    if trace <= 0.0 {
        return DVec3::ZERO;
    }
    let scaled = a * trace.recip();
    if scaled.determinant() > 1e-9 {
        return scaled.inverse() * (b / trace);
    }
    // Nearly singular: a ridge of 1e-6 of the trace leaves the free ways as they are.
    let ridge = DMat3::from_diagonal(DVec3::splat(1e-6));
    (scaled + ridge).inverse() * (b / trace)
}

impl Motion {
    /// Names the connected pieces of a body, `piece[i]` that of node `i`, after a cut: in those that no
    /// support holds, damping acts on what is left of the motion when its rigid part is taken out, so
    /// that they fall and turn freely. An empty slice takes it back.
    ///
    /// # Panics
    /// If `piece` is neither empty nor one per node.
    pub fn set_pieces(&mut self, piece: &[u32]) {
        assert!(
            piece.is_empty() || piece.len() == self.node_count(),
            "one piece per node, or none"
        );
        self.pieces.of_node.clear();
        self.pieces.of_node.extend_from_slice(piece);
        self.find_free_pieces();
    }

    /// Whether [`Motion::set_pieces`] named any.
    #[must_use]
    pub fn has_pieces(&self) -> bool {
        !self.pieces.of_node.is_empty()
    }

    /// Looks which pieces no support holds.
    pub(crate) fn find_free_pieces(&mut self) {
        let piece = &self.pieces.of_node;
        let count = piece.iter().map(|&p| p as usize + 1).max().unwrap_or(0);
        let mut held = vec![false; count];
        for support in self.nodes.supports.entries() {
            if let Some(&piece) = piece.get(support.node as usize) {
                held[piece as usize] = true;
            }
        }
        let mut free = vec![Vec::new(); count];
        for (node, &piece) in (0_u32..).zip(piece.iter()) {
            if !held[piece as usize] {
                free[piece as usize].push(node);
            }
        }
        free.retain(|nodes| !nodes.is_empty());
        self.pieces.free = free;
    }

    /// Whether damping has to spare rigid motions.
    pub(crate) fn spares_rigid_motion(&self) -> bool {
        !self.pieces.free.is_empty()
    }

    /// Damps velocities over a step (s), in free pieces relative to their rigid motion; the energy (J)
    /// that it takes.
    pub(crate) fn damp_relative(&mut self, step: f64) -> f64 {
        let left = (-self.settings.damping * step).exp();
        if self.settings.damping == 0.0 {
            return 0.0;
        }
        let before = self.kinetic_energy();
        let (masses, state) = (&self.nodes.masses, &mut self.state);
        let pieces = &self.pieces.free;
        let fields: Vec<RigidField> = pieces
            .iter()
            .map(|nodes| {
                let momentum = |node: usize| state.velocities[node] * masses[node];
                RigidField::with_moments_of(nodes, masses, &state.positions, momentum)
            })
            .collect();
        for velocity in &mut state.velocities {
            *velocity *= left;
        }
        for (nodes, field) in pieces.iter().zip(fields) {
            for &node in nodes {
                let node = node as usize;
                state.velocities[node] += field.at(state.positions[node]) * (1.0 - left);
            }
        }
        let masses = &self.nodes.masses;
        let velocities = self.state.velocities.iter();
        self.state.audit.momentum = velocities.zip(masses).map(|(v, m)| *v * *m).sum();
        self.state.audit.kinetic = self.kinetic_energy();
        before - self.state.audit.kinetic
    }

    /// Takes force and torque out of the viscous forces on free pieces, after a kick of `time` (s) with
    /// them; what that changes in the kinetic energy (J).
    pub(crate) fn balance_viscous_forces(&mut self, time: f64) -> f64 {
        let state = &mut self.state;
        if state.viscous.is_empty() {
            return 0.0;
        }
        let (masses, mut gained) = (&self.nodes.masses, 0.0);
        for nodes in &self.pieces.free {
            let force = |node: usize| state.viscous[node];
            let field = RigidField::with_moments_of(nodes, masses, &state.positions, force);
            for &node in nodes {
                let node = node as usize;
                let off = field.at(state.positions[node]);
                let velocity = &mut state.velocities[node];
                let before = velocity.length_squared();
                state.viscous[node] -= off * masses[node];
                *velocity -= off * time;
                gained += 0.5 * masses[node] * (velocity.length_squared() - before);
            }
        }
        gained
    }
}

#[cfg(test)]
#[path = "rigid_tests.rs"]
mod tests;
