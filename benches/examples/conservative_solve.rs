//! Iterations and accuracy of the conservative stencils on clouds of several kinds.
//!
//! `cargo run --release -p benches --example conservative_solve`
#![allow(clippy::print_stdout, reason = "prints its table")]

use std::time::Instant;

use benches::problems::block::jittered_stencils;
use glam::{DMat3, DVec3};
use phyxel_mls::{ConservativeSettings, GradientStencils, Neighborhoods, widen_deficient_rows};
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
            let jacobi = build(false).report.expect("it is solved").iterations;
            let report = stencils.report.expect("it is solved");
            let gradients = stencils.pair_gradients(&block.positions, &graph);
            let weights = stencils.weights.clone();
            let plain = GradientStencils::plain(&block.positions, &graph, weights, 1e-3)
                .expect("finite data")
                .pair_gradients(&block.positions, &graph);
            let (mut consistency, mut change, mut size) = (0.0_f64, 0.0, 0.0);
            for i in (0..block.positions.len()).filter(|&i| stencils.ranks[i].rank == 3) {
                let pairs = graph.pairs(i);
                let mut sum = DMat3::ZERO;
                for (pair, &j) in pairs.clone().zip(graph.row(i)) {
                    let [x, y, z] = gradients[pair].to_array();
                    let apart: DVec3 = block.positions[j as usize] - block.positions[i];
                    sum += DMat3::from_cols(apart * x, apart * y, apart * z);
                }
                for entry in (sum - DMat3::IDENTITY).to_cols_array() {
                    consistency = consistency.max(entry.abs());
                }
                for (g, plain) in gradients[pairs.clone()].iter().zip(&plain[pairs]) {
                    change += (*g - *plain).length();
                    size += plain.length();
                }
            }
            let deficient = stencils.ranks.iter().filter(|r| r.rank < 3).count();
            println!(
                "{name:<10} {:>7} {:>8} {deficient:>6} {:>6} {jacobi:>7} {:>10.1e} \
                 {:>10.1e} {consistency:>10.1e} {:>7.1}% {time:>8.0}",
                block.positions.len(),
                graph.pair_count(),
                report.iterations,
                report.residual,
                report.boundary_shift,
                100.0 * change / size,
            );
            assert!(report.residual < 1e-10, "{name}: {report:?}");
            assert!(consistency < 1e-12, "{name}: consistency {consistency:e}");
        }
    }
}
