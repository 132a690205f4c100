//! Control of the front of a cut: `E = sum_i c_i k_i/2 sum_j w_ij e_ij·(G_i M_i G_iᵀ) e_ij`, `G_i = I + H_i`, with what a
//! linear field leaves over, `e_ij = u_ij - H_i X_ij`, `c_i = beta mu_i V_i / sum_j w_ij |X_ij|²` and
//! `k_i = 2 tr M_i / (tr M_i + tr G_i M_i G_iᵀ)`, 1 at rest.
//!
//! Rows of nodes that slide along a crack alternately are an hourglass mode at its front, which gradients at nodes and
//! the small control of `model/control.rs` hardly read: sliding cracks of 4 spacings were 18 % too soft. `M_i` is the mean of
//! `ν νᵀ` over the front's outward conormals in the rest state; turned along by `G_i`, it is objective. `k_i` keeps the control
//! from growing with the square of the stretch, which no step's limit sees: with it at every update of `matrix`' blocks of
//! 2 kPa (stretched fourfold) one of six rows had an energy-balance error of 5 to 14 % at beta 2, 2.5 and 3 without `k_i`, none at 1.5 and 2.5 with it.

use glam::{DMat3, DVec3};

use crate::kernel::fixed::Tables;
use crate::kernel::nodes::Model;
use crate::kernel::subset::place_among;
use crate::law::tensor::outer;

/// `beta`. Work of a centre crack of 4 spacings over its closed form, at two positions of its line, with 0, 1.5, 2, 2.5, 3: mode
/// II 1.15 and 1.21, 1.05 and 1.08, 1.03 and 1.06, 1.01 and 1.04, 1.00 and 1.02; mode I 0.902 and 0.915, 0.895 and 0.908,
/// 0.893 and 0.906, 0.892 and 0.904, 0.890 and 0.903; mode III does not change.
const STIFFNESS: f64 = 2.5;

/// A pair of a front's node.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Neighbor {
    pub(crate) to: u32,
    /// `w_ij`.
    pub(crate) weight: f64,
    /// `X_ij` (m).
    pub(crate) x: DVec3,
}

/// The control of one node.
#[derive(Debug, Clone)]
pub(crate) struct Front {
    pub(crate) node: u32,
    /// `M_i`.
    pub(crate) matrix: DMat3,
    /// `c_i`.
    pub(crate) stiffness: f64,
    /// Inverse of the row's moment matrix.
    pub(crate) inverse: DMat3,
    pub(crate) row: Vec<Neighbor>,
    /// `G_i`, `e_ij` (m) and `sum_j w_ij e_ij ⊗ e_ij` of the state last evaluated.
    pub(crate) gradient: DMat3,
    pub(crate) left: Vec<DVec3>,
    pub(crate) spread: DMat3,
    /// Energy (J) there.
    pub(crate) energy: f64,
    /// What each pair pulls with (N): on the node, and the other way on the neighbour.
    pub(crate) pulls: Vec<DVec3>,
}

/// Nodes with such a control, ascending; empty before the first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fronts(pub(crate) Vec<Front>);

