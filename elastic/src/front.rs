//! Control of the front of a cut: `E = sum_i c_i k_i/2 sum_j w_ij e_ij·(G_i M_i G_iᵀ) e_ij`, `G_i = I + H_i`, with what a
//! linear field leaves over, `e_ij = u_ij - H_i X_ij`, `c_i = beta mu_i V_i / sum_j w_ij |X_ij|²` and
//! `k_i = 2 tr M_i / (tr M_i + tr G_i M_i G_iᵀ)`, 1 at rest.
//!
//! Rows of nodes that slide along a crack in turn are a zero-energy mode at its front, which gradients at nodes and
//! the small control of `control.rs` hardly read: sliding cracks of 4 spacings were 18 % too soft. `M_i` is the mean of
//! `ν νᵀ` over the front's outward conormals in the rest state; turned along by `G_i`, it is objective. `k_i` keeps the control
//! from growing with the square of the stretch, which no step's limit sees: with it at every update of `matrix`' blocks of
//! 2 kPa (stretched fourfold) one of six rows had an imbalance of 5 to 14 % at beta 2, 2.5 and 3 without `k_i`, none at 1.5 and 2.5 with it.

use glam::{DMat3, DVec3};

use crate::fixed::Fixed;
use crate::law::outer;
use crate::model::{Elastic, with_table};
use crate::nodes::Model;
use crate::part::Part;
use crate::storage::Storage;

/// `beta`. Work of a centre crack of 4 spacings over its closed form, at two places of its line, with 0, 1.5, 2, 2.5, 3: mode
/// II 1.15 and 1.21, 1.05 and 1.08, 1.03 and 1.06, 1.01 and 1.04, 1.00 and 1.02; mode I 0.902 and 0.915, 0.895 and 0.908,
/// 0.893 and 0.906, 0.892 and 0.904, 0.890 and 0.903; mode III does not change.
const STIFFNESS: f64 = 2.5;

/// The control of one node.
#[derive(Debug, Clone)]
struct Front {
    node: u32,
    /// `M_i`.
    matrix: DMat3,
    /// `c_i`.
    stiffness: f64,
    /// `G_i` and `e_ij` (m) of the state last evaluated.
    gradient: DMat3,
    left: Vec<DVec3>,
}

/// Nodes with such a control, rising; empty before the first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fronts(Vec<Front>);

/// A front of a part: its place in the list, and the places of its node and neighbours in the part.
pub(crate) type PartFront = (u32, Option<u32>, Vec<Option<u32>>);

/// What a row leaves over of a field: its gradient, and the rest along each pair.
fn leftovers<S: Storage, const L: usize>(
    model: &Model,
    fixed: &Fixed<S, L>,
    node: usize,
    field: impl Fn(usize, u32) -> DVec3,
    own: DVec3,
) -> (DMat3, Vec<DVec3>) {
    let row = || fixed.row(node, model.pairs.row(node)).enumerate();
    let mut moved = DMat3::ZERO;
    for (at, (to, w, x, _)) in row() {
        moved += outer((field(at, to) - own) * w, x);
    }
    let gradient = moved * fixed.moment_inverse(node);
    let left = row().map(|(at, (to, _, x, _))| field(at, to) - own - gradient * x);
    (gradient, left.collect())
}

/// `sum_j w_ij a_ij ⊗ b_ij`.
fn moment(weights: impl Iterator<Item = f64>, a: &[DVec3], b: &[DVec3]) -> DMat3 {
    let terms = weights.zip(a).zip(b);
    terms.fold(DMat3::ZERO, |sum, ((w, a), b)| sum + outer(*a * w, *b))
}

fn trace(m: DMat3) -> f64 {
    m.x_axis.x + m.y_axis.y + m.z_axis.z
}

/// `G M Gᵀ`, and the scale `k` that keeps it from growing with the stretch.
#[derive(Debug, Clone, Copy)]
struct Metric {
    /// `A = G M Gᵀ`.
    matrix: DMat3,
    /// `k = 2 tr M / (tr A + tr M)`.
    scale: f64,
    /// `tr A + tr M`.
    traces: f64,
}

