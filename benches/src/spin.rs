//! A free block that spins while it is cut: what nothing from outside acts on keeps its momenta.

use glam::DVec3;
use phyxel::scene::{Body, Cut, Key, Scene, Shape, Target};
use phyxel::{World, WorldState};
use serde::Serialize;
use serde_json::{Value, json};

use crate::error::StudyError;

/// Full edge lengths (m).
const SIZE: DVec3 = DVec3::new(0.04, 0.05, 0.08);
/// Spin (rad/s).
const SPIN: DVec3 = DVec3::new(3.0, 5.0, 8.0);
/// Scene time (s) of the end; the cuts are done at 0.55.
const END: f64 = 1.0;
/// Largest change of the angular momentum, relative.
pub const DEVIATION: f64 = 1e-10;
/// Mass-proportional damping (1/s) and damping ratio of the cases.
pub const DAMPINGS: [(f64, f64); 4] = [(0.0, 0.0), (0.0, 0.1), (2.0, 0.0), (2.0, 0.1)];

/// What was found with one damping.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Mass-proportional damping (1/s).
    pub damping: f64,
    /// Damping ratio of the stiffest mode.
    pub damping_ratio: f64,
    /// Largest change of the angular momentum about the origin over every step, relative.
    pub angular: f64,
    /// Largest change of the linear momentum, over mass times the speed of a corner.
    pub linear: f64,
    /// Undirected pairs severed.
    pub severed: usize,
}

/// The scene; without gravity and supports, with two cuts that meet the turning block.
fn scene(damping: f64, damping_ratio: f64) -> Scene {
    let mut body = Body::new(Shape::Box { size: SIZE });
    body.sampling.target = Target::Nodes(600);
    body.material.youngs_modulus = 2e4;
    body.material.poissons_ratio = 0.4;
    body.damping = damping;
    body.damping_ratio = damping_ratio;
    let mut scene = Scene::new("spin", vec![body]);
    scene.gravity = None;
    scene.integration.settle = None;
    scene.integration.duration = END;
    let key = |time: f64, x: f64, z: f64| Key::new(time, DVec3::new(x, 0.0, z));
    let half = vec![key(0.05, -0.08, 0.01), key(0.25, 0.0, 0.01)];
    let through = vec![key(0.35, 0.08, -0.01), key(0.55, -0.08, -0.01)];
    for (name, path) in [("half", half), ("through", through)] {
        scene.cuts.push(Cut {
            name: name.to_owned(),
            ..Cut::new(vec![DVec3::Y * -0.1, DVec3::Y * 0.1], path)
        });
    }
    scene
}

/// Spins and cuts the block.
///
/// # Errors
/// If a step fails.
pub fn measure(damping: f64, damping_ratio: f64) -> Result<Finding, StudyError> {
    let mut world = World::new(scene(damping, damping_ratio))?;
    with_velocities(&mut world, |x| SPIN.cross(x))?;
    let body = &world.bodies()[0];
    let (start, first) = (body.motion().angular_momentum(), momentum(&world));
    let scale = body.mass * SPIN.length() * 0.5 * SIZE.length();
    let (mut angular, mut linear) = (0.0_f64, 0.0_f64);
    while world.scene_time().is_some_and(|time| time < END) {
        world.step()?;
        let motion = world.bodies()[0].motion();
        angular = angular.max((motion.angular_momentum() - start).length() / start.length());
        linear = linear.max((momentum(&world) - first).length() / scale);
    }
    let cutting = world.bodies()[0].cutting.as_ref();
    Ok(Finding {
        damping,
        damping_ratio,
        angular,
        linear,
        severed: cutting.map_or(0, phyxel::Cutting::severed_pairs),
    })
}

/// Gives the first body of a new world velocities (m/s) by position (m), through its snapshot; takes one
/// step at rest before, after which all of that is finite and can be written.
fn with_velocities(world: &mut World, velocity: impl Fn(DVec3) -> DVec3) -> Result<(), StudyError> {
    world.step()?;
    let motion = world.bodies()[0].motion();
    let supports = motion.supports();
    let mut velocities: Vec<DVec3> = motion.positions().iter().map(|&x| velocity(x)).collect();
    supports.project(&mut velocities);
    let nodes = motion.masses().iter().zip(&velocities);
    let kinetic: f64 = nodes.map(|(m, v)| 0.5 * m * v.length_squared()).sum();
    let mut kept = serde_json::to_value(world.state())?;
    // A step that is rolled back must not end at rest.
    if let Some(snapshot) = kept.pointer_mut("/now/kept") {
        *snapshot = Value::Null;
    }
    let motion = kept
        .pointer_mut("/bodies/0/motion")
        .and_then(Value::as_object_mut);
    if let Some(motion) = motion {
        motion.insert("velocities".to_owned(), json!(velocities));
        if let Some(audit) = motion.get_mut("audit").and_then(Value::as_object_mut) {
            audit.insert("kinetic".to_owned(), json!(kinetic));
            audit.insert("initial".to_owned(), json!(kinetic));
        }
    }
    let state: WorldState = serde_json::from_value(kept)?;
    world.restore(state, |_, _| ())?;
    Ok(())
}

/// Linear momentum (kg m/s).
fn momentum(world: &World) -> DVec3 {
    let motion = world.bodies()[0].motion();
    let nodes = motion.masses().iter().zip(motion.velocities());
    nodes.map(|(m, v)| *v * *m).sum()
}

/// What exceeds a limit, in words.
pub fn breaches(finding: &Finding) -> Vec<String> {
    let mut found = Vec::new();
    let of = format!(
        "spin with damping {} and ratio {}",
        finding.damping, finding.damping_ratio
    );
    if finding.severed == 0 {
        found.push(format!("{of}: nothing is cut"));
    }
    for (what, value) in [("angular", finding.angular), ("linear", finding.linear)] {
        if value.is_nan() || value > DEVIATION {
            found.push(format!("{of}: {what} momentum changes by {value:.1e}"));
        }
    }
    found
}
