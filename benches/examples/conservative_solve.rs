//! Iterations and accuracy of the conservative stencils on clouds of several kinds.
//!
//! `cargo run --release -p benches --example conservative_solve`
#![allow(clippy::print_stdout, reason = "prints its table")]

use std::time::Instant;

use benches::problems::block::jittered_stencils;
use glam::DMat3;
use phyxel_mls::{ConservativeSettings, Neighborhoods, gradient_sum, widen_deficient_rows};
use testkit::kuhn::{graded, kuhn_block, organ};

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
        let clouds = [
            ("regular", kuhn_block([cells; 3], 1.0, 0.0, 1)),
            ("jittered", kuhn_block([cells; 3], 1.0, 0.2, 1)),
            ("graded", graded(cells, 1)),
            ("organ", organ([cells; 3], 1)),
        ];
        for (name, block) in clouds {
            let graph = Neighborhoods::from_graph(block.offsets.clone(), block.indices.clone())
                .expect("edges of tetrahedra are a graph");
            let (graph, _) =
                widen_deficient_rows(&block.positions, &graph, 1e-3).expect("finite positions");
            let build = |coarse_space: bool| {
                let settings = ConservativeSettings {
                    coarse_space,
                    ..Default::default()
                };
                jittered_stencils(&block, &graph, &settings).expect("finite data")
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