impl Metric {
    /// `p I`, `p = S:A / (tr A + tr M)` with `S = sum_j w_ij e_ij ⊗ e_ij`: with `G` the energy changes by
    /// `c k ((S - p I) G M) : dG`.
    fn pressure(&self, spread: DMat3) -> DMat3 {
        DMat3::from_diagonal(DVec3::splat(trace(spread * self.matrix) / self.traces))
    }

    /// `dp I`, from `d(S:A)` and `d tr A`.
    fn pressure_change(&self, spread: DMat3, sum_change: f64, trace_change: f64) -> DMat3 {
        let sum = trace(spread * self.matrix);
        let change = (sum_change - sum * trace_change / self.traces) / self.traces;
        DMat3::from_diagonal(DVec3::splat(change))
    }

    /// `dk`, from `d tr A`.
    fn scale_change(&self, trace_change: f64) -> f64 {
        -self.scale * trace_change / self.traces
    }
}

impl Front {
    /// What its leftovers are weighed with, at a gradient `G`.
    fn metric(&self, gradient: DMat3) -> Metric {
        let matrix = gradient * self.matrix * gradient.transpose();
        let rest = trace(self.matrix);
        let traces = trace(matrix) + rest;
        let scale = 2.0 * rest / traces;
        Metric {
            matrix,
            scale,
            traces,
        }
    }

    fn weights<'a, S: Storage, const L: usize>(
        &self,
        model: &'a Model,
        fixed: &'a Fixed<S, L>,
    ) -> impl Iterator<Item = f64> + use<'a, S, L> {
        let node = self.node as usize;
        fixed.row(node, model.pairs.row(node)).map(|(_, w, ..)| w)
    }

    /// Energy (J), and gradient and leftovers behind it.
    fn energy<S: Storage, const L: usize>(
        &self,
        model: &Model,
        fixed: &Fixed<S, L>,
        displacement: impl Fn(usize) -> DVec3,
    ) -> (f64, DMat3, Vec<DVec3>) {
        let node = self.node as usize;
        let field = |_, to: u32| displacement(to as usize);
        let (h, left) = leftovers(model, fixed, node, field, displacement(node));
        let gradient = DMat3::IDENTITY + h;
        let metric = self.metric(gradient);
        let weighed = self.weights(model, fixed).zip(&left);
        let sum = weighed
            .map(|(w, e)| w * e.dot(metric.matrix * *e))
            .sum::<f64>();
        (0.5 * self.stiffness * metric.scale * sum, gradient, left)
    }

    /// What each pair pulls with (N): on the node, and the other way on the neighbour.
    fn pulls<S: Storage, const L: usize>(
        &self,
        model: &Model,
        fixed: &Fixed<S, L>,
    ) -> Vec<(u32, DVec3)> {
        let (node, g) = (self.node as usize, self.gradient);
        let metric = self.metric(g);
        let spread = moment(self.weights(model, fixed), &self.left, &self.left);
        let turning = (spread - metric.pressure(spread)) * g * self.matrix;
        let (along, turned) = (
            metric.matrix * metric.scale,
            turning * fixed.moment_inverse(node) * metric.scale,
        );
        let c = self.stiffness;
        let row = fixed.row(node, model.pairs.row(node)).zip(&self.left);
        row.map(|((to, w, x, _), e)| (to, (along * *e + turned * x) * (c * w)))
            .collect()
    }

    /// Their changes with a field.
    fn changes<S: Storage, const L: usize>(
        &self,
        model: &Model,
        fixed: &Fixed<S, L>,
        field: impl Fn(usize, u32) -> DVec3,
        own: DVec3,
    ) -> Vec<(u32, DVec3)> {
        let (node, g, m) = (self.node as usize, self.gradient, self.matrix);
        let (dg, de) = leftovers(model, fixed, node, field, own);
        let weights = || self.weights(model, fixed);
        let spread = moment(weights(), &self.left, &self.left);
        let half = moment(weights(), &de, &self.left);
        let (metric, mixed) = (self.metric(g), dg * m * g.transpose());
        let (mixed, spreading) = (mixed + mixed.transpose(), half + half.transpose());
        let trace_change = trace(mixed);
        let sum_change = trace(spreading * metric.matrix) + trace(spread * mixed);
        let pressure = metric.pressure(spread);
        let pressing = metric.pressure_change(spread, sum_change, trace_change);
        let inverse = fixed.moment_inverse(node);
        let held = (spread - pressure) * g * m;
        let changed = (spreading - pressing) * g * m + (spread - pressure) * dg * m;
        let scaling = metric.scale_change(trace_change);
        let (k, along) = (metric.scale, metric.matrix);
        let turned = (changed * k + held * scaling) * inverse;
        let turning = mixed * k + along * scaling;
        let c = self.stiffness;
        let row = fixed.row(node, model.pairs.row(node));
        let row = row.zip(self.left.iter().zip(&de));
        row.map(|((to, w, x, _), (e, de))| {
            let pull = turning * *e + along * *de * k + turned * x;
            (to, pull * (c * w))
        })
        .collect()
    }
}

