//! Three masses on springs drop on a plane and bounce: their largest energy over the start's.
//! `cargo run --release --example drop`
#![allow(clippy::print_stdout, reason = "prints a table")]

use phyxel_integrate::glam::DVec3;
use phyxel_integrate::{
    BoundaryConditions, Contact, ContactSettings, ContactSurface, Differences, Implicit,
    ImplicitSettings, Motion, MotionSettings, Pose, RigidShape, RigidTool,
};

const MASS: f64 = 0.01; // kg
const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81); // m/s²

/// A triangle of springs of 50 N/m, 4 cm long at rest.
fn springs(x: &[DVec3], forces: &mut [DVec3]) -> f64 {
    forces.fill(DVec3::ZERO);
    let mut energy = 0.0;
    for (a, b) in [(0, 1), (1, 2), (2, 0)] {
        let along = x[b] - x[a];
        let stretch = along.length() - 0.04;
        energy += 0.5 * 50.0 * stretch * stretch;
        forces[a] += along.normalize() * (50.0 * stretch);
        forces[b] -= along.normalize() * (50.0 * stretch);
    }
    energy
}

/// Kinetic energy, weight, springs and contact (J).
fn energy(motion: &Motion, floor: &RigidTool) -> f64 {
    let (x, v) = (motion.positions(), motion.velocities());
    let mass = |i: usize| MASS * (0.5 * v[i].length_squared() - GRAVITY.dot(x[i]));
    (0..3).map(mass).sum::<f64>() + springs(x, &mut [DVec3::ZERO; 3]) + floor.load.energy
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("step, ms  largest energy / start  bounces in 2 s");
    for step in [1e-3, 2e-3, 5e-3] {
        let start =
            [(0.0, 0.02), (0.04, 0.02), (0.02, 0.054641)].map(|(x, z)| DVec3::new(x, 0.0, z));
        let free = BoundaryConditions::free(3);
        let mut motion = Motion::new(&start, &[MASS; 3], free, MotionSettings::default())?;
        motion.set_loads(&[GRAVITY * MASS; 3])?;
        let surface = ContactSurface::from_nodes(&[0, 1, 2], &[1e-4; 3], 3)?; // 1 cm² each
        let contact = Contact::new(surface, ContactSettings::new(1e7));
        let plane = RigidShape::Plane { normal: DVec3::Z };
        let mut floor = RigidTool::standing(plane, Pose::IDENTITY, contact);
        let mut implicit = Implicit::new(ImplicitSettings::default())?;
        let mut law = Differences::new(springs, 0.04);
        let first = energy(&motion, &floor);
        let (mut largest, mut bounces, mut above) = (first, 0, true);
        while motion.time() < 2.0 {
            implicit.step_with(&mut motion, step, &mut law, &mut [&mut floor])?;
            largest = largest.max(energy(&motion, &floor));
            bounces += u32::from(above && floor.load.area > 0.0);
            above = floor.load.area <= 0.0;
        }
        println!("{:8}  {:22.6}  {bounces:14}", 1e3 * step, largest / first);
    }
    Ok(())
}
