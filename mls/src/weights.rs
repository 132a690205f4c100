//! Weights on pairs of nodes.

use glam::DVec3;

use crate::parallel::{ROWS_PER_TASK, fill_rows, map};
use crate::{Neighborhoods, kernel};

/// Computes `value(i, j)` for every pair in order, rows in parallel.
fn for_pairs(
    positions: &[DVec3],
    neighborhoods: &Neighborhoods,
    value: impl Fn(usize, usize) -> f64 + Sync,
) -> Vec<f64> {
    let nodes = neighborhoods.node_count();
    assert_eq!(positions.len(), nodes, "one position per node");
    let mut weights = vec![0.0; neighborhoods.pair_count()];
    fill_rows(neighborhoods, &mut weights, |node, out| {
        for (weight, &neighbor) in out.iter_mut().zip(neighborhoods.row(node)) {
            *weight = value(node, neighbor as usize);
        }
    });
    weights
}

/// Kernel weights `w(|X_j − X_i| / h_j)` (Aras 2014, eq. (15): the radius is the neighbour's).
///
/// # Arguments
/// * `positions` -- node positions (m), shape `(n)`.
/// * `support_radii` -- h (m), shape `(n)`. A radius of 0 gives the weight 0.
///
/// # Panics
/// If the slices are not `n` long.
#[must_use]
pub fn kernel_weights(
    positions: &[DVec3],
    support_radii: &[f64],
    neighborhoods: &Neighborhoods,
) -> Vec<f64> {
    let nodes = neighborhoods.node_count();
    assert_eq!(support_radii.len(), nodes, "one radius per node");
    for_pairs(positions, neighborhoods, |i, j| {
        let weight = kernel((positions[j] - positions[i]).length() / support_radii[j]);
        if weight.is_finite() { weight } else { 0.0 }
    })
}

/// Weights `1/|X_j − X_i|²` (1/m²) on the pairs of a graph: symmetric and free of any length scale.
///
/// Coincident nodes, and nodes so near that the weight overflows, get the weight 0: they carry no
/// direction and so add nothing to a gradient.
///
/// # Panics
/// If `positions` is not `n` long.
#[must_use]
pub fn inverse_square_weights(positions: &[DVec3], neighborhoods: &Neighborhoods) -> Vec<f64> {
    for_pairs(positions, neighborhoods, |i, j| {
        let weight = (positions[j] - positions[i]).length_squared().recip();
        if weight.is_finite() { weight } else { 0.0 }
    })
}

/// Mean distance of every node to its neighbours (m), shape `(n)`; 0 for a node without neighbours.
///
/// # Panics
/// If `positions` is not `n` long.
#[must_use]
pub fn mean_neighbor_distance(positions: &[DVec3], neighborhoods: &Neighborhoods) -> Vec<f64> {
    let nodes = neighborhoods.node_count();
    assert_eq!(positions.len(), nodes, "one position per node");
    map(nodes, ROWS_PER_TASK, |i| {
        let row = neighborhoods.row(i);
        let distance = |&j: &u32| (positions[j as usize] - positions[i]).length();
        let sum: f64 = row.iter().map(distance).sum();
        if row.is_empty() {
            0.0
        } else {
            sum / row.len() as f64
        }
    })
}

/// Mean length (m) of all pairs; 0 without any.
///
/// # Panics
/// If a node has no position.
#[must_use]
pub fn mean_pair_length(positions: &[DVec3], neighborhoods: &Neighborhoods) -> f64 {
    let mut sum = 0.0;
    for (node, x) in positions.iter().enumerate() {
        for &other in neighborhoods.row(node) {
            sum += x.distance(positions[other as usize]);
        }
    }
    sum / neighborhoods.pair_count().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::within_radius;
    use testkit::cloud;

    #[test]
    #[allow(
        clippy::float_cmp,
        reason = "the twin computes the same operations in the same order"
    )]
    fn weights_equal_the_plain_double_loop() {
        let mut points = cloud::uniform(700, 1.0, 3);
        points.push(points[5]);
        let graph = within_radius(&points, 0.3).unwrap();
        let radii: Vec<f64> = (0..points.len()).map(|i| 0.2 + 1e-4 * i as f64).collect();
        let square = inverse_square_weights(&points, &graph);
        let mean = mean_neighbor_distance(&points, &graph);
        let weights = kernel_weights(&points, &radii, &graph);
        let mut all = 0.0;
        for i in 0..points.len() {
            let mut sum = 0.0;
            for (pair, j) in graph.entries(i) {
                let r = (points[j] - points[i]).length();
                sum += r;
                assert_eq!(weights[pair], kernel(r / radii[j]));
                let square_length = (points[j] - points[i]).length_squared();
                let expected = if r > 0.0 { 1.0 / square_length } else { 0.0 };
                assert_eq!(square[pair], expected);
            }
            if !graph.row(i).is_empty() {
                assert!((mean[i] - sum / graph.row(i).len() as f64).abs() < 1e-14);
            }
            all += sum / graph.pair_count() as f64;
        }
        assert!((mean_pair_length(&points, &graph) - all).abs() < 1e-12);
    }
}
