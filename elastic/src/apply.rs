//! What a cut does to a model, in one call.

use std::fmt;

use glam::{DMat3, DVec3};

use crate::cut::Uncut;
use crate::error::ElasticError;
use crate::input::Stencils;
use crate::kernel::completion::condition;
use crate::kernel::fixed::Moments;
use crate::model::Elastic;

/// What a cut has changed, as plain data.
pub struct CutInput<'a> {
    /// Nodes whose rows changed, ascending: both ends of each pair that was weakened.
    pub touched: &'a [u32],
    /// Rebuilt stencils on the graph of the start; only touched rows are read.
    pub stencils: &'a Stencils<'a>,
    /// Fraction that cuts so far left of pair `k`, in the order of the rows: 1 whole, 0 severed.
    pub left: &'a dyn Fn(usize) -> f64,
    /// Per touched node the mean of `ν νᵀ` over the outward conormals `ν`, in the rest state, with which the cut ends
    /// beside it; zero where it does not. Empty: fronts are not stabilized.
    pub fronts: &'a [DMat3],
    /// Positions (m) of all nodes.
    pub positions: &'a [DVec3],
}

impl fmt::Debug for CutInput<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = f.debug_struct("CutInput");
        text.field("touched", &self.touched).finish_non_exhaustive()
    }
}

/// When a node loses its strain energy to bonds, and how much stabilization rises. The default is what scenes use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CutPolicy {
    /// A touched node that a cut left fewer neighbours has no strain of its own any more. By the condition alone mode II of a
    /// crack of 4 spacings is nearer by work (0.996, 1.01 for 1.01, 1.04), mode I farther (0.885, 0.897 for 0.892, 0.904).
    pub fewest_neighbors: usize,
    /// Nor has one whose moment matrix has a larger condition (largest over smallest eigenvalue), if cuts made it worse.
    pub largest_condition: f64,
    /// Scale of the stabilization of touched nodes, whose rows see less, as far as what the cut takes pays for it. With 1 mode I
    /// is nearer (0.903, 0.925), but what a cut of 400 nodes releases depends on its mirror image by 4 % (`prove invariance`).
    pub touched_control: f64,
}

impl Default for CutPolicy {
    fn default() -> Self {
        Self {
            fewest_neighbors: 6,
            largest_condition: 5.0,
            touched_control: 3.0,
        }
    }
}

/// What a cut did to the energy (J) at the positions given.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct CutEnergy {
    /// Change of strain energy and bonds: at most 0.
    pub strain: f64,
    /// Change of what stabilization holds.
    pub stabilization: f64,
}

impl CutEnergy {
    /// Change of the whole.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.strain + self.stabilization
    }
}

impl Elastic {
    /// Applies a cut: takes the rebuilt rows, keeps the deformation gradients that nodes had, gives bonds to nodes that
    /// are left without a strain of their own, and raises stabilization by no more than the cut released, or lowers what
    /// earlier cuts raised of it. Retained gradients and bonds then go away by [`Elastic::decay`]. Volumes, masses and
    /// materials stay.
    ///
    /// # Errors
    /// [`ElasticError`] as in [`Elastic::new`]. The model then holds some new rows and must not be used.
    ///
    /// # Panics
    /// If a node does not exist, the slices do not fit together, or multipliers come or go.
    ///
    /// # Numerics
    /// Evaluates the body first if the last evaluation was elsewhere. Evaluate it again before the next tangent
    /// product ([`Elastic::forces_again`] does so at the cost of what changed).
    pub fn apply_cut(
        &mut self,
        input: &CutInput<'_>,
        policy: &CutPolicy,
    ) -> Result<CutEnergy, ElasticError> {
        let (touched, x) = (input.touched, input.positions);
        assert!(touched.is_sorted(), "touched nodes ascend");
        assert!(
            input.fronts.is_empty() || input.fronts.len() == touched.len(),
            "one matrix per touched node, or none"
        );
        if !self.is_evaluated_at(x) {
            self.forces_into(x, &mut vec![DVec3::ZERO; x.len()]);
        }
        let before = |&node: &u32| self.deformation_gradient(node as usize);
        let before: Vec<DMat3> = touched.iter().map(before).collect();
        let means = self.state.pressures.as_ref().map(|all| all.means.clone());
        let held = self.control_energy(touched, x) + self.front_energy(touched, x);
        self.note_uncut(touched);
        self.update_rows(touched, input.stencils)?;
        let lost = self.lost_gradients(touched, &before, x);
        let deficient = self.deficient_nodes_of(touched, &lost, policy);
        let released = self.weaken(&deficient, x, input.left);
        self.retain_gradients(touched, &before, x);
        if let Some(means) = means {
            self.retain_means(&means, x);
        }
        let most = held + released;
        self.scale_control_within(touched, policy.touched_control, most, x);
        let control = self.control_energy(touched, x);
        let fronts = if input.fronts.is_empty() {
            self.front_energy(touched, x)
        } else {
            self.set_fronts_within(touched, input.fronts, most - control, x)
        };
        Ok(CutEnergy {
            strain: -released,
            stabilization: control + fronts - held,
        })
    }

