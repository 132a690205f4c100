//! Interpolates a smooth function from 10,000 random points at 100,000 others; the same task with `SciPy`, whose
//! points are the same, is `python3 benches/peers/interpolation.py`.

use std::time::Instant;

use glam::DVec3;
use phyxel_mls::{Cloud, CloudSettings, Dimension, Order};
use testkit::cloud::Random;

use super::Proof;

/// Points that carry the function, and those asked.
const NODES: usize = 10_000;
const QUERIES: usize = 100_000;

fn field(x: DVec3) -> f64 {
    (3.0 * x.x).sin() * (2.0 * x.y).cos() + x.z * x.z * x.x
}

/// Uniform in the unit cube.
fn points(count: usize, seed: u64) -> Vec<DVec3> {
    let mut random = Random::new(seed);
    let mut point = || DVec3::from_array([0.0; 3].map(|_: f64| random.unit()));
    (0..count).map(|_| point()).collect()
}

pub(super) fn scattered(proof: &mut Proof) {
    let (nodes, queries) = (points(NODES, 1), points(QUERIES, 2));
    let values: Vec<f64> = nodes.iter().map(|&x| field(x)).collect();
    for (order, allowed) in [(Order::Linear, 1e-2), (Order::Quadratic, 2e-3)] {
        let start = Instant::now();
        let cloud = Cloud::new(&nodes, &CloudSettings::new(order, Dimension::Three)).unwrap();
        let made = start.elapsed();
        let mut squares = 0.0;
        for (x, value) in queries.iter().zip(cloud.values(&queries, &values)) {
            squares += (value.unwrap() - field(*x)).powi(2);
        }
        let asked = start.elapsed() - made;
        let what = format!(
            "{order:?}: {:.0} ms to make, {:.0} ms to ask, RMS error",
            made.as_secs_f64() * 1e3,
            asked.as_secs_f64() * 1e3
        );
        proof.below(what, (squares / QUERIES as f64).sqrt(), allowed);
    }
}
