//! A field known at scattered points, asked anywhere.

use phyxel_mls::{Cloud, CloudSettings, glam::DVec3};

/// Digits of a number in a base, mirrored at the point: Halton's points are made of them.
fn mirrored(mut number: u32, base: u32) -> f64 {
    let (mut x, mut place) = (0.0, 1.0);
    while number > 0 {
        place /= f64::from(base);
        x += f64::from(number % base) * place;
        number /= base;
    }
    x
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let at = |i| DVec3::new(mirrored(i, 2), mirrored(i, 3), mirrored(i, 5));
    let points: Vec<DVec3> = (1..3000).map(at).collect();
    let wave = |x: &DVec3| (3.0 * x.x).sin() + x.y * x.z;
    let field: Vec<f64> = points.iter().map(wave).collect();

    let cloud = Cloud::new(&points, &CloudSettings::default())?;
    let here = cloud.sample(DVec3::splat(0.5), &field)?;

    println!("{:.4}, slope {:.3} along x", here.value, here.gradient.x);
    assert!((here.value - wave(&DVec3::splat(0.5))).abs() < 1e-3);
    assert!((here.gradient.x - 3.0 * 1.5_f64.cos()).abs() < 0.02);
    Ok(())
}
