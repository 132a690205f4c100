//! What of nodes does not change in a step.

use crate::supports::BoundaryConditions;
use glam::DVec3;

/// How easily nodes move.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mobility {
    /// Inverse masses (1/kg), 0 where a node is fixed in all directions.
    pub(crate) inverse: Vec<f64>,
    /// Nodes fixed in some directions only, ascending.
    partly: Vec<u32>,
}

impl Mobility {
    pub(crate) fn new(masses: &[f64], supports: &BoundaryConditions) -> Self {
        let mut inverse: Vec<f64> = masses.iter().map(|m| m.recip()).collect();
        let mut partly = Vec::new();
        for support in supports.entries() {
            if support.free == glam::DMat3::ZERO {
                inverse[support.node as usize] = 0.0;
            } else {
                partly.push(support.node);
            }
        }
        partly.sort_unstable();
        Self { inverse, partly }
    }

    /// Bytes for all nodes, and for partly fixed ones.
    pub(crate) fn bytes(&self) -> [usize; 2] {
        [size_of_val(&*self.inverse), size_of_val(&*self.partly)]
    }

    /// Takes the fixed parts out of the vectors of the nodes from `first` on.
    pub(crate) fn project(
        &self,
        supports: &BoundaryConditions,
        first: usize,
        vectors: &mut [DVec3],
    ) {
        let from = self.partly.partition_point(|&node| (node as usize) < first);
        for &node in &self.partly[from..] {
            let Some(vector) = vectors.get_mut(node as usize - first) else {
                break;
            };
            if let Some(support) = supports.of(node as usize) {
                *vector = support.free * *vector;
            }
        }
    }
}

/// What does not change in a step: masses, what holds nodes, and constant forces on them.
#[derive(Debug, Clone)]
pub(crate) struct NodeConstants {
    /// (kg).
    pub(crate) masses: Vec<f64>,
    pub(crate) mobility: Mobility,
    pub(crate) supports: BoundaryConditions,
    /// (N); empty without any.
    pub(crate) loads: Vec<DVec3>,
}

impl NodeConstants {
    pub(crate) fn new(masses: &[f64], supports: BoundaryConditions) -> Self {
        Self {
            masses: masses.to_vec(),
            mobility: Mobility::new(masses, &supports),
            supports,
            loads: Vec::new(),
        }
    }

    pub(crate) fn set_supports(&mut self, supports: BoundaryConditions) {
        self.mobility = Mobility::new(&self.masses, &supports);
        self.supports = supports;
    }
}
