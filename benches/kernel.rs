//! The force kernel beside its bounds: `cargo bench -p benches --bench kernel [-- cells a side...]`.
//!
//! Bodies are boxes of jittered tetrahedra with the conservative stencils of `phyxel-mls`, neo-Hookean, default control.
//! Times are the least of all. The bounds, per pair: to read as many bytes as the model holds once, front to back, on one
//! thread; and to multiply and add at peak.
#![allow(clippy::print_stdout, reason = "prints a table")]

use std::time::Instant;

use glam::DVec3;
use phyxel::elastic_stencils;
use phyxel_elastic::{Elastic, Material, Materials, Nodes, Settings};
use phyxel_mls::{ConservativeSettings, GradientStencils, Neighborhoods, inverse_square_weights};
use testkit::cloud::Random;
use testkit::kuhn::kuhn_block;

/// Multiply-adds of a pair: three rows of eight lanes in either pass, and in pass one the products of
/// the weight and the sum of them.
const PAIR_MULTIPLY_ADDS: f64 = 64.0;

/// Cells a side of the bodies: 1,408, 5,832 and 97,336 nodes.
const BODIES: [[usize; 3]; 3] = [[7, 7, 21], [17; 3], [45; 3]];
/// Seconds that each is measured for.
const PATIENCE: f64 = 2.0;

fn time(times: &mut Vec<f64>, work: impl FnOnce() -> f64) {
    let start = Instant::now();
    std::hint::black_box(work());
    times.push(start.elapsed().as_secs_f64());
}

fn least(times: &[f64]) -> f64 {
    times.iter().copied().fold(f64::INFINITY, f64::min)
}

fn main() {
    let given: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let bodies = match given.is_empty() {
        true => BODIES.to_vec(),
        false => given.into_iter().map(|side| [side; 3]).collect(),
    };
    let peak = multiply_adds_per_second();
    println!(
        "{:.1} multiply-adds a nanosecond at peak, one thread",
        1e-9 * peak
    );
    println!(
        "| nodes | pairs/node | threads | ns/node | ns/pair | bound: read, compute | bytes/node |"
    );
    println!("|---|---|---|---|---|---|---|");
    for cells in bodies {
        body(cells, peak);
    }
}

/// Rate at which one thread multiplies and adds numbers that it has at hand.
fn multiply_adds_per_second() -> f64 {
    const ROUNDS: usize = 20_000;
    /// Independent sums, as many as hide how long one takes.
    const SUMS: usize = 12;
    struct Peak;
    impl pulp::WithSimd for Peak {
        type Output = f64;

        #[inline(always)]
        fn with_simd<S: pulp::Simd>(self, _: S) -> f64 {
            let (a, b) = std::hint::black_box(([0.999; 8], [1e-3; 8]));
            let mut sums = [[0.0_f64; 8]; SUMS];
            for _ in 0..ROUNDS {
                for sum in &mut sums {
                    for k in 0..8 {
                        sum[k] = sum[k].mul_add(a[k], b[k]);
                    }
                }
            }
            let sums = std::hint::black_box(sums);
            sums.iter().flatten().sum()
        }
    }
    let mut times = Vec::new();
    for _ in 0..50 {
        time(&mut times, || pulp::Arch::new().dispatch(Peak));
    }
    (ROUNDS * SUMS * 8) as f64 / least(&times)
}

fn body(cells: [usize; 3], peak: f64) {
    let block = kuhn_block(cells, 0.1, 0.2, 1);
    let graph = Neighborhoods::from_graph(block.offsets.clone(), block.indices.clone())
        .expect("edges of tetrahedra");
    let weights = inverse_square_weights(&block.positions, &graph);
    let rows = GradientStencils::conservative(
        &block.positions,
        &block.volumes,
        &block.boundary_vectors,
        &graph,
        weights,
        &ConservativeSettings::default(),
    )
    .expect("a valid block");
    let material = Materials::Uniform(Material::neo_hookean(1e4, 0.4));
    let nodes = Nodes::new(&block.positions, &block.volumes);
    let mut body = Elastic::new(
        &elastic_stencils(&rows, &graph),
        &nodes,
        &material,
        &Settings::default(),
    )
    .expect("valid rows");
    let mut random = Random::new(1);
    let shake = |x: &DVec3| *x * 1.02 + random.vector(0.002);
    let x: Vec<DVec3> = block.positions.iter().map(shake).collect();
    let mut forces = vec![DVec3::ZERO; x.len()];
    let (nodes, pairs) = (x.len() as f64, body.pair_count() as f64);
    for threads in [1, 2] {
        let mut times = Vec::new();
        testkit::pool(threads).install(|| {
            let start = Instant::now();
            while times.len() < 5 || start.elapsed().as_secs_f64() < PATIENCE {
                time(&mut times, || body.forces_into(&x, &mut forces));
            }
        });
        let least = least(&times);
        println!(
            "| {} | {:.1} | {threads} | {:.1} | {:.2} | {:.2}, {:.2} | {} |",
            x.len(),
            pairs / nodes,
            least * 1e9 / nodes,
            least * 1e9 / pairs,
            read_time(body.bytes().all) * 1e9 / pairs,
            PAIR_MULTIPLY_ADDS * 1e9 / (peak * threads as f64),
            body.bytes().all / x.len(),
        );
    }
}

/// Time (s) in which one thread reads as many bytes once, front to back.
fn read_time(bytes: usize) -> f64 {
    let words = vec![1.0_f64; bytes / 8];
    let mut times = Vec::new();
    for _ in 0..5 {
        time(&mut times, || {
            let mut sum = [0.0; 8];
            for eight in words.chunks_exact(8) {
                for k in 0..8 {
                    sum[k] += eight[k];
                }
            }
            std::hint::black_box(sum)[0]
        });
    }
    least(&times)
}