impl Fronts {
    fn find(&self, node: u32) -> Result<usize, usize> {
        self.0.binary_search_by(|front| front.node.cmp(&node))
    }

    /// Adds forces, and energies to those of runs of nodes.
    pub(crate) fn add_forces<S: Storage, const L: usize>(
        &mut self,
        model: &Model,
        fixed: &Fixed<S, L>,
        positions: &[DVec3],
        forces: &mut [DVec3],
        (energies, run): (&mut [f64], usize),
    ) {
        let displacement = |i: usize| positions[i] - model.rest[i];
        for front in &mut self.0 {
            let node = front.node as usize;
            let (energy, gradient, left) = front.energy(model, fixed, displacement);
            (front.gradient, front.left) = (gradient, left);
            energies[node / run] += energy;
            for (to, pull) in front.pulls(model, fixed) {
                forces[node] += pull;
                forces[to as usize] -= pull;
            }
        }
    }

    pub(crate) fn add_product<S: Storage, const L: usize>(
        &self,
        model: &Model,
        fixed: &Fixed<S, L>,
        vector: &[DVec3],
        product: &mut [DVec3],
    ) {
        for front in &self.0 {
            let node = front.node as usize;
            let field = |_, to: u32| vector[to as usize];
            for (to, pull) in front.changes(model, fixed, field, vector[node]) {
                product[node] -= pull;
                product[to as usize] += pull;
            }
        }
    }

    pub(crate) fn add_product_within<S: Storage, const L: usize>(
        &self,
        model: &Model,
        fixed: &Fixed<S, L>,
        part: &[PartFront],
        (vector, product): (&[DVec3], &mut [DVec3]),
    ) {
        let at = |place: Option<u32>| place.map_or(DVec3::ZERO, |at| vector[at as usize]);
        for (front, own, row) in part {
            let field = |pair: usize, _| at(row[pair]);
            let pulls = self.0[*front as usize].changes(model, fixed, field, at(*own));
            for ((_, pull), place) in pulls.iter().zip(row) {
                if let Some(place) = place {
                    product[*place as usize] += *pull;
                }
                if let Some(own) = own {
                    product[*own as usize] -= *pull;
                }
            }
        }
    }

    /// The fronts that a part's nodes are in.
    pub(crate) fn of_part(&self, model: &Model, nodes: &[u32]) -> Vec<PartFront> {
        let place = |node: u32| {
            let found = nodes.binary_search(&node).ok();
            found.and_then(|at| u32::try_from(at).ok())
        };
        let fronts = (0_u32..).zip(&self.0);
        fronts
            .map(|(at, front)| {
                let row = model.pairs.row(front.node as usize).iter();
                let row: Vec<_> = row.map(|pair| place(pair.to)).collect();
                (at, place(front.node), row)
            })
            .filter(|(_, own, row)| own.is_some() || row.iter().any(Option::is_some))
            .collect()
    }

