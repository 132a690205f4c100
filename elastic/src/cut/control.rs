//! Hourglass stabilization: `E = 1/2 sum_i c_i sum_j w_ij |u_ij - H_i X_ij|²` with the least-squares gradient `H_i`
//! and `c_i = s_i alpha mu_i V_i / sum_j w_ij |X_ij|²`. The scale `s_i` is 1 until a cut touches the node.

use glam::{DMat3, DVec3};

use crate::kernel::fixed::Tables;
use crate::kernel::nodes::Model;
use crate::law::tensor::outer;

/// Energy (J) of one node's control.
pub(crate) fn energy_of(model: &Model, tables: &Tables, node: usize, positions: &[DVec3]) -> f64 {
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
