//! Products with the stiffness of a part of the body, at a cost that follows the part.

use glam::{DMat3, DVec3};

use crate::cut::CutState;
use crate::cut::bond::PartBond;
use crate::cut::front::PartFront;
use crate::kernel::fixed::Either;
use crate::kernel::stale::Stale;
use crate::kernel::storage::set_gradient;
use crate::kernel::subset::Subset;
use crate::kernel::tangent;
use crate::model::Elastic;
use crate::stiffness::StiffNode;

/// Nodes that may move while all others are fixed; made by [`Elastic::part`].
#[derive(Debug, Clone)]
pub struct Part {
    pub(crate) subset: Subset,
    /// Bonds that its nodes are in.
    pub(crate) bonds: Vec<PartBond>,
    /// Fronts that its nodes are in.
    pub(crate) fronts: Vec<PartFront>,
    /// Where both end, ascending.
    pub(crate) ends: Vec<u32>,
}

impl Part {
    /// The nodes, ascending.
    #[must_use]
    pub fn nodes(&self) -> &[u32] {
        &self.subset.nodes
    }

    /// Nodes whose deformation gradients products within the part read, ascending.
    #[must_use]
    pub fn rows(&self) -> &[u32] {
        &self.subset.rows
    }

    /// Nodes whose positions they read, ascending: where bonds of deficient nodes end, and pairs of nodes beside a cut's front.
    #[must_use]
    pub fn ends(&self) -> &[u32] {
        &self.ends
    }
}

/// Products within some of the nodes, and what other processes have of them.
impl Elastic {
    /// Prepares products with the stiffness of some nodes, in any order, while all others are fixed.
    ///
    /// # Panics
    /// If a node does not exist.
    #[must_use]
    pub fn part(&self, nodes: &[u32]) -> Part {
        let subset = Subset::new(&self.model.pairs, nodes);
        let CutState { bonds, fronts, .. } = &self.cut;
        let (of_bonds, of_fronts) = (bonds.of_part(&subset.nodes), fronts.of_part(&subset.nodes));
        let mut ends = bonds.ends_of(&of_bonds);
        ends.extend(fronts.ends_of(&of_fronts));
        ends.sort_unstable();
        ends.dedup();
        Part {
            subset,
            bonds: of_bonds,
            fronts: of_fronts,
            ends,
        }
    }

    /// The part of stiff nodes with two rings of neighbours each, and a vector, one entry per node of the part, where the
    /// search of its largest eigenvalue starts: each stiff node along its direction, against its neighbours by their weights.
    ///
    /// # Panics
    /// If a node does not exist.
    #[must_use]
    pub fn part_around(&self, stiffest: &[StiffNode]) -> (Part, Vec<DVec3>) {
        let pairs = &self.model.pairs;
        let ring = |node: u32| pairs.row(node as usize).iter().map(|pair| pair.to);
        let around = stiffest.iter().flat_map(|stiff| {
            let rings = ring(stiff.node).flat_map(|near| ring(near).chain([near]));
            rings.chain([stiff.node])
        });
        let part = self.part(&around.collect::<Vec<_>>());
        let mut start = vec![DVec3::ZERO; part.nodes().len()];
        let mut add = |node: u32, value: DVec3| {
            if let Ok(at) = part.nodes().binary_search(&node) {
                start[at] += value;
            }
        };
        for stiff in stiffest {
            let row = pairs.row(stiff.node as usize);
            let sum: f64 = row.iter().map(|pair| f64::from(pair.weight)).sum();
            add(stiff.node, stiff.direction);
            for pair in row.iter().filter(|pair| pair.weight > 0.0) {
                add(pair.to, -stiff.direction * (f64::from(pair.weight) / sum));
            }
        }
        (part, start)
    }

    /// Adopts what products within a part read, as another model of the same nodes evaluated it:
    /// deformation gradients of [`Part::rows`] and positions (m) of [`Part::ends`]. What was evaluated here
    /// before is no longer of one state, until the next [`Elastic::forces_into`]. What mean dilatation and
    /// viscous materials need besides is not reported.
    ///
    /// # Panics
    /// If a slice is not as long as there are such nodes, or the part is another model's.
    pub fn set_part_state(&mut self, part: &Part, gradients: &[DMat3], positions: &[DVec3]) {
        assert_eq!(gradients.len(), part.rows().len(), "one gradient per row");
        assert_eq!(positions.len(), part.ends.len(), "one place per end");
        for (&node, &gradient) in part.rows().iter().zip(gradients) {
            set_gradient(&mut self.tables.deformation, node as usize, gradient);
        }
        let place = |node: u32| {
            let end = part.ends.binary_search(&node);
            end.map_or(DVec3::ZERO, |at| positions[at])
        };
        self.cut.bonds.set_part(&part.bonds, place);
        let rest = &self.model.rest;
        let displacement = |node: u32| place(node) - rest[node as usize];
        self.cut.fronts.set_part(&part.fronts, displacement);
        self.scratch.stale = Stale::everything();
    }

    /// Writes the part's rows of `K v`, see [`Elastic::tangent_product_into`], with `v` zero outside of
    /// the part. The largest eigenvalue of what this gives is never above that of the whole.
    ///
    /// The time follows the part, but for a body with mean dilatation, where it is that of the whole.
    ///
    /// # Panics
    /// If a slice is not as long as there are nodes in the part, or the part is another model's.
    pub fn tangent_product_within(&mut self, part: &Part, vector: &[DVec3], product: &mut [DVec3]) {
        let n = part.nodes().len();
        assert_eq!(vector.len(), n, "one vector per node");
        assert_eq!(product.len(), n, "one product per node");
        let parts = (&self.model, &self.state, &mut self.scratch);
        let subset = &part.subset;
        match self.tables.split() {
            Either::Plain(table) => tangent::product_within(parts, table, subset, vector, product),
            Either::Corrected(table) => {
                tangent::product_within(parts, table, subset, vector, product);
            }
        }
        let CutState { bonds, fronts, .. } = &self.cut;
        fronts.add_product_within(&part.fronts, vector, product);
        bonds.add_product_within(&part.bonds, vector, product);
        let stale = &mut self.scratch.stale;
        stale.add_part(subset, self.model.means.is_some());
    }
}
