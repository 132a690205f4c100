//! One evaluation for an instruction counter. Prints nodes and pairs; run it under
//! `valgrind --tool=callgrind --toggle-collect='*forces_into*'` and divide.
//!
//! `cargo build --release -p phyxel-elastic --example instructions`, then
//! `valgrind --tool=callgrind ... instructions [double|single]`.
#![allow(clippy::print_stdout, reason = "prints what to divide by")]

use glam::DVec3;
use phyxel_elastic::Precision;
use testkit::block::Block;
use testkit::cloud::Random;

mod body;

fn main() {
    let single = std::env::args().any(|a| a == "single");
    let block = Block::eighteen([12; 3], 0.1);
    let precision = if single {
        Precision::Single
    } else {
        Precision::Double
    };
    let mut body = body::body(&block, precision);
    let mut random = Random::new(1);
    let x: Vec<DVec3> = block
        .positions
        .iter()
        .map(|x| *x * 1.02 + random.vector(0.002))
        .collect();
    let mut forces = vec![DVec3::ZERO; x.len()];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let energy = pool
        .expect("one thread")
        .install(|| body.forces_into(&x, &mut forces));
    println!(
        "{} nodes, {} pairs, energy {energy:.6e} J",
        body.node_count(),
        body.pair_count()
    );
    // Momentum is kept, up to the round-off of the pairs.
    let sum: DVec3 = forces.iter().sum();
    let size: f64 = forces.iter().map(|f| f.length()).sum();
    let allowed = if single { 1e-6 } else { 1e-13 };
    assert!(
        sum.length() <= allowed * size,
        "forces sum to {sum} of {size} N"
    );
}
