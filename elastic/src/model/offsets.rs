//! Deformation gradients that are kept over a rebuild of rows.
//!
//! A row of full support does not see its own node's hourglass displacement; the one-sided row that
//! a cut leaves reads it as strain, and energy appears out of nothing. So a rebuilt row keeps the
//! deformation gradient that the node had: `F = F(u) (I + A)`, `A = F_after⁻¹ F_before - I`, and `A`
//! decays. The factor stands on the side of the material: a rotation `Q` of the whole makes
//! `Q F(u) (I + A)`, so forces `V P (I + A)ᵀ g` keep the angular momentum, which those of a sum
//! `F(u) + D` do not. The energy that the decay adds or takes is `∫ V P : F(u) dA`, by the trapezoidal
//! rule over a step.

use glam::{DMat3, DVec3};

use super::Elastic;
use crate::kernel::fixed::Tables;
use crate::kernel::nodes::Model;
use crate::kernel::prestrain::{Prestrain, Pull};
use crate::kernel::stale::Stale;
use crate::kernel::storage::{parallel, share_out};
use crate::law::tensor::outer;

/// Entries of an offset below this are dropped: a strain of `1e-5` is a stress of `1e-5` of the
/// modulus, and what dropping it adds to the energy is counted like the decay.
const SMALLEST_OFFSET: f64 = 1e-5;
/// Largest `|I + A|` and `|(I + A)⁻¹|` (Frobenius). The first multiplies what a node adds to the stiffness by its
/// square: a row that sees the body all but flat where it was not cannot keep its gradient. Nor can one that sees it
/// blown up, by the second: the decay would do that as work (a node of a strand drawn out 60-fold, read with det F 51,
/// got 22 J where the body stored 12). Of 2, 3, 5 and 8 for the first (no change is 1.7), 3 exceeded the fewest limits in
/// `benches -- matrix` (13 scenes of 48; 2: 18, 5: 16) and none in `random --seed 4045 --count 24` (8: one scene not ended).
const LARGEST_FACTOR: f64 = 3.0;
/// Nodes whose work a thread finds at least: some 10 µs.
const NODES_PER_TASK: usize = 64;
/// Changes of mean volume ratios up to this are round-off.
const ROUND_OFF: f64 = 1e-13;

impl Elastic {
    /// Keeps the deformation gradients that `nodes` had before [`Elastic::update_rows`] rebuilt their rows:
    /// `F = F(u) (I + A)` with `A = F(u)⁻¹ before - I` where `u` are the
    /// displacements to `positions` (m). Nodes without a full row, or that [`Elastic::lost_gradients`]
    /// names, get no such factor, and lose one that they had.
    ///
    /// # Panics
    /// If the slices' lengths do not fit or a node does not exist.
    pub(crate) fn retain_gradients(
        &mut self,
        nodes: &[u32],
        before: &[DMat3],
        positions: &[DVec3],
    ) {
        assert_eq!(nodes.len(), before.len(), "one gradient per node");
        assert_eq!(positions.len(), self.node_count(), "one position per node");
        self.scratch.stale.add(nodes);
        for (&node, &before) in nodes.iter().zip(before) {
            let (_, factor) = self.factor_of(node as usize, before, positions);
            let offset = factor.map_or(DMat3::ZERO, |all| all - DMat3::IDENTITY);
            let (count, prestrain) = (self.node_count(), &mut self.state.prestrain);
            let mean = prestrain.mean(node as usize);
            prestrain.set(count, node, (offset, mean));
        }
    }

    /// Whether the row of a node is full, and `I + A` by which it then keeps `before`, if it can.
    fn factor_of(&self, node: usize, before: DMat3, positions: &[DVec3]) -> (bool, Option<DMat3>) {
        let model = &self.model;
        let full = model.ranks[node] == 3 && model.elastic_volumes[node] > 0.0;
        let now = full.then(|| gradient_at(model, &self.tables, node, positions));
        (full, now.and_then(|now| factor_between(now, before)))
    }