    /// Remembers rows that no cut has touched so far.
    fn note_uncut(&mut self, touched: &[u32]) {
        let (model, known) = (&self.model, &self.cut.uncut);
        let is_new = |node: &&u32| known.binary_search_by_key(*node, |row| row.node).is_err();
        let new = touched.iter().filter(is_new).map(|&node| {
            let row = model.pairs.row(node as usize);
            Uncut {
                node,
                neighbors: row.iter().filter(|pair| pair.weight > 0.0).count(),
                condition: condition(Moments::given(node as usize, row, &model.rest, &[]).moment),
            }
        });
        let new: Vec<Uncut> = new.collect();
        let uncut = &mut self.cut.uncut;
        uncut.extend(new);
        uncut.sort_unstable_by_key(|row| row.node);
    }

    /// Those of the touched nodes that cuts have left without a strain of their own. What is `lost` is, too.
    fn deficient_nodes_of(&self, touched: &[u32], lost: &[u32], policy: &CutPolicy) -> Vec<u32> {
        let model = &self.model;
        let (uncut, known) = (&self.cut.uncut, self.deficient_nodes());
        let is_deficient = |node: &u32| {
            let at = *node as usize;
            let before = uncut.binary_search_by_key(node, |row| row.node);
            let Some(before) = before.ok().map(|at| uncut[at]) else {
                return false;
            };
            before.neighbors > 0
                && (model.ranks[at] < 3
                    || lost.binary_search(node).is_ok()
                    || known.binary_search(node).is_ok()
                    || self.sees_too_little(before, policy))
        };
        touched.iter().copied().filter(is_deficient).collect()
    }

    /// Whether a node's row sees less than what it was `before` and than the policy asks for.
    fn sees_too_little(&self, before: Uncut, policy: &CutPolicy) -> bool {
        let at = before.node as usize;
        let row = self.model.pairs.row(at);
        let left = row.iter().filter(|pair| pair.weight > 0.0).count();
        let now = || condition(Moments::given(at, row, &self.model.rest, &[]).moment);
        (left < policy.fewest_neighbors && left < before.neighbors)
            || now() > policy.largest_condition.max(before.condition)
    }

    /// Takes their strain ([`Elastic::weaken`]) from those of some nodes of a body at rest that see no more than what the policy
    /// leaves of a touched node, as at a corner of what a support holds.
    ///
    /// # Panics
    /// If a node does not exist.
    pub fn weaken_deficient(&mut self, nodes: &[u32], policy: &CutPolicy) {
        let is_deficient = |node: &u32| {
            let before = Uncut {
                node: *node,
                neighbors: self.model.pairs.row(*node as usize).len(),
                condition: 0.0,
            };
            self.sees_too_little(before, policy)
        };
        let deficient: Vec<u32> = nodes.iter().copied().filter(is_deficient).collect();
        let rest = self.model.rest.clone();
        self.weaken(&deficient, &rest, &|_| 1.0);
    }
}
