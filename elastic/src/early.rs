//! Forces in two goes: what follows from the places of some nodes comes first, while those of others are still on
//! their way.

use std::ops::Range;

use glam::DVec3;

use crate::forces::{self, CHUNK, Stage};
use crate::model::{Elastic, with_table};
use crate::pairs::{Pair, Pairs};

/// What follows from the places of a range of nodes alone, in whole chunks; made by [`Elastic::early`].
#[derive(Debug, Clone)]
pub struct Early {
    /// The nodes.
    pub(crate) known: Range<usize>,
    /// Whether stresses of a chunk follow from their places.
    pub(crate) stresses: Vec<bool>,
    /// Whether its forces follow from those stresses.
    pub(crate) forces: Vec<bool>,
}

impl Early {
    fn new(pairs: &Pairs, known: Range<usize>) -> Self {
        let n = pairs.node_count();
        let chunks =
            || (0..n.div_ceil(CHUNK)).map(|chunk| chunk * CHUNK..(n.min((chunk + 1) * CHUNK)));
        let all = |row: &[Pair], holds: &dyn Fn(usize) -> bool| {
            row.iter().all(|pair| holds(pair.to as usize))
        };
        let is_known = |node: usize| known.contains(&node);
        let stresses = chunks()
            .map(|mut nodes| nodes.all(|node| is_known(node) && all(pairs.row(node), &is_known)));
        let stresses: Vec<bool> = stresses.collect();
        let has_stress = |node: usize| stresses[node / CHUNK];
        let forces = chunks().map(|mut nodes| {
            nodes.all(|node| has_stress(node) && all(pairs.incoming(node), &has_stress))
        });
        let forces = forces.collect();
        Self {
            known,
            stresses,
            forces,
        }
    }

    /// Nodes whose forces come first, bonds of weak nodes aside.
    #[must_use]
    pub fn node_count(&self) -> usize {
        let chunks = self.forces.iter().filter(|early| **early).count();
        chunks * CHUNK
    }
}

impl Elastic {
    /// Finds what can be evaluated before the places of nodes outside of a range are known. It holds until rows,
    /// of the graph or of the model, change.
    ///
    /// # Panics
    /// If there are no such nodes.
    #[must_use]
    pub fn early(&self, known: Range<usize>) -> Early {
        assert!(known.end <= self.node_count(), "nodes of the model");
        Early::new(&self.model.pairs, known)
    }

    /// First go of [`Elastic::forces_into`]: what follows from the places (m) of the known nodes; others are not
    /// read. With mean dilatation nothing does.
    ///
    /// # Panics
    /// If a slice is not as long as there are nodes.
    pub fn begin_forces(&mut self, early: &Early, positions: &[DVec3], forces: &mut [DVec3]) {
        if self.model.means.is_none() {
            self.evaluate(positions, forces, Stage::Begin(early));
        }
    }

    /// Second go, after [`Elastic::begin_forces`] with the same slices and the same places of the known nodes: what is
    /// left. Forces and the energy (J) that it returns are those of [`Elastic::forces_into`], to the bit.
    ///
    /// # Panics
    /// If a slice is not as long as there are nodes.
    pub fn finish_forces(
        &mut self,
        early: &Early,
        positions: &[DVec3],
        forces: &mut [DVec3],
    ) -> f64 {
        let whole = self.model.means.is_some();
        let stage = if whole {
            Stage::ALL
        } else {
            Stage::Finish(early)
        };
        self.evaluate(positions, forces, stage)
    }

    pub(crate) fn evaluate(
        &mut self,
        positions: &[DVec3],
        forces: &mut [DVec3],
        stage: Stage<'_>,
    ) -> f64 {
        let n = self.node_count();
        assert_eq!(positions.len(), n, "one position per node");
        assert_eq!(forces.len(), n, "one force per node");
        let parts = (&self.model, &mut self.state, &mut self.scratch);
        with_table!(&mut self.tables, table => forces::forces(parts, table, positions, forces, stage))
    }

    /// The first of the two passes of [`Elastic::forces_into`] alone, for benchmarks: `forces` is what the nodes' own rows
    /// give. [`Elastic::pass_two`] ends it.
    #[doc(hidden)]
    pub fn pass_one(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        let parts = (&self.model, &mut self.state, &mut self.scratch);
        with_table!(&mut self.tables, table => forces::pass_one(parts, table, positions, forces, Stage::ALL))
    }

    /// The second, which adds to `forces`.
    #[doc(hidden)]
    pub fn pass_two(&mut self, forces: &mut [DVec3]) -> f64 {
        let parts = (&self.model, &mut self.state, &mut self.scratch);
        with_table!(&mut self.tables, table => forces::pass_two(parts, table, forces, Stage::ALL))
    }
}
