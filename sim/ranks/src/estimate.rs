//! The largest eigenvalue where the nodes are, and what its search around the stiffest of them reads.

use std::time::Instant;

use glam::DVec3;
use phyxel_elastic::{StiffNode, WATCHED_NODES};
use phyxel_integrate::{
    Eigenvalue, EigenvalueError, EigenvalueSettings, EigenvalueShare, largest_eigenvalue_of_share,
};

use crate::share::Share;
use crate::wire::{Wire, sum_in_order};

/// Numbers that tell of a stiff node.
pub(crate) const STIFF: usize = 5;
/// Numbers of a deformation gradient.
pub(crate) const GRADIENT: usize = 9;

impl Share {
    /// The rank's part of an estimate from `vector`, whose end it leaves there; all ranks take part at once and find
    /// the same, or fail at once.
    pub(crate) fn estimate(
        &mut self,
        wire: &mut Wire,
        settings: &EigenvalueSettings,
        vector: &mut Vec<DVec3>,
    ) -> Result<Eigenvalue, EigenvalueError> {
        self.evaluate_if_due(wire);
        let start = Instant::now();
        let own = self.own();
        let (package, elastic) = (&self.package, &mut self.elastic);
        let mut moves = vec![DVec3::ZERO; package.rest.len()];
        let mut products = moves.clone();
        let found = largest_eigenvalue_of_share(
            &EigenvalueShare {
                first: package.start,
                masses: self.motion.masses(),
                supports: self.motion.supports(),
            },
            |v, product| {
                moves[own.clone()].copy_from_slice(v);
                wire.exchange(package, &mut moves);
                elastic.tangent_product_into(&moves, &mut products);
                product.copy_from_slice(&products[own.clone()]);
            },
            |parts| sum_in_order(parts, &package.chunks),
            vector,
            settings,
        );
        self.in_estimates += start.elapsed();
        found
    }

    /// Own node, counted in the body, at which an estimate failed, infinite if it failed elsewhere.
    pub(crate) fn bad_node(&self, error: &EigenvalueError) -> f64 {
        let end = self.package.start + self.package.count;
        match error {
            EigenvalueError::NotFinite { node } if *node < end => {
                f64::from(crate::package::number(*node))
            }
            _ => f64::INFINITY,
        }
    }

    /// The stiffest own nodes, of all or of some of the body's runs of nodes, as numbers: so many of them, the node -1
    /// where there are no more.
    pub(crate) fn stiffest(
        &mut self,
        wire: &mut Wire,
        count: usize,
        runs: Option<&[f64]>,
    ) -> Vec<f64> {
        self.evaluate_if_due(wire);
        let own = self.own();
        let (first, start) = (own.start, self.package.start);
        let mine = first / WATCHED_NODES..own.end.div_ceil(WATCHED_NODES);
        let local = |run: &f64| {
            let from = (whole(*run) * WATCHED_NODES).checked_sub(start)?;
            Some((first + from) / WATCHED_NODES).filter(|run| mine.contains(run))
        };
        let mine = match runs {
            None => mine.collect(),
            Some(runs) => runs.iter().filter_map(local).collect::<Vec<_>>(),
        };
        let found = self.elastic.stiffest_nodes(count, Some(&mine));
        let own = found
            .iter()
            .filter(|stiff| own.contains(&(stiff.node as usize)));
        let mut told: Vec<f64> = own
            .flat_map(|stiff| {
                let node = start + stiff.node as usize - first;
                let [x, y, z] = stiff.direction.to_array();
                [
                    f64::from(crate::package::number(node)),
                    stiff.indicator,
                    x,
                    y,
                    z,
                ]
            })
            .collect();
        told.resize(STIFF * count, -1.0);
        told
    }

    /// Deformation gradients of own ones among the first `gradients` nodes of a list, and positions (m) of own ones among
    /// the rest.
    pub(crate) fn read(&mut self, wire: &mut Wire, nodes: &[f64], gradients: usize) -> Vec<f64> {
        self.evaluate_if_due(wire);
        let (own, start) = (self.own(), self.package.start);
        let at = |node: &f64| {
            let at = whole(*node).checked_sub(start)?;
            (at < own.len()).then_some(at)
        };
        let (rows, ends) = nodes.split_at(gradients);
        let rows = rows.iter().filter_map(at);
        let mut told: Vec<f64> = rows
            .flat_map(|node| {
                let gradient = self.elastic.deformation_gradient(own.start + node);
                gradient.to_cols_array()
            })
            .collect();
        let ends = ends.iter().filter_map(at);
        told.extend(ends.flat_map(|node| self.motion.positions()[node].to_array()));
        told
    }
}

/// The stiffest of those that ranks reported, as [`Share::stiffest`] does.
pub(crate) fn stiffest_of(told: &[f64], count: usize) -> Vec<StiffNode> {
    let (nodes, _) = told.as_chunks::<STIFF>();
    let mut nodes: Vec<StiffNode> = (nodes.iter().filter(|[node, ..]| *node >= 0.0))
        .map(|&[node, indicator, x, y, z]| StiffNode {
            node: crate::package::number(whole(node)),
            indicator,
            direction: DVec3::new(x, y, z),
        })
        .collect();
    nodes.sort_by(|a, b| (b.indicator.total_cmp(&a.indicator)).then(a.node.cmp(&b.node)));
    nodes.truncate(count);
    nodes
}

/// A count that travelled as a number.
pub(crate) fn whole(number: f64) -> usize {
    number as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stiffest_of_all_ranks_are_in_order_and_ties_go_to_the_first() {
        let told = [
            [7.0, 5.0, 1.0, 0.0, 0.0],
            [3.0, 5.0, 0.0, 1.0, 0.0],
            [-1.0; 5],
            [12.0, 9.0, 0.0, 0.0, 1.0],
            [11.0, 1.0, 0.0, 0.0, 1.0],
        ];
        let found = stiffest_of(&told.concat(), 3);
        let nodes: Vec<u32> = found.iter().map(|stiff| stiff.node).collect();
        assert_eq!(nodes, [12, 3, 7]);
        assert_eq!(found[1].direction, DVec3::Y);
    }
}
