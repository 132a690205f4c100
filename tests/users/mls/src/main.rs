//! A field known at scattered points, asked anywhere.

use phyxel_mls::{Cloud, CloudSettings, glam::DVec3};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Halton's points in the unit cube.
    let radical = |mut i: u32, b: u32| {
        let (mut x, mut place) = (0.0, 1.0);
        while i > 0 {
            place /= f64::from(b);
            x += f64::from(i % b) * place;
            i /= b;
        }
        x
    };
    let at = |i| DVec3::new(radical(i, 2), radical(i, 3), radical(i, 5));
    let points: Vec<DVec3> = (1..3000).map(at).collect();
    let field: Vec<f64> = points.iter().map(|x| (3.0 * x.x).sin() + x.y * x.z).collect();
    let cloud = Cloud::new(&points, &CloudSettings::default())?;
    let here = cloud.sample(DVec3::splat(0.5), &field)?;
    println!("{:.4} with the slope {:.3} along x", here.value, here.gradient.x);
    assert!((here.value - (1.5_f64.sin() + 0.25)).abs() < 1e-3);
    assert!((here.gradient.x - 3.0 * 1.5_f64.cos()).abs() < 0.02);
    Ok(())
}
