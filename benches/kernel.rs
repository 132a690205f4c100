//! The force kernel against the one of before stencils were factored, interleaved in one process:
//! `cargo bench -p benches --bench kernel [-- cells a side...]`.
//!
//! Bodies are boxes of jittered tetrahedra with the conservative stencils of `phyxel-mls`, neo-Hookean,
//! default control. Checks that forces agree to 1e-12 (f64) and 1e-6 (f32) of the largest. *read* is the
//! time to read as many bytes as the model holds once, front to back.
#![allow(clippy::print_stdout, reason = "prints a table")]
#![allow(clippy::cast_precision_loss, reason = "sizes of a benchmark are small")]

use std::time::Instant;

use glam::DVec3;
use phyxel_elastic::{Elastic, Material, Materials, Nodes, Precision, Settings, Stencils};
use phyxel_mls::{
    ConservativeSettings, ConservativeStencils, Neighborhoods, inverse_square_weights,
};
use testkit::cloud::Random;
use testkit::kuhn::kuhn_block;

mod previous;

use previous::{Parts, Previous};

/// Young's modulus (Pa) and Poisson's ratio.
const MATERIAL: (f64, f64) = (1e4, 0.4);

fn time(best: &mut f64, work: impl FnOnce() -> f64) -> f64 {
    let start = Instant::now();
    let energy = work();
    *best = best.min(start.elapsed().as_secs_f64());
    energy
}

fn main() {
    let given: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let sides = if given.is_empty() {
        vec![10, 17, 45]
    } else {
        given
    };
    println!(
        "| nodes | pairs/node | threads | storage | before, ns/pair | now, ns/pair | ratio | bytes/node before, now | read, ns/pair | off |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for side in sides {
        body(side);
    }
}

fn body(side: usize) {
    let block = kuhn_block([side; 3], 0.1, 0.2, 1);
    let graph = Neighborhoods::from_graph(block.offsets.clone(), block.indices.clone())
        .expect("edges of tetrahedra");
    let weights = inverse_square_weights(&block.positions, &graph);
    let rows = ConservativeStencils::new(
        &block.positions,
        &block.volumes,
        &block.boundary_vectors,
        &graph,
        weights,
        &ConservativeSettings::default(),
    )
    .expect("a sound block");
    let parts = Parts {
        graph: (graph.offsets(), graph.indices()),
        reverse: rows.reverse_pairs(),
        gradients: &rows.pair_gradients,
        weights: &rows.weights,
        rest: &block.positions,
        volumes: &block.volumes,
    };
    let material = Material::neo_hookean(MATERIAL.0, MATERIAL.1);
    let lame = (material.lame_mu(), material.lame_lambda());
    let new = |precision: Precision| {
        let stencils = Stencils {
            offsets: graph.offsets(),
            indices: graph.indices(),
            weights: &rows.weights,
            matrices: &rows.matrices,
            scales: &rows.scales,
            multipliers: &rows.multipliers,
        };
        let nodes = Nodes {
            rest_positions: &block.positions,
            volumes: &block.volumes,
        };
        let settings = Settings {
            precision,
            ..Settings::default()
        };
        Elastic::new(&stencils, &nodes, &Materials::Uniform(material), &settings)
            .expect("sound rows")
    };
    let mut random = Random::new(1);
    let shake = |x: &DVec3| *x * 1.02 + random.vector(0.002);
    let x: Vec<DVec3> = block.positions.iter().map(shake).collect();
    let mut before = Previous::<f64>::new(&parts, lame, Settings::default().zero_energy_control);
    let mut now = new(Precision::Double);
    let bytes = before.bytes();
    run(
        ("f64", 1e-12),
        &x,
        (bytes, &mut |x, f| before.forces_into(x, f)),
        &mut now,
    );
    let mut before = Previous::<f32>::new(&parts, lame, Settings::default().zero_energy_control);
    let mut now = new(Precision::Single);
    let bytes = before.bytes();
    run(
        ("f32", 1e-6),
        &x,
        (bytes, &mut |x, f| before.forces_into(x, f)),
        &mut now,
    );
}

/// Bytes and forces of the former kernel.
type Before<'a> = (
    usize,
    &'a mut (dyn FnMut(&[DVec3], &mut [DVec3]) -> f64 + Send),
);

fn run((name, allowed): (&str, f64), x: &[DVec3], before: Before<'_>, now: &mut Elastic) {
    let (bytes, before) = before;
    let (mut f, mut g) = (vec![DVec3::ZERO; x.len()], vec![DVec3::ZERO; x.len()]);
    let pairs = now.pair_count() as f64;
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let (mut old, mut new) = (f64::INFINITY, f64::INFINITY);
        pool.expect("threads").install(|| {
            let start = Instant::now();
            let mut rounds = 0;
            while rounds < 5 || start.elapsed().as_secs_f64() < 1.5 {
                time(&mut old, || before(x, &mut f));
                time(&mut new, || now.forces_into(x, &mut g));
                rounds += 1;
            }
        });
        let largest = f.iter().map(|f| f.length()).fold(0.0, f64::max);
        let differences = f.iter().zip(&g).map(|(f, g)| (*f - *g).length());
        let off = differences.fold(0.0, f64::max) / largest;
        assert!(off <= allowed, "forces differ by {off:e}");
        let words = vec![1.0_f64; now.bytes() / 8];
        let mut read = f64::INFINITY;
        for _ in 0..5 {
            time(&mut read, || {
                let mut sum = [0.0; 8];
                for eight in words.chunks_exact(8) {
                    for k in 0..8 {
                        sum[k] += eight[k];
                    }
                }
                std::hint::black_box(sum)[0]
            });
        }
        println!(
            "| {} | {:.1} | {threads} | {name} | {:.2} | {:.2} | {:.2} | {}, {} | {:.2} | {off:.0e} |",
            x.len(),
            pairs / x.len() as f64,
            old * 1e9 / pairs,
            new * 1e9 / pairs,
            old / new,
            bytes / x.len(),
            now.bytes() / x.len(),
            read * 1e9 / pairs,
        );
    }
}