/// A front of a part: its position in the list, and the positions of its node and neighbours in the part.
pub(crate) type PartFront = (u32, Option<u32>, Vec<Option<u32>>);

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

    /// None yet: its constants follow.
    pub(crate) fn new(node: u32, matrix: DMat3) -> Self {
        Self {
            node,
            matrix,
            stiffness: 0.0,
            inverse: DMat3::ZERO,
            row: Vec::new(),
            gradient: DMat3::IDENTITY,
            left: Vec::new(),
            spread: DMat3::ZERO,
            energy: 0.0,
            pulls: Vec::new(),
        }
    }

    /// Gradient of a field that `along` gives as its difference from the node along each pair.
    fn gradient_of(&self, along: impl Fn(usize, &Neighbor) -> DVec3) -> DMat3 {
        let mut moved = DMat3::ZERO;
        for (at, pair) in self.row.iter().enumerate() {
            moved += outer(along(at, pair) * pair.weight, pair.x);
        }
        moved * self.inverse
    }

    /// Adopts a state.
    pub(crate) fn evaluate(&mut self, displacement: impl Fn(u32) -> DVec3) {
        let own = displacement(self.node);
        let along = |_, pair: &Neighbor| displacement(pair.to) - own;
        let h = self.gradient_of(along);
        let mut spread = DMat3::ZERO;
        for (at, pair) in self.row.iter().enumerate() {
            let left = along(at, pair) - h * pair.x;
            spread += outer(left * pair.weight, left);
            self.left[at] = left;
        }
        (self.gradient, self.spread) = (DMat3::IDENTITY + h, spread);
        let metric = self.metric(self.gradient);
        let c = self.stiffness;
        self.energy = 0.5 * c * metric.scale * trace(metric.matrix * spread);
        let turning = (spread - metric.pressure(spread)) * self.gradient * self.matrix;
        let turned = turning * self.inverse * (metric.scale * c);
        let along = metric.matrix * (metric.scale * c);
        for (at, pair) in self.row.iter().enumerate() {
            self.pulls[at] = (along * self.left[at] + turned * pair.x) * pair.weight;
        }
    }

    /// Calls `add` with the position of each pair in the row, its neighbour and how its pull (N) changes with a field that `field`
    /// gives at the neighbours.
    fn change(
        &self,
        field: impl Fn(usize, &Neighbor) -> DVec3,
        own: DVec3,
        mut add: impl FnMut(usize, &Neighbor, DVec3),
    ) {
        let (g, m, spread) = (self.gradient, self.matrix, self.spread);
        let along = |at: usize, pair: &Neighbor| field(at, pair) - own;
        let dg = self.gradient_of(along);
        let left_of = |at: usize, pair: &Neighbor| along(at, pair) - dg * pair.x;
        let mut half = DMat3::ZERO;
        for (at, pair) in self.row.iter().enumerate() {
            half += outer(left_of(at, pair) * pair.weight, self.left[at]);
        }
        let (metric, mixed) = (self.metric(g), dg * m * g.transpose());
        let (mixed, spreading) = (mixed + mixed.transpose(), half + half.transpose());
        let trace_change = trace(mixed);
        let sum_change = trace(spreading * metric.matrix) + trace(spread * mixed);
        let pressure = metric.pressure(spread);
        let pressing = metric.pressure_change(spread, sum_change, trace_change);
        let held = (spread - pressure) * g * m;
        let changed = (spreading - pressing) * g * m + (spread - pressure) * dg * m;
        let scaling = metric.scale_change(trace_change);
        let (k, along_left) = (metric.scale, metric.matrix);
        let turned = (changed * k + held * scaling) * self.inverse;
        let turning = mixed * k + along_left * scaling;
        for (at, pair) in self.row.iter().enumerate() {
            let (left, change) = (self.left[at], left_of(at, pair));
            let pull = turning * left + along_left * change * k + turned * pair.x;
            add(at, pair, pull * (self.stiffness * pair.weight));
        }
    }

    /// Adopts its row and its node's volume.
    fn refresh(&mut self, model: &Model, tables: &Tables) {
        let node = self.node as usize;
        let pairs = model.pairs.row(node);
        let spread = tables.moments(node, pairs).spread();
        let volume = model.elastic_volumes[node];
        let full = model.ranks[node] == 3 && spread > 0.0;
        let stiffness = STIFFNESS * model.material(node).lame_mu() * volume;
        self.stiffness = if full { stiffness / spread } else { 0.0 };
        self.inverse = tables.moment_inverse(node);
        self.row.clear();
        let row = tables.row(node, pairs);
        self.row
            .extend(row.map(|(to, weight, x, _)| Neighbor { to, weight, x }));
        self.left.resize(self.row.len(), DVec3::ZERO);
        self.pulls.resize(self.row.len(), DVec3::ZERO);
    }

    fn bytes(&self) -> usize {
        let vectors = self.left.capacity() + self.pulls.capacity();
        self.row.capacity() * size_of::<Neighbor>() + vectors * size_of::<DVec3>()
    }
}

