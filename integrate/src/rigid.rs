//! Damping that leaves rigid motion alone.
//!
//! Damping stands for what tissue and its surroundings do to vibration. Applied to whole velocities it
//! lets a lobe that a cut has freed sink as in syrup, and stops its turning; forces of stiffness-
//! proportional damping, differences of internal forces at two times, have a torque on a body that
//! turns. In a piece that nothing supports, both act on what is left of the motion when the rigid part
//! is taken out: the velocity `V + ω × (x - c)` with the piece's momenta.

use glam::DVec3;
use rayon::prelude::*;

use crate::audit::RigidEnergies;
use crate::motion::Motion;
use crate::pieces::{RigidField, all};
use crate::sweep::PARALLEL_FROM;
use crate::vector::CHUNK;

impl Motion {
    /// What of the kinetic energy and of [`crate::State::lag`] is of the rigid motions of pieces that no support holds, as
    /// [`Motion::set_pieces`] named them: what falls freely may have any amount of it and strains nothing. 0 without
    /// such pieces.
    #[must_use]
    pub fn rigid_energies(&self) -> RigidEnergies {
        let (masses, state) = (&self.nodes.masses, &self.state);
        let half = 0.5 * state.step;
        let mut sum = RigidEnergies::default();
        for (_, nodes) in &self.pieces.free {
            let field = |weighted: &dyn Fn(usize) -> DVec3| {
                RigidField::with_moments_of(all(nodes), masses, &state.positions, weighted)
            };
            let moves = field(&|node| state.velocities[node] * masses[node]);
            let gains = (state.lag > 0.0).then(|| field(&|node| self.total_force(node) * half));
            for node in all(nodes) {
                let (mass, velocity) = (masses[node], moves.at(state.positions[node]));
                sum.kinetic += 0.5 * mass * velocity.length_squared();
                if let Some(gains) = &gains {
                    sum.lag += self.lag_of(mass, velocity, gains.at(state.positions[node]));
                }
            }
        }
        sum
    }

    /// Whether it has pieces that no support holds.
    #[must_use]
    pub fn has_free_pieces(&self) -> bool {
        !self.pieces.free.is_empty()
    }

    /// Nodes of each piece that no support holds, ascending.
    pub fn free_pieces(&self) -> impl Iterator<Item = &[u32]> {
        self.pieces.free.iter().map(|(_, nodes)| &nodes[..])
    }

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
        let free = (0_u32..).zip(free).filter(|(_, nodes)| !nodes.is_empty());
        self.pieces.free = free.collect();
        self.pieces.count = count;
    }

    /// Damps velocities over a step (s), in free pieces relative to their rigid motion; the energy (J)
    /// that it takes.
    pub(crate) fn damp_relative(&mut self, step: f64) -> f64 {
        let left = (-self.settings.damping * step).exp();
        if self.settings.damping == 0.0 {
            return 0.0;
        }
        let before = self.state.audit.kinetic;
        let (masses, state) = (&self.nodes.masses, &mut self.state);
        let mut fields = vec![RigidField::ZERO; self.pieces.count];
        for (piece, nodes) in &self.pieces.free {
            let momentum = |node: usize| state.velocities[node] * masses[node];
            fields[*piece as usize] =
                RigidField::with_moments_of(all(nodes), masses, &state.positions, momentum);
        }
        let (positions, pieces) = (&state.positions, &self.pieces.of_node);
        let damp = |(chunk, velocities): (usize, &mut [DVec3])| {
            let (mut momentum, mut kinetic) = (DVec3::ZERO, 0.0);
            let first = chunk * CHUNK;
            let nodes = first..first + velocities.len();
            let places = positions[nodes.clone()].iter().zip(&pieces[nodes.clone()]);
            let nodes = velocities.iter_mut().zip(&masses[nodes]).zip(places);
            for ((velocity, mass), (position, piece)) in nodes {
                let field = &fields[*piece as usize];
                *velocity = *velocity * left + field.at(*position) * (1.0 - left);
                momentum += *velocity * *mass;
                kinetic += 0.5 * mass * velocity.length_squared();
            }
            (momentum, kinetic)
        };
        let sums: Vec<(DVec3, f64)> = if positions.len() >= PARALLEL_FROM {
            let chunks = state.velocities.par_chunks_mut(CHUNK).enumerate();
            chunks.map(damp).collect()
        } else {
            let chunks = state.velocities.chunks_mut(CHUNK).enumerate();
            chunks.map(damp).collect()
        };
        let sum = sums
            .iter()
            .fold((DVec3::ZERO, 0.0), |(p, k), more| (p + more.0, k + more.1));
        (self.state.audit.momentum, self.state.audit.kinetic) = sum;
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
        for (_, nodes) in &self.pieces.free {
            let force = |node: usize| state.viscous[node];
            let field = RigidField::with_moments_of(all(nodes), masses, &state.positions, force);
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
