//! A pendulum on a spring: forces as a closure, the tangent by differences; it comes to rest and swings.

use phyxel_integrate::glam::DVec3;
use phyxel_integrate::{Differences, Motion, MotionSettings, NewtonSettings, StaticLoad, Supports, solve_static};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // 1 m long and 500 N/m, a mass of 2 kg at its end.
    let spring = |x: &[DVec3], f: &mut [DVec3]| {
        let stretch = x[0].length() - 1.0;
        f[0] = x[0].normalize() * (-500.0 * stretch);
        250.0 * stretch * stretch
    };
    let weight = [DVec3::Z * (-2.0 * 9.81)];
    let mut x = [DVec3::new(0.1, 0.0, -1.1)];
    let load = StaticLoad { forces: &weight, ..StaticLoad::default() };
    solve_static(&mut Differences::new(spring, 1.0), &mut x, &Supports::free(1), &load, &NewtonSettings::default())?;
    let mut swing = Motion::new(&[x[0] + DVec3::X * 0.01], &[2.0], Supports::free(1), MotionSettings::default())?;
    swing.set_loads(&weight)?;
    let period = std::f64::consts::TAU * (x[0].length() / 9.81_f64).sqrt();
    swing.advance_to(period, 1e-3, spring)?;
    println!("at rest at {:.4} m, after a period at x = {:.4} m", x[0].z, swing.positions()[0].x - x[0].x);
    assert!((x[0].z + 1.03924).abs() < 1e-6);
    assert!((swing.positions()[0].x - x[0].x - 0.01).abs() < 1e-4);
    Ok(())
}
