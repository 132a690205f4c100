//! Steps of a body whose nodes are partitioned, as over the memories of several machines.
//!
//! Whoever holds a share has a [`Motion`] of its nodes alone and takes the two passes over them; the whole
//! body's [`Motion`] keeps the clock, the energies and the order of a step, and sees of the nodes only
//! those that are monitored: driven ones, and those that forces from outside act on. Sums are per chunk of
//! [`SHARED_NODES`] nodes and are added in the order of the chunks: where shares begin at multiples of
//! it, the bits are those of the body in one piece.

use crate::motion::{Motion, State};
use crate::sweep::{Kick, Sums};
use crate::vector::CHUNK;
use glam::DVec3;

/// Shares begin at multiples of this many nodes, so that sums keep their order.
pub const SHARED_NODES: usize = CHUNK;

/// What both passes of a step need besides what belongs to nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pass {
    /// Step (s).
    pub step: f64,
    /// Time (s) for which forces act in the first pass, and what damping leaves of velocities in it.
    pub first: [f64; 2],
    /// The same of the second.
    pub second: [f64; 2],
}

impl Pass {
    fn kick(&self, [time, decay]: [f64; 2]) -> Kick {
        Kick {
            time,
            decay,
            step: self.step,
        }
    }
}

/// Sums over the nodes of a chunk in the second pass, to be handed on as numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassSums(pub [f64; PassSums::LENGTH]);

impl PassSums {
    /// How many numbers they are.
    pub const LENGTH: usize = 9;

    pub(crate) fn of(sums: &Sums) -> Self {
        let p = sums.momentum;
        let bad = f64::from(u8::from(sums.bad));
        Self([
            sums.kinetic,
            p.x,
            p.y,
            p.z,
            sums.dissipated,
            sums.applied,
            sums.potential,
            sums.lag,
            bad,
        ])
    }

    pub(crate) fn sums(&self) -> Sums {
        let [kinetic, x, y, z, dissipated, applied, potential, lag, bad] = self.0;
        Sums {
            kinetic,
            momentum: DVec3::new(x, y, z),
            dissipated,
            applied,
            potential,
            lag,
            bad: bad != 0.0,
        }
    }
}

/// The shares of a body, as its whole sees them. Of the vectors in [`State`] only those of monitored nodes
/// need to be current between two calls of [`Shares::fetch`]; which nodes are monitored, and how shares come by
/// their nodes' masses, supports and state, is between them and their maker.
pub trait Shares {
    /// Takes the first pass at all nodes, with the velocities (m/s) that `state` has of monitored ones; writes
    /// positions and velocities of monitored nodes.
    fn begin(&mut self, pass: &Pass, state: &mut State);

    /// Evaluates the forces, with the positions (m) that `state` has of monitored nodes; writes the
    /// `forces` (N) of monitored ones.
    fn evaluate(&mut self, state: &mut State, forces: &mut [DVec3]);

    /// Takes the second pass, with forces from outside (N), which are zero at nodes that are not watched;
    /// the slice is empty if there are none. Writes velocities and viscous forces (N, empty without
    /// viscosity) of monitored nodes. Returns the energy (J) of the forces last evaluated, and the sums of all
    /// chunks in their order.
    fn end(
        &mut self,
        pass: &Pass,
        applied: &[DVec3],
        state: &mut State,
        viscous: &mut [DVec3],
    ) -> (f64, Vec<PassSums>);

    /// Writes positions, velocities, forces and viscous forces of all nodes. Velocities that `state` has of monitored nodes
    /// are the current ones: what a path gives a driven node, shares do not know.
    fn fetch(&mut self, state: &mut State);

    /// Adopts the velocities and viscous forces of all nodes.
    fn store(&mut self, state: &State);
}

#[doc(hidden)]
impl Motion {
    /// Takes the first pass of a step over a share's nodes, see [`Shares::begin`].
    pub fn begin_pass(&mut self, pass: &Pass) {
        self.drift(pass.kick(pass.first));
    }

    /// Takes the second pass over a share's nodes with the new `forces` (N) and those from outside, if any;
    /// the sums of its chunks.
    ///
    /// # Panics
    /// If there is not one force per node, or from outside neither one nor none.
    pub fn end_pass(&mut self, pass: &Pass, forces: &[DVec3], applied: &[DVec3]) -> Vec<PassSums> {
        let n = self.node_count();
        assert!(
            forces.len() == n && (applied.is_empty() || applied.len() == n),
            "forces of {n} nodes"
        );
        self.next_forces.copy_from_slice(forces);
        self.next_applied.clear();
        self.next_applied.extend_from_slice(applied);
        let sums = self.finish(pass.kick(pass.second));
        self.take_forces();
        sums.iter().map(PassSums::of).collect()
    }

    /// Positions (m) and velocities (m/s) of a share's nodes, to be set from outside.
    pub fn places_mut(&mut self) -> (&mut [DVec3], &mut [DVec3]) {
        (&mut self.state.positions, &mut self.state.velocities)
    }

    /// Viscous forces (N) of a share's nodes, to be set from outside; empty without viscosity.
    pub fn viscous_mut(&mut self) -> &mut [DVec3] {
        &mut self.state.viscous
    }

    /// Constant forces (N) on nodes; empty without any.
    #[must_use]
    pub fn loads(&self) -> &[DVec3] {
        &self.nodes.loads
    }

    /// Exchanges the vectors that [`Shares::fetch`] writes, in its order, for others: for empty ones where shares
    /// have them and nobody reads them here. Only with the same ones back is this a motion again.
    pub fn swap_vectors(&mut self, vectors: &mut [Vec<DVec3>; 4]) {
        let s = &mut self.state;
        let own = [
            &mut s.positions,
            &mut s.velocities,
            &mut s.forces,
            &mut s.viscous,
        ];
        for (own, other) in own.into_iter().zip(vectors) {
            std::mem::swap(own, other);
        }
    }

    /// Brings all vectors of the state from the shares, which are as they were.
    pub fn fetch(&mut self, shares: &mut dyn Shares) {
        shares.fetch(&mut self.state);
    }
}

#[cfg(test)]
#[path = "shares_tests.rs"]
mod tests;
