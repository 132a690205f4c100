//! A world in ten lines, without a scene file: a column hangs from its top and stretches by its own
//! weight, by `rho g L^2 / (2 E)` for a slender one (Timoshenko and Goodier 1970, art. 96).
//!
//! `cargo run --release -p phyxel --example hanging_column`

#![allow(clippy::print_stdout, reason = "it prints what it found")]

use glam::DVec3;
use phyxel::World;
use phyxel::scene::{Body, Region, Scene, Shape, Support, Target};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let length = 0.1;
    let mut body = Body::new(Shape::Box {
        size: DVec3::new(0.02, 0.02, length),
    });
    body.material.youngs_modulus = 2e5;
    body.material.poissons_ratio = 0.3;
    body.damping = 100.0;
    body.sampling.target = Target::Nodes(3000);
    let stretch = body.material.density * 9.81 * length * length / (2.0 * 2e5);
    let mut scene = Scene::new("column", vec![body]);
    scene.supports.push(Support::fixed(Region::HalfSpace {
        point: DVec3::Z * 0.499 * length,
        normal: DVec3::Z,
    }));
    scene.integration.settle = None;

    let mut world = World::new(scene)?;
    world.play(0.4, |_| ())?;
    let body = &world.bodies()[0];
    let foot = |x: &DVec3| x.z < -0.499 * length;
    let sunk: Vec<f64> = std::iter::zip(&body.rest, world.positions(0))
        .filter(|(rest, _)| foot(rest))
        .map(|(rest, now)| rest.z - now.z)
        .collect();
    let mean = sunk.iter().sum::<f64>() / f64::from(u32::try_from(sunk.len())?);
    let error = mean / stretch - 1.0;
    println!(
        "{} nodes, {} steps of {:.2} ms: the foot sinks by {:.3} mm, {:+.1} % of the slender column's {:.3} mm",
        body.rest.len(),
        world.steps(),
        1e3 * world.step_size(),
        1e3 * mean,
        1e2 * error,
        1e3 * stretch
    );
    assert!(error.abs() < 0.03, "the stretch is off by {error}");
    Ok(())
}
