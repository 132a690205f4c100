//! Forces again after a few rows changed, at a cost that follows the change.

use glam::DVec3;

use crate::kernel::nodes::Scratch;
use crate::kernel::storage::CHUNK;
use crate::model::Elastic;

impl Elastic {
    /// Whether the last evaluation was of this model at these positions (m).
    pub(crate) fn is_evaluated_at(&self, positions: &[DVec3]) -> bool {
        let Scratch { stale, moves, .. } = &self.scratch;
        assert_eq!(positions.len(), moves.len(), "one position per node");
        !stale.is_some() && stale.is_at(&self.model.rest, moves, positions)
    }

    /// As [`Elastic::forces_into`], bitwise identical, where `forces` holds what the last evaluation gave
    /// at the same positions and a cut has changed the model since: only what follows from the change
    /// is evaluated, in whole chunks of 256 nodes. A body with mean dilatation or viscosity, one that
    /// has moved, and one of which more than rows changed is evaluated as a whole.
    ///
    /// # Panics
    /// If a slice is not as long as there are nodes.
    pub fn forces_again(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        let n = self.node_count();
        assert_eq!(positions.len(), n, "one position per node");
        assert_eq!(forces.len(), n, "one force per node");
        let (model, stale) = (&self.model, &self.scratch.stale);
        let whole = stale.all || model.means.is_some() || self.state.viscosity.is_some();
        let moves = &self.scratch.moves;
        let still = !whole && stale.is_at(&model.rest, moves, positions);
        if !still {
            return self.forces_into(positions, forces);
        }
        let chosen = self.changed_chunks();
        self.evaluate(positions, forces, Some(&chosen))
    }

    /// Chunks whose records or forces follow from what changed.
    pub(crate) fn changed_chunks(&self) -> Vec<bool> {
        let (pairs, stale) = (&self.model.pairs, &self.scratch.stale);
        let mut chosen = vec![false; self.node_count().div_ceil(CHUNK)];
        for &node in &stale.nodes {
            chosen[node as usize / CHUNK] = true;
            let (row, incoming) = (pairs.row(node as usize), pairs.incoming(node as usize));
            for pair in row.iter().chain(incoming) {
                chosen[pair.to as usize / CHUNK] = true;
            }
        }
        // Forces of bonds and fronts are added to what the passes give.
        let ends = self.cut.bonds.ends();
        for node in self.cut.fronts.nodes() {
            chosen[node as usize / CHUNK] = true;
            for pair in pairs.row(node as usize) {
                chosen[pair.to as usize / CHUNK] = true;
            }
        }
        for node in stale.records.iter().copied().chain(ends) {
            chosen[node as usize / CHUNK] = true;
        }
        chosen
    }
}