impl Fronts {
    pub(crate) fn find(&self, node: u32) -> Result<usize, usize> {
        self.0.binary_search_by(|front| front.node.cmp(&node))
    }

    /// Adopts a state.
    pub(crate) fn evaluate(&mut self, rest: &[DVec3], positions: &[DVec3]) {
        for front in &mut self.0 {
            front.evaluate(|node| positions[node as usize] - rest[node as usize]);
        }
    }

    /// Adds the forces last evaluated, and the energies to those of runs of nodes.
    pub(crate) fn add_forces(&self, forces: &mut [DVec3], (energies, run): (&mut [f64], usize)) {
        for front in &self.0 {
            let node = front.node as usize;
            energies[node / run] += front.energy;
            for (pair, &pull) in front.row.iter().zip(&front.pulls) {
                forces[node] += pull;
                forces[pair.to as usize] -= pull;
            }
        }
    }

    pub(crate) fn add_product(&self, vector: &[DVec3], product: &mut [DVec3]) {
        for front in &self.0 {
            let node = front.node as usize;
            let field = |_, pair: &Neighbor| vector[pair.to as usize];
            front.change(field, vector[node], |_, pair, pull| {
                product[node] -= pull;
                product[pair.to as usize] += pull;
            });
        }
    }

    pub(crate) fn add_product_within(
        &self,
        part: &[PartFront],
        vector: &[DVec3],
        product: &mut [DVec3],
    ) {
        let at = |place: Option<u32>| place.map_or(DVec3::ZERO, |at| vector[at as usize]);
        for (front, own, row) in part {
            let field = |pair: usize, _: &Neighbor| at(row[pair]);
            self.0[*front as usize].change(field, at(*own), |pair, _, pull| {
                if let Some(place) = row[pair] {
                    product[place as usize] += pull;
                }
                if let Some(own) = own {
                    product[*own as usize] -= pull;
                }
            });
        }
    }

    /// The fronts that a part's nodes are in.
    pub(crate) fn of_part(&self, nodes: &[u32]) -> Vec<PartFront> {
        let place = |node: u32| place_among(nodes, node);
        let fronts = (0_u32..).zip(&self.0);
        fronts
            .map(|(at, front)| {
                let row: Vec<_> = front.row.iter().map(|pair| place(pair.to)).collect();
                (at, place(front.node), row)
            })
            .filter(|(_, own, row)| own.is_some() || row.iter().any(Option::is_some))
            .collect()
    }

    /// Nodes whose positions a part's fronts follow from.
    pub(crate) fn ends_of<'a>(&'a self, part: &'a [PartFront]) -> impl Iterator<Item = u32> + 'a {
        part.iter().flat_map(|(front, ..)| {
            let front = &self.0[*front as usize];
            std::iter::once(front.node).chain(front.row.iter().map(|pair| pair.to))
        })
    }

    /// Adopts the state of a part's fronts, of which `displacement` (m) knows the ends.
    pub(crate) fn set_part(&mut self, part: &[PartFront], displacement: impl Fn(u32) -> DVec3) {
        for (front, ..) in part {
            self.0[*front as usize].evaluate(&displacement);
        }
    }

    /// Nodes whose pairs they pull at.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = u32> + '_ {
        self.0.iter().map(|front| front.node)
    }

    /// Adopts rows and volumes that have changed.
    pub(crate) fn refresh(&mut self, model: &Model, tables: &Tables) {
        for front in &mut self.0 {
            front.refresh(model, tables);
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        let rows = self.0.iter().map(Front::bytes);
        self.0.capacity() * size_of::<Front>() + rows.sum::<usize>()
    }
}
