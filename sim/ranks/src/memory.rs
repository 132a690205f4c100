//! What a rank remembers of its nodes besides their motion, whatever model it is given.

use glam::DVec3;
use phyxel_integrate::State;

/// Vectors of own nodes.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    /// The vector of the last estimate of the largest eigenvalue, or none.
    pub(crate) vector: Vec<DVec3>,
    /// Positions, velocities, forces and viscous forces of the snapshot, and its vector.
    kept: [Vec<DVec3>; Memory::KEPT],
}

impl Memory {
    /// Lists that are kept.
    pub(crate) const KEPT: usize = 5;

    /// Keeps a state and the vector.
    pub(crate) fn keep(&mut self, state: &State) {
        let lists = [
            &state.positions,
            &state.velocities,
            &state.forces,
            &state.viscous,
            &self.vector,
        ];
        for (kept, list) in self.kept.iter_mut().zip(lists) {
            kept.clone_from(list);
        }
    }

    pub(crate) fn kept(&self) -> &[Vec<DVec3>; Self::KEPT] {
        &self.kept
    }

    /// Heap bytes held.
    pub(crate) fn bytes(&self) -> usize {
        let lists = self.kept.iter().chain([&self.vector]);
        lists.map(|list| size_of_val(&**list)).sum()
    }
}
