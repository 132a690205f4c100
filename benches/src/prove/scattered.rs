//! Interpolates a smooth function from 10,000 random points at 100,000 others; the same task with `SciPy`, whose
//! points are the same, is `python3 benches/peers/interpolation.py`.

use std::time::Instant;

use glam::DVec3;
use phyxel_mls::{Cloud, CloudSettings, Dimension, Order};

use super::Proof;

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

pub(super) fn interpolation_of_scattered_points(proof: &mut Proof) {
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
