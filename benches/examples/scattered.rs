//! Interpolates a smooth function from 10,000 random points at 100,000 others.
//!
//! `cargo run --release -p benches --example scattered`; the same task with `SciPy` is
//! `python3 benches/peers/interpolation.py`, whose points are the same. Fails if an error is above what the
//! table of peers in `benches/README.md` states.

#![allow(clippy::print_stdout, reason = "an example prints its table")]

use std::error::Error;
use std::time::Instant;

use glam::DVec3;
use phyxel_mls::{Cloud, CloudSettings, Dimension, Order};

/// Points that carry the function, and those asked.
const NODES: usize = 10_000;
const QUERIES: usize = 100_000;

fn field(x: DVec3) -> f64 {
    (3.0 * x.x).sin() * (2.0 * x.y).cos() + x.z * x.z * x.x
}

/// Uniform in the unit cube: `SplitMix64`, the upper 53 bits of a number after the other.
fn points(count: usize, mut state: u64) -> Vec<DVec3> {
    let mut unit = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..count)
        .map(|_| DVec3::from_array(std::array::from_fn(|_| unit())))
        .collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    let (nodes, queries) = (points(NODES, 1), points(QUERIES, 2));
    let values: Vec<f64> = nodes.iter().map(|&x| field(x)).collect();
    for (order, allowed) in [(Order::Linear, 1e-2), (Order::Quadratic, 2e-3)] {
        for threads in [1, 0] {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()?;
            let start = Instant::now();
            let (made, found) = pool.install(|| {
                let cloud = Cloud::new(&nodes, &CloudSettings::new(order, Dimension::Three));
                let made = start.elapsed();
                cloud.map(|cloud| (made, cloud.values(&queries, &values)))
            })?;
            let asked = start.elapsed() - made;
            let mut squares = 0.0;
            for (x, value) in queries.iter().zip(found) {
                squares += (value? - field(*x)).powi(2);
            }
            let error = (squares / QUERIES as f64).sqrt();
            println!(
                "{order:?}, {} threads: {:.0} ms to make, {:.0} ms to ask, RMS error {error:.2e}",
                pool.current_num_threads(),
                made.as_secs_f64() * 1e3,
                asked.as_secs_f64() * 1e3,
            );
            assert!(error < allowed, "the error is above what is stated");
        }
    }
    Ok(())
}