    /// Keeps the mean volume ratios that nodes had `before` their means were taken over others, by an evaluation at
    /// `positions` (m).
    pub(crate) fn retain_means(&mut self, before: &[f64], positions: &[DVec3]) {
        self.forces_into(positions, &mut vec![DVec3::ZERO; positions.len()]);
        let (model, prestrain) = (&self.model, &mut self.state.prestrain);
        let Some(pressures) = &self.state.pressures else {
            return;
        };
        for (node, (before, now)) in (0_u32..).zip(before.iter().zip(&pressures.means)) {
            let at = node as usize;
            if (before - now).abs() > ROUND_OFF && model.elastic_volumes[at] > 0.0 {
                let offset = (prestrain.of(at), prestrain.mean(at) + before - now);
                prestrain.set(model.node_count(), node, offset);
                self.scratch.stale.add(&[node]);
            }
        }
    }

    /// Those of `nodes` whose rebuilt full rows cannot keep the gradients `before`: they see the body at
    /// `positions` (m) all but flat, blown up, inverted or not at all where it was not, so that `I + A` or its inverse
    /// has a Frobenius norm above 3 (that of no change is 1.7).
    ///
    /// # Panics
    /// As [`Elastic::retain_gradients`].
    pub(crate) fn lost_gradients(
        &self,
        nodes: &[u32],
        before: &[DMat3],
        positions: &[DVec3],
    ) -> Vec<u32> {
        assert_eq!(nodes.len(), before.len(), "one gradient per node");
        assert_eq!(positions.len(), self.node_count(), "one position per node");
        let lost = nodes.iter().zip(before).filter(|&(&node, &before)| {
            self.factor_of(node as usize, before, positions) == (true, None)
        });
        lost.map(|(&node, _)| node).collect()
    }

    /// Multiplies every offset with `factor` (0 to 1); `works` gets the first half of the work (J) of each node,
    /// ascending.
    pub(crate) fn decay_offsets(&mut self, factor: f64, works: &mut Vec<(u32, f64)>) {
        let nodes = std::mem::take(&mut self.state.prestrain.nodes);
        let mut pulls = std::mem::take(&mut self.state.prestrain.pulls);
        if self.scratch.stale.is_some() || !of_same_nodes(&mut pulls, &nodes) {
            self.pulls_into(&nodes, &mut pulls);
        }
        self.scratch.stale.add(&nodes);
        let Prestrain {
            of_node,
            means,
            nodes: left,
            decayed,
            pulls: kept,
        } = &mut self.state.prestrain;
        decayed.clear();
        works.clear();
        for (node, pull) in &pulls {
            let at = *node as usize;
            let (offset, mean) = (of_node[at], means.get(at).copied().unwrap_or(0.0));
            let mut next = (offset * factor, mean * factor);
            let size = (next.0.to_cols_array().iter()).fold(next.1.abs(), |m, v| m.max(v.abs()));
            if size < SMALLEST_OFFSET {
                next = (DMat3::ZERO, 0.0);
            } else {
                left.push(*node);
            }
            let change = (next.0 - offset, next.1 - mean);
            works.push((*node, pull.half_work(change)));
            of_node[at] = next.0;
            if let Some(mean) = means.get_mut(at) {
                *mean = next.1;
            }
            decayed.push((*node, change));
        }
        pulls.clear();
        *kept = pulls;
    }

    /// The second halves, with the stresses last evaluated; to be asked for once.
    pub(crate) fn offset_works(&mut self, works: &mut Vec<(u32, f64)>) {
        let mut decayed = std::mem::take(&mut self.state.prestrain.decayed);
        let nodes: Vec<u32> = decayed.iter().map(|(node, _)| *node).collect();
        let mut pulls = std::mem::take(&mut self.state.prestrain.pulls);
        self.pulls_into(&nodes, &mut pulls);
        let halves = decayed.iter().zip(&pulls);
        works.clear();
        works.extend(halves.map(|(&(node, change), (_, pull))| (node, pull.half_work(change))));
        decayed.clear();
        self.state.prestrain.decayed = decayed;
        self.state.prestrain.pulls = pulls;
    }

