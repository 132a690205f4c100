//! Error of values and gradients of `sin 3x · eʸ z` in a unit cube, from scattered points, beside its closed form.
//! `cargo run --release --example convergence`
#![allow(clippy::print_stdout, reason = "prints a table")]

use phyxel_mls::{Cloud, CloudError, CloudSettings, glam::DVec3};

fn field(x: DVec3) -> f64 {
    (3.0 * x.x).sin() * x.y.exp() * x.z
}

fn gradient(x: DVec3) -> DVec3 {
    let (sin, cos) = (3.0 * x.x).sin_cos();
    DVec3::new(3.0 * cos * x.z, sin * x.z, sin) * x.y.exp()
}

/// `count` points in the unit cube: the Halton sequence in bases 2, 3 and 5.
fn scattered(count: u32) -> Vec<DVec3> {
    let digits = |mut i: u32, base: u32| {
        let (mut value, mut place) = (0.0, 1.0);
        while i > 0 {
            place /= f64::from(base);
            value += place * f64::from(i % base);
            i /= base;
        }
        value
    };
    let point = |i| DVec3::new(digits(i, 2), digits(i, 3), digits(i, 5));
    (1..=count).map(point).collect()
}

fn main() -> Result<(), CloudError> {
    // Inside, and on no node.
    let at = |i: u32| DVec3::splat(0.1 + 0.8 * f64::from(i) / 100.0) * DVec3::new(1.0, 0.9, 0.8);
    let queries: Vec<DVec3> = (0..=100).map(at).collect();
    println!("  points  spacing  value, largest error  gradient, largest error");
    for count in [1_000, 8_000, 64_000] {
        let points = scattered(count);
        let values: Vec<f64> = points.iter().map(|&x| field(x)).collect();
        let cloud = Cloud::new(&points, &CloudSettings::default())?;
        let (mut value, mut slope) = (0.0_f64, 0.0_f64);
        for (&x, sample) in queries.iter().zip(cloud.samples(&queries, &values)) {
            let sample = sample.expect("queries lie among the points");
            value = value.max((sample.value - field(x)).abs());
            slope = slope.max((sample.gradient - gradient(x)).length());
        }
        let spacing = f64::from(count).powf(-1.0 / 3.0);
        println!("{count:8}  {spacing:7.3}  {value:20.1e}  {slope:23.1e}");
    }
    Ok(())
}
