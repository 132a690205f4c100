//! Right factors `I + A` of deformation gradients: `F = F(u) (I + A)` at nodes whose rows a cut rebuilt, and offsets of mean
//! volume ratios, `J̄ + B`, where the nodes that they are means over changed.

use std::ops::Range;

use glam::DMat3;

use crate::kernel::storage::bytes_of;
use crate::law::tensor::double_dot;

/// Offsets of a body; empty before the first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Prestrain {
    /// Per node; empty before the first.
    pub(crate) of_node: Vec<DMat3>,
    /// `B` per node; empty before the first.
    pub(crate) means: Vec<f64>,
    /// Nodes with an offset that is not zero, ascending.
    pub(crate) nodes: Vec<u32>,
    /// Changes of the last decay.
    pub(crate) decayed: Vec<(u32, Offset)>,
    /// What the nodes of that decay worked against at the state last evaluated, if somebody asked for it.
    pub(crate) pulls: Vec<(u32, Pull)>,
}

/// `A` and `B` of a node.
pub(crate) type Offset = (DMat3, f64);

/// `V`, `V p`, `P` and `F(u)` of a node: what the change of its offsets works against.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pull {
    pub(crate) volume: f64,
    pub(crate) pressure: f64,
    pub(crate) stress: DMat3,
    pub(crate) own: DMat3,
}

impl Pull {
    /// `V (P : F(u) dA + p dB) / 2`.
    pub(crate) fn half_work(&self, (change, mean): Offset) -> f64 {
        0.5 * (self.volume * double_dot(self.stress, self.own * change) + self.pressure * mean)
    }
}

impl Prestrain {
    /// `V P : A / 2` of a node, from `V P`: what the virtual work of the stresses with all of `F`
    /// counts too much.
    pub(crate) fn excess(&self, node: usize, stress: DMat3) -> f64 {
        0.5 * double_dot(stress, self.of(node))
    }

    /// A node's `A`.
    pub(crate) fn of(&self, node: usize) -> DMat3 {
        self.of_node.get(node).copied().unwrap_or(DMat3::ZERO)
    }

    /// Its `B`.
    pub(crate) fn mean(&self, node: usize) -> f64 {
        self.means.get(node).copied().unwrap_or(0.0)
    }

    /// Those of the nodes of a range that have an offset, ascending.
    #[inline(always)]
    pub(crate) fn among(&self, range: Range<usize>) -> &[u32] {
        if self.nodes.is_empty() {
            return &[];
        }
        let before = |end: usize| self.nodes.partition_point(|&node| (node as usize) < end);
        &self.nodes[before(range.start)..before(range.end)]
    }

    /// `I + A` of a node that has an offset.
    pub(crate) fn factor(&self, node: usize) -> Option<DMat3> {
        let offset = self.of_node.get(node)?;
        (*offset != DMat3::ZERO).then(|| DMat3::IDENTITY + *offset)
    }

    /// What an offset multiplies a node's part of the stiffness with: at least `|I + A|²`.
    pub(crate) fn gain(&self, node: usize) -> f64 {
        self.factor(node).map_or(1.0, |factor| {
            let sum = |m: DMat3| {
                let sums = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.abs().element_sum());
                sums.into_iter().fold(0.0, f64::max)
            };
            sum(factor) * sum(factor.transpose())
        })
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    pub(crate) fn set(&mut self, node_count: usize, node: u32, (offset, mean): Offset) {
        self.of_node.resize(node_count, DMat3::ZERO);
        self.of_node[node as usize] = offset;
        if mean != 0.0 {
            self.means.resize(node_count, 0.0);
        }
        if let Some(of_node) = self.means.get_mut(node as usize) {
            *of_node = mean;
        }
        let at = self.nodes.binary_search(&node);
        match (at, offset == DMat3::ZERO && mean == 0.0) {
            (Err(at), false) => self.nodes.insert(at, node),
            (Ok(at), true) => drop(self.nodes.remove(at)),
            _ => {}
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        bytes_of(&self.of_node)
            + bytes_of(&self.means)
            + bytes_of(&self.nodes)
            + bytes_of(&self.decayed)
            + bytes_of(&self.pulls)
    }
}
