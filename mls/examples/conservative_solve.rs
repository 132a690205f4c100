//! Iterations and accuracy of the conservative stencils on clouds of several kinds.
//!
//! `cargo run --release -p phyxel-mls --example conservative_solve`
#![allow(clippy::print_stdout, reason = "prints its table")]

use std::time::Instant;

use glam::{DMat3, DVec3};
use phyxel_mls::{
    ConservativeSettings, ConservativeStencils, Neighborhoods, gradient_sum,
    inverse_square_weights, widen_deficient_rows,
};
use testkit::kuhn::{Block, from_tetrahedra, kuhn_block};

/// A block with every node moved by a smooth map.
fn mapped(block: &Block, map: impl Fn(DVec3) -> DVec3) -> Block {
    let positions = block.positions.iter().map(|&x| map(x)).collect();
    from_tetrahedra(positions, block.tetrahedra.clone())
}

/// Cells three times smaller at one corner.
fn graded(block: &Block) -> Block {
    let size = block.positions[block.positions.len() - 1].max_element();
    let push = |c: f64| size * (0.35 * (c / size) + 0.65 * (c / size).powi(3));
    mapped(block, |x| DVec3::new(push(x.x), push(x.y), push(x.z)))
}

/// A bent, flattened ball: an organ's proportions, no flat face.
fn organ(block: &Block) -> Block {
    let size = block.positions[block.positions.len() - 1].max_element();
    mapped(block, |x| {
        let s = x / size * 2.0 - 1.0;
        let q = s * s;
        let round = |a: f64, b: f64| (1.0 - a / 2.0 - b / 2.0 + a * b / 3.0).sqrt();
        let ball = s * DVec3::new(round(q.y, q.z), round(q.z, q.x), round(q.x, q.y));
        DVec3::new(
            1.6 * ball.x,
            0.8 * ball.y + 0.5 * ball.x * ball.x,
            0.6 * ball.z,
        )
    })
}

fn main() {
    println!(
        "{:<10} {:>7} {:>8} {:>6} {:>6} {:>7} {:>10} {:>10} {:>10} {:>8} {:>8}",
        "cloud",
        "nodes",
        "pairs",
        "rank<3",
        "its",
        "Jacobi",
        "conserv.",
        "shift of b",
        "consist.",
        "change",
        "ms"
    );
    for cells in [8, 17, 24] {
        let jittered = kuhn_block([cells; 3], 1.0, 0.2, 1);
        let clouds = [
            ("regular", kuhn_block([cells; 3], 1.0, 0.0, 1)),
            ("graded", graded(&jittered)),
            ("organ", organ(&jittered)),
            ("jittered", jittered),
        ];
        for (name, block) in clouds {
            let graph = Neighborhoods::from_graph(block.offsets.clone(), block.indices.clone())
                .expect("edges of tetrahedra are a graph");
            let (graph, _) =
                widen_deficient_rows(&block.positions, &graph, 1e-3).expect("finite positions");
            let build = |coarse_space: bool| {
                let weights = inverse_square_weights(&block.positions, &graph);
                let settings = ConservativeSettings {
                    coarse_space,
                    ..Default::default()
                };
                ConservativeStencils::new(
                    &block.positions,
                    &block.volumes,
                    &block.boundary_vectors,
                    &graph,
                    weights,
                    &settings,
                )
                .expect("finite data")
            };
            let start = Instant::now();
            let stencils = build(true);
            let time = start.elapsed().as_secs_f64() * 1e3;
            let jacobi = build(false).report.iterations;
            let largest = block
                .boundary_vectors
                .iter()
                .fold(0.0_f64, |most, b| most.max(b.length()));
            let conservation = stencils.conservation_error(&graph) / largest;
            let (mut consistency, mut change, mut size) = (0.0_f64, 0.0, 0.0);
            for i in (0..block.positions.len()).filter(|&i| stencils.ranks[i].rank == 3) {
                let pairs = graph.pairs(i);
                let g = &stencils.pair_gradients[pairs.clone()];
                let sum = gradient_sum(&block.positions, i, graph.row(i), g);
                for entry in (sum - DMat3::IDENTITY).to_cols_array() {
                    consistency = consistency.max(entry.abs());
                }
                for (pair, g) in pairs.zip(g) {
                    let j = graph.indices()[pair] as usize;
                    let x = block.positions[j] - block.positions[i];
                    let plain = stencils.moment_inverses[i] * (x * stencils.weights[pair]);
                    change += (*g - plain).length();
                    size += plain.length();
                }
            }
            let deficient = stencils.ranks.iter().filter(|r| r.rank < 3).count();
            println!(
                "{name:<10} {:>7} {:>8} {deficient:>6} {:>6} {jacobi:>7} {conservation:>10.1e} \
                 {:>10.1e} {consistency:>10.1e} {:>7.1}% {time:>8.0}",
                block.positions.len(),
                graph.pair_count(),
                stencils.report.iterations,
                stencils.report.boundary_shift,
                100.0 * change / size,
            );
            assert!(
                conservation < 1e-10,
                "{name}: conservation {conservation:e}"
            );
            assert!(consistency < 1e-12, "{name}: consistency {consistency:e}");
        }
    }
}