    /// Nodes whose pairs they pull at.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = u32> + '_ {
        self.0.iter().map(|front| front.node)
    }

    /// `c_i M_i`, zero at other nodes.
    pub(crate) fn at_rest(&self, node: usize) -> DMat3 {
        let node = u32::try_from(node).ok();
        let found = node.and_then(|node| self.find(node).ok());
        found.map_or(DMat3::ZERO, |at| {
            let front = &self.0[at];
            front.matrix * front.stiffness
        })
    }

    /// Takes over rows and volumes that have changed.
    pub(crate) fn refresh<S: Storage, const L: usize>(
        &mut self,
        model: &Model,
        fixed: &Fixed<S, L>,
    ) {
        for front in &mut self.0 {
            let node = front.node as usize;
            let spread = fixed.moments(node, model.pairs.row(node)).spread();
            let volume = model.elastic_volumes[node];
            let full = model.ranks[node] == 3 && spread > 0.0;
            let stiffness = STIFFNESS * model.material(node).lame_mu() * volume;
            front.stiffness = if full { stiffness / spread } else { 0.0 };
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        let left = self.0.iter().map(|front| front.left.capacity());
        self.0.capacity() * size_of::<Front>() + left.sum::<usize>() * size_of::<DVec3>()
    }
}

impl Elastic {
    /// Sets the matrices `M_i` of the control of a cut's front at `nodes`; zero takes the control away. `M_i` is symmetric, its eigenvalues 0 to 1: the mean of `ν νᵀ` over the directions `ν`, in the rest
    /// state, in which the cut ends beside the node.
    ///
    /// Without zero-energy control ([`crate::Settings::zero_energy_control`] 0) it does nothing. A node without strain
    /// energy, or whose row is not full, has none. What it takes follows the number of such nodes.
    ///
    /// # Panics
    /// If a node does not exist or there is not one matrix per node.
    pub fn set_fronts(&mut self, nodes: &[u32], matrices: &[DMat3]) {
        assert_eq!(nodes.len(), matrices.len(), "one matrix per node");
        if !self.model.controlled() {
            return;
        }
        let fronts = &mut self.state.fronts;
        let mut changed = Vec::new();
        for (&node, &matrix) in nodes.iter().zip(matrices) {
            assert!(
                (node as usize) < self.model.node_count(),
                "node {node} exists"
            );
            let left = vec![DVec3::ZERO; self.model.pairs.row(node as usize).len()];
            let front = Front {
                node,
                matrix,
                stiffness: 0.0,
                gradient: DMat3::IDENTITY,
                left,
            };
            match (fronts.find(node), matrix == DMat3::ZERO) {
                (Ok(at), true) => {
                    fronts.0.remove(at);
                }
                (Ok(at), false) => fronts.0[at] = front,
                (Err(at), false) => fronts.0.insert(at, front),
                (Err(_), true) => continue,
            }
            changed.push(node);
        }
        self.scratch.stale.add(&changed);
        self.refresh_fronts();
    }

    /// Brings them up to date with rows and volumes.
    pub(crate) fn refresh_fronts(&mut self) {
        let (model, fronts) = (&self.model, &mut self.state.fronts);
        with_table!(&self.tables, table => fronts.refresh(model, &table.fixed));
    }

    /// Nodes with a control of a cut's front, rising, and its matrices.
    #[must_use]
    pub fn fronts(&self) -> Vec<(u32, DMat3)> {
        let fronts = self.state.fronts.0.iter();
        fronts.map(|front| (front.node, front.matrix)).collect()
    }

    /// Energy (J) that the control of a cut's front at `nodes` holds at `positions` (m).
    ///
    /// # Panics
    /// If `positions` is not one per node.
    #[must_use]
    pub fn front_energy(&self, nodes: &[u32], positions: &[DVec3]) -> f64 {
        assert_eq!(positions.len(), self.node_count(), "one position per node");
        let (model, fronts) = (&self.model, &self.state.fronts);
        let displacement = |i: usize| positions[i] - model.rest[i];
        let found = nodes.iter().filter_map(|&node| fronts.find(node).ok());
        found
            .map(|at| &fronts.0[at])
            .map(|front| with_table!(&self.tables, table => front.energy(model, &table.fixed, displacement).0))
            .sum()
    }
}

impl Part {
    pub(crate) fn with_fronts(mut self, model: &Model, fronts: &Fronts) -> Self {
        self.fronts = fronts.of_part(model, &self.nodes);
        self
    }
}
