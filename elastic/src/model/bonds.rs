//! Deficient nodes of a model.

use glam::DVec3;

use super::Elastic;
use crate::cut::bond::{Bond, LEAST_SUM, STIFFNESS, begun, kept};
use crate::kernel::pairs::Pair;
use crate::kernel::row::refresh_control;

impl Elastic {
    /// Takes the strain energy and its hourglass stabilization from `nodes`, for good, and puts a bond
    /// along each pair that is left of them (see the module's head in the source). Named again, a
    /// node's bonds follow `share`: the fraction of pair `k` (in the order of the rows) that cuts left,
    /// 0 for a severed one. `positions` (m) are the present ones.
    ///
    /// At the positions given, the energy does not rise: bonds begin with at most what the node's
    /// strain held. [`Elastic::decay`] then lets them go to their rest lengths. Returns what the energy lost (J),
    /// control aside.
    ///
    /// # Panics
    /// If a node does not exist or `positions` is not one per node.
    pub fn weaken(
        &mut self,
        nodes: &[u32],
        positions: &[DVec3],
        share: &dyn Fn(usize) -> f64,
    ) -> f64 {
        let energy = |bonds: &[Bond]| bonds.iter().map(Bond::energy).sum::<f64>();
        let mut lost = 0.0;
        assert_eq!(positions.len(), self.node_count(), "one position per node");
        self.scratch.stale.add(nodes);
        let mut bonds = std::mem::take(&mut self.cut.bonds);
        for &node in nodes {
            let held = self.weaken_one(node as usize);
            let row = self.bonds_of(node as usize, positions, share);
            let from = bonds.list.partition_point(|bond| bond.node < node);
            let to = bonds.list.partition_point(|bond| bond.node <= node);
            let known = bonds.nodes.binary_search(&node);
            let row = match known {
                Ok(_) => kept(row, &bonds.list[from..to]),
                Err(at) => {
                    bonds.nodes.insert(at, node);
                    begun(row, held)
                }
            };
            lost += held + energy(&bonds.list[from..to]) - energy(&row);
            bonds.list.splice(from..to, row);
        }
        bonds.find_hosts();
        self.cut.bonds = bonds;
        self.refresh_fronts();
        lost
    }

    /// Takes a node's strain energy; what it held (J) at the state last evaluated.
    fn weaken_one(&mut self, node: usize) -> f64 {
        let f = self.deformation_gradient(node);
        let (model, viscosity) = (&mut self.model, self.state.viscosity.as_ref());
        let (mut energy, _) = model.energy_and_stress(viscosity, node, f);
        if let (Some(means), Some(pressures)) = (&model.means, &self.state.pressures) {
            let law = means.law(model.material_index(node));
            energy += law.at(pressures.means[node])[0];
        }
        let held = model.elastic_volumes[node] * energy;
        model.elastic_volumes[node] = 0.0;
        refresh_control(model, &mut self.tables, &[node]);
        held.max(0.0)
    }

    fn bonds_of(
        &self,
        node: usize,
        positions: &[DVec3],
        share: &dyn Fn(usize) -> f64,
    ) -> Vec<Bond> {
        let model = &self.model;
        let row = model.pairs.row(node);
        #[allow(clippy::cast_precision_loss, reason = "a node has few neighbours")]
        let count = row.len() as f64;
        let sum: f64 = model.pairs.range(node).map(share).sum();
        let whole = STIFFNESS * model.material(node).lame_mu() * model.volumes[node] / count;
        let modulus = whole * (LEAST_SUM / sum).max(1.0);
        let pairs = model.pairs.range(node).zip(row);
        let left = pairs.filter(|(at, _)| share(*at) > 0.0);
        let bond = |(at, pair): (usize, &Pair)| {
            let other = pair.to as usize;
            let ends = [u32::try_from(node).unwrap_or(u32::MAX), pair.to];
            let rest_squared = (model.rest[other] - model.rest[node]).length_squared();
            let stiffness = modulus * share(at) / rest_squared;
            let x = positions[other] - positions[node];
            Bond::new(ends, stiffness, rest_squared, x)
        };
        left.map(bond).collect()
    }

    /// Nodes at the ends of bonds, in no order.
    pub fn bond_ends(&self) -> impl Iterator<Item = u32> + '_ {
        self.cut.bonds.ends()
    }

    /// Multiplies the offsets of all bonds with `factor` (0 to 1); `works` gets the deficient node and the first half of the
    /// work (J) of each, nodes ascending.
    pub(crate) fn decay_bonds(&mut self, factor: f64, works: &mut Vec<(u32, f64)>) {
        works.clear();
        let bonds = self.cut.bonds.list.iter_mut();
        works.extend(bonds.map(|bond| (bond.node, bond.decay(factor))));
    }

    /// The second halves, at the state last evaluated.
    pub(crate) fn bond_works(&self, works: &mut Vec<(u32, f64)>) {
        works.clear();
        let bonds = self.cut.bonds.list.iter();
        works.extend(bonds.map(|bond| (bond.node, bond.decay_work())));
    }

    /// Deficient nodes, ascending.
    #[must_use]
    pub fn deficient_nodes(&self) -> &[u32] {
        &self.cut.bonds.nodes
    }

    /// Deficient nodes that hang on no valid one, not even by others: debris.
    #[must_use]
    pub fn loose_nodes(&self) -> usize {
        let hosts = self.cut.bonds.hosts.iter();
        hosts.filter(|(_, hosts)| hosts.is_empty()).count()
    }

    /// Offsets (m) of all bonds.
    pub(crate) fn bond_offsets(&self) -> Vec<f64> {
        self.cut.bonds.list.iter().map(|bond| bond.offset).collect()
    }

    /// Restores them on the same bonds.
    pub(crate) fn set_bond_offsets(&mut self, offsets: &[f64]) {
        let list = &mut self.cut.bonds.list;
        assert_eq!(list.len(), offsets.len(), "one offset per bond");
        for (bond, &offset) in list.iter_mut().zip(offsets) {
            bond.offset = offset;
            bond.decayed = 0.0;
        }
    }
}
