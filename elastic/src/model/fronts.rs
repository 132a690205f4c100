//! Control of the fronts of cuts in a model.

use glam::{DMat3, DVec3};

use super::Elastic;
use crate::cut::front::Front;

impl Elastic {
    /// Sets the matrices `M_i` of the control of a cut's front at `nodes`; zero takes the control away. `M_i` is symmetric, its eigenvalues 0 to 1: the mean of `ν νᵀ` over the directions `ν`, in the rest
    /// state, in which the cut ends beside the node.
    ///
    /// Without hourglass stabilization ([`crate::Settings::stabilization`] 0) it does nothing. A node without strain
    /// energy, or whose row is not full, has none. What it takes follows the number of such nodes.
    ///
    /// # Panics
    /// If a node does not exist or there is not one matrix per node.
    pub(crate) fn set_fronts(&mut self, nodes: &[u32], matrices: &[DMat3]) {
        assert_eq!(nodes.len(), matrices.len(), "one matrix per node");
        if !self.model.controlled() {
            return;
        }
        let fronts = &mut self.cut.fronts;
        let mut changed = Vec::new();
        for (&node, &matrix) in nodes.iter().zip(matrices) {
            let exists = (node as usize) < self.model.node_count();
            assert!(exists, "node {node} exists");
            let front = Front::new(node, matrix);
            match (fronts.find(node), matrix == DMat3::ZERO) {
                (Ok(at), true) => {
                    fronts.0.remove(at);
                }
                (Ok(at), false) => fronts.0[at] = front,
                (Err(at), false) => fronts.0.insert(at, front),
                (Err(_), true) => continue,
            }
            changed.push(node);
        }
        self.scratch.stale.add(&changed);
        self.refresh_fronts();
    }

    /// As [`Elastic::set_fronts`], with the matrices times the same fraction, at most 1, as far as their control then holds at
    /// most `most` (J) at `positions` (m). With `most` what a cut took, a cut of a strained body adds no energy, and one of
    /// a body at rest gets the whole control. Returns what it holds.
    ///
    /// # Panics
    /// As [`Elastic::set_fronts`], or if `positions` is not one per node.
    pub(crate) fn set_fronts_within(
        &mut self,
        nodes: &[u32],
        matrices: &[DMat3],
        most: f64,
        positions: &[DVec3],
    ) -> f64 {
        self.set_fronts(nodes, matrices);
        let whole = self.front_energy(nodes, positions);
        if whole > most.max(0.0) {
            // The energy is in proportion.
            let share = (most / whole).clamp(0.0, 1.0);
            let matrices: Vec<DMat3> = matrices.iter().map(|matrix| *matrix * share).collect();
            self.set_fronts(nodes, &matrices);
            return whole * share;
        }
        whole
    }

    /// Brings them up to date with rows and volumes.
    pub(crate) fn refresh_fronts(&mut self) {
        let (model, fronts) = (&self.model, &mut self.cut.fronts);
        fronts.refresh(model, &self.tables);
    }

    /// Restores what [`Elastic::fronts`] gave: all other nodes have no such control.
    pub(crate) fn restore_fronts(&mut self, fronts: &[(u32, DMat3)]) {
        let known: Vec<u32> = self.cut.fronts.nodes().collect();
        self.set_fronts(&known, &vec![DMat3::ZERO; known.len()]);
        let (nodes, matrices): (Vec<u32>, Vec<DMat3>) = fronts.iter().copied().unzip();
        self.set_fronts(&nodes, &matrices);
    }

    /// Nodes with a control of a cut's front, ascending, and its matrices.
    pub(crate) fn fronts(&self) -> Vec<(u32, DMat3)> {
        let fronts = self.cut.fronts.0.iter();
        fronts.map(|front| (front.node, front.matrix)).collect()
    }

    /// Energy (J) that the control of a cut's front at `nodes` holds at `positions` (m).
    ///
    /// # Panics
    /// If `positions` is not one per node.
    pub(crate) fn front_energy(&self, nodes: &[u32], positions: &[DVec3]) -> f64 {
        assert_eq!(positions.len(), self.node_count(), "one position per node");
        let (rest, fronts) = (&self.model.rest, &self.cut.fronts);
        let displacement = |node: u32| positions[node as usize] - rest[node as usize];
        let found = nodes.iter().filter_map(|&node| fronts.find(node).ok());
        let energies = found.map(|at| {
            let mut front = fronts.0[at].clone();
            front.evaluate(displacement);
            front.energy
        });
        energies.sum()
    }
}