    /// What changes of the offsets of nodes work against, at the state last evaluated.
    fn pulls_into(&self, nodes: &[u32], pulls: &mut Vec<(u32, Pull)>) {
        let pull = |node: u32| {
            let at = node as usize;
            let factor = self.state.prestrain.factor(at);
            let f = self.deformation_gradient(at);
            Pull {
                volume: self.model.elastic_volumes[at],
                pressure: (self.state.pressures.as_ref())
                    .map_or(0.0, |all| all.pressures[at] * self.model.volumes[at]),
                stress: self.first_piola_kirchhoff(at),
                own: factor.map_or(f, |factor| f * factor.inverse()),
            }
        };
        pulls.clear();
        pulls.extend(nodes.iter().map(|&node| (node, Pull::default())));
        let parallel = nodes.len() > NODES_PER_TASK && parallel(self.model.node_count());
        share_out(parallel, pulls.chunks_mut(NODES_PER_TASK), |_, pulls| {
            for (node, value) in pulls {
                *value = pull(*node);
            }
        });
    }

    /// Offsets, `A` by columns and `B`, of nodes that have one, ascending.
    pub(crate) fn offsets(&self) -> Vec<(u32, ([f64; 9], f64))> {
        let prestrain = &self.state.prestrain;
        let value = |&node: &u32| {
            let at = node as usize;
            (node, (prestrain.of(at).to_cols_array(), prestrain.mean(at)))
        };
        prestrain.nodes.iter().map(value).collect()
    }

    /// Restores them.
    pub(crate) fn set_offsets(&mut self, offsets: &[(u32, ([f64; 9], f64))]) {
        let n = self.node_count();
        self.state.prestrain = Prestrain::default();
        self.scratch.stale = Stale::everything();
        for (node, (value, mean)) in offsets {
            let prestrain = &mut self.state.prestrain;
            prestrain.set(n, *node, (DMat3::from_cols_array(value), *mean));
        }
    }
}

/// Keeps the pulls of some nodes, ascending; whether all of them are there.
fn of_same_nodes(pulls: &mut Vec<(u32, Pull)>, nodes: &[u32]) -> bool {
    let mut next = nodes.iter().peekable();
    pulls.retain(|(node, _)| next.next_if_eq(&node).is_some());
    pulls.len() == nodes.len()
}

/// `I + A` by which a row that gives `now` keeps `before`; `None` where it is too large.
fn factor_between(now: DMat3, before: DMat3) -> Option<DMat3> {
    let factor = now.inverse() * before;
    let is_small = |m: DMat3| {
        let square: f64 = m.to_cols_array().iter().map(|v| v * v).sum();
        square <= LARGEST_FACTOR * LARGEST_FACTOR
    };
    (factor.determinant() > 0.0 && is_small(factor) && is_small(factor.inverse())).then_some(factor)
}

/// `I + sum_j u_ij ⊗ g_ij` of a node with a full row, without its offset.
fn gradient_at(model: &Model, tables: &Tables, node: usize, positions: &[DVec3]) -> DMat3 {
    let displacement = |i: usize| positions[i] - model.rest[i];
    let own = displacement(node);
    let row = tables.row(node, model.pairs.row(node));
    row.fold(DMat3::IDENTITY, |f, (j, _, _, g)| {
        f + outer(displacement(j as usize) - own, g)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_are_kept_by_rows_that_see_much_the_same() {
        let before =
            DMat3::from_diagonal(DVec3::new(60.0, 0.13, 0.13)) * DMat3::from_rotation_z(0.4);
        let seen = |by: DVec3| factor_between(before * DMat3::from_diagonal(by), before);
        let kept = seen(DVec3::new(1.2, 0.8, 0.9)).expect("kept");
        let expected = DVec3::new(1.2, 0.8, 0.9).recip();
        assert!((kept - DMat3::from_diagonal(expected)).abs_diff_eq(DMat3::ZERO, 1e-12));
        for (axis, by) in [(2, 0.3), (0, 3.0), (1, 0.0), (2, -1.0)] {
            let mut lost = DVec3::ONE;
            lost[axis] = by;
            assert_eq!(seen(lost), None, "{lost}");
        }
    }
}
