//! Products with the stiffness of a part of the body, at a cost that follows the part.

use glam::DVec3;

use crate::bond::PartBond;
use crate::evaluate;
use crate::front;
use crate::kernel::Lanes;
use crate::model::{Elastic, with_table};
use crate::rows::Rows;

/// Nodes that may move while all others are held; made by [`Elastic::part`].
#[derive(Debug, Clone)]
pub struct Part {
    /// The nodes, rising.
    pub(crate) nodes: Vec<u32>,
    /// They and all nodes whose rows they appear in, rising.
    pub(crate) rows: Vec<u32>,
    /// Those and all their neighbours.
    pub(crate) seen: Vec<u32>,
    /// Bonds that its nodes are in.
    pub(crate) bonds: Vec<PartBond>,
}

impl Part {
    /// The nodes, rising.
    #[must_use]
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    fn new<L: Lanes>(rows: &Rows<L>, nodes: &[u32]) -> Self {
        let sorted = |mut nodes: Vec<u32>| {
            nodes.sort_unstable();
            nodes.dedup();
            nodes
        };
        let nodes = sorted(nodes.to_vec());
        let with = |nodes: &[u32], others: &dyn Fn(usize) -> Vec<u32>| {
            let more = nodes.iter().flat_map(|&node| others(node as usize));
            sorted(nodes.iter().copied().chain(more).collect())
        };
        let reading = with(&nodes, &|node| rows.incoming(node).indices.to_vec());
        let seen = with(&reading, &|node| rows.row(node).indices.to_vec());
        Self {
            nodes,
            rows: reading,
            seen,
            bonds: Vec::new(),
        }
    }
}

impl Elastic {
    /// Prepares products with the stiffness of some nodes, in any order, while all others are held.
    ///
    /// # Panics
    /// If a node does not exist.
    #[must_use]
    pub fn part(&self, nodes: &[u32]) -> Part {
        let part = with_table!(&self.pairs, table => Part::new(&table.rows, nodes));
        part.with_bonds(&self.body)
    }

    /// Writes the part's rows of `K v`, see [`Elastic::tangent_product_into`], with `v` zero outside of
    /// the part. The largest eigenvalue of what this gives is never above that of the whole.
    ///
    /// The time follows the part, but for a body with mean dilatation, where it is that of the whole.
    ///
    /// # Panics
    /// If a slice is not as long as there are nodes in the part, or the part is another model's.
    pub fn tangent_product_within(&mut self, part: &Part, vector: &[DVec3], product: &mut [DVec3]) {
        assert_eq!(vector.len(), part.nodes.len(), "one vector per node");
        assert_eq!(product.len(), part.nodes.len(), "one product per node");
        let body = &mut self.body;
        with_table!(&mut self.pairs, table => {
            evaluate::tangent_product_within(body, table, part, vector, product);
        });
        body.bonds.add_product_within(&part.bonds, vector, product);
        let place = |node: u32| part.nodes.binary_search(&node);
        front::add_product(
            body,
            |node| part.rows.binary_search(&node).is_ok(),
            |node| place(node).map_or(DVec3::ZERO, |at| vector[at]),
            |node, p| {
                if let Ok(at) = place(node) {
                    product[at] += p;
                }
            },
        );
    }
}
