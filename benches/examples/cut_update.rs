//! What the stencils do after a cut: cost of touched rows, and uniform stress parallel to the cut.
//!
//! A body under uniform uniaxial stress along y stays in equilibrium when a cut opens in a plane that
//! holds y. The table shows how far the nodal forces are from that: `keep` after `update_rows`, and `g0`, the
//! stencils without correction.
//!
//! `cargo run --release -p benches --example cut_update`
#![allow(clippy::print_stdout, reason = "prints its table")]

use std::time::Instant;

use benches::problems::block::jittered_stencils;
use phyxel_mls::{ConservativeSettings, GradientStencils, Neighborhoods, inverse_square_weights};
use testkit::kuhn::{Block, kuhn_block};

/// Factors and touched nodes of a cut in the plane `x = at`, down to `y = front`.
fn cut(block: &Block, graph: &Neighborhoods, at: f64, front: f64) -> (Vec<f64>, Vec<u32>) {
    let mut factors = vec![1.0; graph.pair_count()];
    let mut touched = Vec::new();
    for (i, &a) in (0_u32..).zip(&block.positions) {
        for pair in graph.pairs(i as usize) {
            let b = block.positions[graph.indices()[pair] as usize];
            let share = (at - a.x) / (b.x - a.x);
            if (a.x < at) != (b.x < at) && a.y + share * (b.y - a.y) < front {
                factors[pair] = 0.0;
                touched.push(i);
            }
        }
    }
    touched.dedup();
    (factors, touched)
}

/// Root mean square and largest relative error of the stress that the force balance at the nodes of
/// the cut shows: `|Σ_i V_i g_ij·y − b_j·y|` against the face area of a node.
fn parallel_stress(
    graph: &Neighborhoods,
    stencils: &GradientStencils,
    block: &Block,
) -> (f64, f64) {
    let gradients = stencils.pair_gradients(&block.positions, graph);
    let mut sums: Vec<f64> = block.boundary_vectors.iter().map(|b| -b.y).collect();
    for i in 0..sums.len() {
        for pair in graph.pairs(i) {
            let j = graph.indices()[pair] as usize;
            let part = gradients[pair].y * block.volumes[i];
            sums[j] += part;
            sums[i] -= part;
        }
    }
    let count = f64::from(u32::try_from(sums.len()).expect("few nodes"));
    let square: f64 = sums.iter().map(|s| s * s).sum();
    (
        (square / count).sqrt(),
        sums.iter().fold(0.0, |most, s| most.max(s.abs())),
    )
}

fn main() {
    let block = kuhn_block([16, 16, 8], 1.0, 0.2, 1);
    let graph = Neighborhoods::from_graph(block.offsets.clone(), block.indices.clone())
        .expect("edges are a graph");
    let setup = Instant::now();
    let whole =
        jittered_stencils(&block, &graph, &ConservativeSettings::default()).expect("finite data");
    let setup = setup.elapsed().as_secs_f64() * 1e3;
    println!(
        "{} nodes, {} pairs, set-up {setup:.0} ms",
        block.positions.len(),
        graph.pair_count()
    );
    println!(
        "{:<8} {:>8} {:>9} {:>22} {:>22}",
        "cut", "touched", "us/row", "g0 rms/max", "keep rms/max"
    );
    for (name, front) in [("quarter", 4.1), ("half", 8.1), ("through", 99.0)] {
        let (factors, touched) = cut(&block, &graph, 8.4, front);
        let mut stencils = whole.clone();
        let start = Instant::now();
        stencils
            .update_rows(&block.positions, &graph, |pair| factors[pair], &touched)
            .expect("factors are 0 or 1");
        let rows = f64::from(u32::try_from(touched.len()).expect("few rows"));
        let per_row = start.elapsed().as_secs_f64() * 1e6 / rows;
        let weights = inverse_square_weights(&block.positions, &graph);
        let cut_weights = weights.iter().zip(&factors).map(|(w, f)| w * f).collect();
        let plain = GradientStencils::plain(&block.positions, &graph, cut_weights, 1e-3)
            .expect("finite data");
        let bare = parallel_stress(&graph, &plain, &block);
        let keep = parallel_stress(&graph, &stencils, &block);
        let text = |(rms, max): (f64, f64)| format!("{rms:.1e} / {max:.1e}");
        println!(
            "{name:<8} {:>8} {per_row:>9.2} {:>22} {:>22}",
            touched.len(),
            text(bare),
            text(keep)
        );
        assert!(keep.0 < bare.0, "the kept correction is better than none");
    }
}
