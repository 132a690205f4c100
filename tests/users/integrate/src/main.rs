//! A mass on a spring that is free to swing: it is let down to rest, pushed, and swings.

use phyxel_integrate::glam::DVec3;
use phyxel_integrate::{
    BoundaryConditions, Differences, Motion, MotionSettings, NewtonSettings, StaticLoad,
    solve_static,
};

/// A spring of 500 N/m, 1 m long at rest, to the origin.
fn spring(x: &[DVec3], forces: &mut [DVec3]) -> f64 {
    let stretch = x[0].length() - 1.0;
    forces[0] = x[0].normalize() * (-500.0 * stretch);
    250.0 * stretch * stretch
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let weight = [DVec3::Z * (-2.0 * 9.81)];
    let mut x = [DVec3::new(0.1, 0.0, -1.1)];
    let (free, load) = (BoundaryConditions::free(1), StaticLoad::of(&weight));
    let mut law = Differences::new(spring, 1.0);
    solve_static(&mut law, &mut x, &free, &load, &NewtonSettings::default())?;
    let start = [x[0] + DVec3::X * 0.01];
    let mut swing = Motion::new(&start, &[2.0], free, MotionSettings::default())?;
    swing.set_loads(&weight)?;
    let period = std::f64::consts::TAU * (-x[0].z / 9.81).sqrt();
    swing.advance_to(period, 1e-3, spring)?;
    let back = swing.positions()[0].x;
    println!("rests at {:.5} m, is back at {back:.5} m", x[0].z);
    assert!((x[0].z + 1.03924).abs() < 1e-6 && (back - 0.01).abs() < 1e-4);
    Ok(())
}
