//! Hourglass stabilization: `E = 1/2 sum_i c_i sum_j w_ij |u_ij - H_i X_ij|²` with the least-squares gradient `H_i`
//! and `c_i = s_i alpha mu_i V_i / sum_j w_ij |X_ij|²`. The scale `s_i` is 1 until a cut touches the node.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};

use super::Elastic;
use crate::kernel::fixed::Tables;
use crate::kernel::nodes::Model;
use crate::kernel::row::refresh_control;
use crate::law::tensor::outer;

impl Elastic {
    /// Energy (J) that the hourglass stabilization of `nodes` holds at `positions` (m).
    pub(crate) fn control_energy(&self, nodes: &[u32], positions: &[DVec3]) -> f64 {
        self.control_energies(nodes, positions).iter().sum()
    }

    fn control_energies(&self, nodes: &[u32], positions: &[DVec3]) -> Vec<f64> {
        assert_eq!(positions.len(), self.node_count(), "one position per node");
        let (model, tables) = (&self.model, &self.tables);
        let energy = |&node: &u32| energy_of(model, tables, node as usize, positions);
        nodes.iter().map(energy).collect()
    }

    /// Brings the scales of the hourglass stabilization of `nodes` towards `scale`, or, if their control holds more than
    /// `most` (J) at `positions` (m) as it is, down towards 1: all by the same fraction, as far as it then holds
    /// `most`. A cut's one-sided rows leave more to the control, and a rise out of nothing would add energy; so would
    /// rows whose scales earlier cuts had raised. With `most` what it held before their rows were rebuilt and what the
    /// cut released, a cut of a strained body adds none, and one of a body at rest takes the whole change. A scale of 3,
    /// at the default of 0.1, takes 1 % from the work of a crack at 6.4 spacings; 10 takes 3 %.
    ///
    /// A scale that is higher than `scale` does not fall for that. Control at a scale of 1 stays, whatever it holds.
    pub(crate) fn scale_control_within(
        &mut self,
        nodes: &[u32],
        scale: f64,
        most: f64,
        positions: &[DVec3],
    ) {
        if !self.model.controlled() {
            return;
        }
        // Whether or not they change, so that memory does not depend on the motion.
        let count = self.node_count();
        self.model.control_scales.resize(count, 1.0);
        let now = self.control_energies(nodes, positions);
        let old: Vec<f64> = nodes.iter().map(|&node| self.control_scale(node)).collect();
        let left = most - now.iter().sum::<f64>();
        let change = |old: f64| match left < 0.0 {
            true => 1.0 - old,
            false => (scale - old).max(0.0),
        };
        // The energy grows in proportion.
        let energies = now.iter().zip(&old);
        let whole: f64 = energies.map(|(now, &old)| now * change(old) / old).sum();
        let enough = whole.abs() <= left.abs();
        let way = if enough { 1.0 } else { left / whole };
        if way > 0.0 {
            // Round-off may not take it below 1, which states do not know.
            let scales = old.iter().map(|&old| (old + way * change(old)).max(1.0));
            let scales: Vec<(u32, f64)> = nodes.iter().copied().zip(scales).collect();
            self.change_control_scales(&scales);
        }
    }

    fn control_scale(&self, node: u32) -> f64 {
        let scales = &self.model.control_scales;
        scales.get(node as usize).copied().unwrap_or(1.0)
    }

    /// Nodes whose control has a scale other than 1, ascending, with it.
    pub(crate) fn control_scales(&self) -> Vec<(u32, f64)> {
        let scales = (0..).zip(&self.model.control_scales);
        let scaled = scales.filter(|(_, scale)| **scale > 1.0);
        scaled.map(|(node, scale)| (node, *scale)).collect()
    }

    /// Restores them: all others are 1.
    pub(crate) fn set_control_scales(&mut self, scales: &[(u32, f64)]) {
        let known = self
            .control_scales()
            .into_iter()
            .map(|(node, _)| (node, 1.0));
        let mut all: BTreeMap<u32, f64> = known.collect();
        all.extend(scales.iter().copied());
        self.change_control_scales(&Vec::from_iter(all));
    }

    fn change_control_scales(&mut self, scales: &[(u32, f64)]) {
        let differs =
            |&&(node, scale): &&(u32, f64)| self.control_scale(node).to_bits() != scale.to_bits();
        let changed: Vec<(u32, f64)> = scales.iter().filter(differs).copied().collect();
        if changed.is_empty() {
            return;
        }
        let model = &mut self.model;
        model.control_scales.resize(model.node_count(), 1.0);
        for &(node, scale) in &changed {
            model.control_scales[node as usize] = scale;
        }
        let numbers: Vec<u32> = changed.iter().map(|(node, _)| *node).collect();
        self.scratch.stale.add(&numbers);
        let nodes: Vec<usize> = numbers.iter().map(|&node| node as usize).collect();
        refresh_control(model, &mut self.tables, &nodes);
    }
}

/// Energy (J) of one node's control.
fn energy_of(model: &Model, tables: &Tables, node: usize, positions: &[DVec3]) -> f64 {
    let control = tables.control(node);
    if control == 0.0 {
        return 0.0;
    }
    let displacement = |i: usize| positions[i] - model.rest[i];
    let own = displacement(node);
    let row = || tables.row(node, model.pairs.row(node));
    let mut moved = DMat3::ZERO;
    for (j, w, x, _) in row() {
        moved += outer((displacement(j as usize) - own) * w, x);
    }
    let gradient = moved * tables.moment_inverse(node);
    let left = row().map(|(j, w, x, _)| {
        let leftover = displacement(j as usize) - own - gradient * x;
        w * leftover.length_squared()
    });
    0.5 * control * left.sum::<f64>()
}
