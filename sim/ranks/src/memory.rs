//! What a rank remembers of its nodes besides their motion, whatever model it is given.

use glam::DVec3;
use phyxel_integrate::State;

/// Positions, velocities, forces and viscous forces of a state.
pub(crate) fn moving(state: &State) -> [&Vec<DVec3>; 4] {
    let (x, v) = (&state.positions, &state.velocities);
    [x, v, &state.forces, &state.viscous]
}

/// The same, to be written.
pub(crate) fn moving_mut(state: &mut State) -> [&mut Vec<DVec3>; 4] {
    let (x, v) = (&mut state.positions, &mut state.velocities);
    [x, v, &mut state.forces, &mut state.viscous]
}

/// Vectors of own nodes.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    /// The vector of the last estimate of the largest eigenvalue, or none.
    pub(crate) vector: Vec<DVec3>,
    /// What moves in the snapshot, and its vector.
    kept: [Vec<DVec3>; 5],
}

impl Memory {
    /// Keeps a state and the vector.
    pub(crate) fn keep(&mut self, state: &State) {
        let lists = moving(state).into_iter().chain([&self.vector]);
        for (kept, list) in self.kept.iter_mut().zip(lists) {
            kept.clone_from(list);
        }
    }

    pub(crate) fn kept(&self) -> &[Vec<DVec3>; 5] {
        &self.kept
    }

    /// Heap bytes held.
    pub(crate) fn bytes(&self) -> usize {
        let lists = self.kept.iter().chain([&self.vector]);
        lists.map(|list| size_of_val(&**list)).sum()
    }
}
