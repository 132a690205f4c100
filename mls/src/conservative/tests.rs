//! Tests of the conservative stencils, by concept; what they share is here.

use super::*;
use crate::deformation::gradient_sum;
use crate::weights::inverse_square_weights;
use testkit::kuhn::{Block, kuhn_block as block};
use testkit::tol::assert_below;

mod degenerate;
mod rows;
mod solve;
mod strokes;

fn graph(block: &Block) -> Neighborhoods {
    Neighborhoods::from_graph(block.offsets.clone(), block.indices.clone()).unwrap()
}

fn build(block: &Block) -> (Neighborhoods, ConservativeStencils) {
    build_with(block, &ConservativeSettings::default())
}

fn build_with(
    block: &Block,
    settings: &ConservativeSettings,
) -> (Neighborhoods, ConservativeStencils) {
    let graph = graph(block);
    let weights = inverse_square_weights(&block.positions, &graph);
    let stencils = weighted(block, &graph, weights, settings).unwrap();
    (graph, stencils)
}

fn weighted(
    block: &Block,
    graph: &Neighborhoods,
    weights: Vec<f64>,
    settings: &ConservativeSettings,
) -> Result<ConservativeStencils, StencilError> {
    let Block {
        positions,
        volumes,
        boundary_vectors,
        ..
    } = block;
    ConservativeStencils::new(
        positions,
        volumes,
        boundary_vectors,
        graph,
        weights,
        settings,
    )
}

/// Largest entry of `Σ_j X_ij g_ijᵀ − I` over the nodes of rank 3.
fn consistency(positions: &[DVec3], graph: &Neighborhoods, s: &ConservativeStencils) -> f64 {
    let mut worst = 0.0_f64;
    for i in 0..positions.len() {
        if s.ranks[i].rank == 3 {
            let sum = gradient_sum(
                positions,
                i,
                graph.row(i),
                &s.pair_gradients[graph.pairs(i)],
            );
            for x in (sum - DMat3::IDENTITY).to_cols_array() {
                worst = worst.max(x.abs());
            }
        }
    }
    worst
}

/// Conservation to 1e-10 and linear consistency to 1e-12.
fn is_exact(block: &Block, graph: &Neighborhoods, s: &ConservativeStencils) {
    let off = conservation(graph, s, &block.boundary_vectors);
    assert_below("conservation", off, 1e-10);
    let off = consistency(&block.positions, graph, s);
    assert_below("consistency", off, 1e-12);
}

/// `max_j |Σ_i V_i g_ij − b_j| / max |b|` by the plain double loop.
fn conservation(graph: &Neighborhoods, s: &ConservativeStencils, b: &[DVec3]) -> f64 {
    let mut sums = vec![DVec3::ZERO; b.len()];
    for i in 0..b.len() {
        let mut own = DVec3::ZERO;
        for pair in graph.pairs(i) {
            let g = s.pair_gradients[pair];
            sums[graph.indices()[pair] as usize] += g * s.volumes[i];
            own -= g;
        }
        sums[i] += own * s.volumes[i];
    }
    let scale = b.iter().fold(0.0_f64, |m, b| m.max(b.length()));
    sums.iter()
        .zip(b)
        .fold(0.0_f64, |m, (c, b)| m.max((*c - *b).length()))
        / scale
}

/// Factors of a planar cut `normal · x = at` that has reached `y = front`, and the nodes it touches.
fn planar_cut(
    block: &Block,
    graph: &Neighborhoods,
    normal: DVec3,
    at: f64,
    front: f64,
) -> (Vec<f64>, Vec<u32>) {
    let mut factors = vec![1.0; graph.pair_count()];
    let mut touched = Vec::new();
    for (node, &a) in (0_u32..).zip(&block.positions) {
        for pair in graph.pairs(node as usize) {
            let b = block.positions[graph.indices()[pair] as usize];
            let (here, there) = (a.dot(normal) - at, b.dot(normal) - at);
            let share = here / (here - there);
            if (here < 0.0) != (there < 0.0) && a.y + share * (b.y - a.y) < front {
                factors[pair] = 0.0;
                touched.push(node);
            }
        }
    }
    touched.dedup();
    (factors, touched)
}
