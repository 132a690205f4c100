//! A hundred thousand steps with twenty cuts: energies stay accounted for, memory stays as it is.
//!
//! `cargo run --release -p phyxel --example long_run`

#![allow(clippy::print_stdout, reason = "it prints what it found")]

use glam::DVec3;
use phyxel::World;
use phyxel::scene::{
    Body, Capture, Cut, Gravity, Key, Region, Scene, Shape, Support, SupportMotion, Target,
};

const STEPS: u64 = 100_000;
const CUTS: u32 = 20;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut world = World::new(scene())?;
    let duration = world.step_size() * 1e5;
    println!(
        "{:>8} {:>6} {:>10} {:>12} {:>10}",
        "steps", "cuts", "severed", "unexplained", "KiB"
    );
    let mut after_cuts = None;
    for part in 1..=10 {
        while world.steps() < STEPS / 10 * part {
            world.step()?;
        }
        let member = &world.members()[0];
        let audit = member.body.motion.audit();
        let off = audit.energy_error().abs() / audit.scale();
        let bytes: usize = world.parts().iter().map(|part| part.bytes).sum();
        let time = world.scene_time().unwrap_or(0.0);
        let done = world
            .scene()
            .cuts
            .iter()
            .filter(|cut| cut.end() <= time)
            .count();
        let severed = member
            .cutting
            .as_ref()
            .map_or(0, phyxel::Cutting::severed_pairs);
        println!(
            "{:>8} {done:>6} {severed:>10} {off:>12.1e} {:>10}",
            world.steps(),
            bytes / 1024
        );
        assert!(off < 0.015, "the audit is off by {off}");
        if done == world.scene().cuts.len() {
            let before = *after_cuts.get_or_insert(bytes);
            assert_eq!(bytes, before, "memory grows without a cut");
        }
    }
    assert!(after_cuts.is_some(), "all cuts are done");
    println!(
        "{:.1} s simulated, {duration:.1} s at the first step",
        world.time()
    );
    Ok(())
}

/// A hanging block, cut from its four sides in turn, half through.
fn scene() -> Scene {
    let mut body = Body::new(Shape::Box {
        size: DVec3::new(0.04, 0.04, 0.12),
    });
    body.sampling.target = Target::Nodes(600);
    body.material.youngs_modulus = 2e4;
    body.material.stabilization = 0.3;
    body.damping_ratio = 0.1;
    let mut scene = Scene::new("long", vec![body]);
    scene.gravity = Some(Gravity::default());
    scene.supports.push(Support {
        body: None,
        region: Region::HalfSpace {
            point: DVec3::Z * 0.0599,
            normal: DVec3::Z,
        },
        motion: SupportMotion::Fixed,
    });
    scene.integration.settle = None;
    scene.integration.duration = 1e3;
    for k in 0..CUTS {
        let angle = std::f64::consts::FRAC_PI_2 * f64::from(k);
        let side = DVec3::new(angle.cos(), angle.sin(), 0.0);
        let along = DVec3::new(-side.y, side.x, 0.0);
        let height = DVec3::Z * (0.045 - 0.005 * f64::from(k));
        let start = 0.5 + 1.2 * f64::from(k);
        let key = |time: f64, reach: f64| Key {
            time,
            position: side * reach + height,
            rotation: DVec3::ZERO,
        };
        scene.cuts.push(Cut {
            name: format!("cut {k}"),
            body: None,
            edge: vec![along * -0.05, along * 0.05],
            path: vec![key(start, 0.05), key(start + 0.6, 0.005)],
            capture: Capture::Distance(0.004),
            weld_tolerance: None,
        });
    }
    scene
}
