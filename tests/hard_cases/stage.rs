//! Scenes of the hard cases, and what is checked in each of them.

use glam::DVec3;
use phyxel::{Body, Cutting, World, WorldError};

/// The fixed block of most cases: 40 x 40 x 60 mm, its top fixed.
pub(super) const BLOCK: &str =
    "(name: \"block\", shape: Box(size: (0.04, 0.04, 0.06)), sampling: (target: Nodes(500)),
    material: (youngs_modulus: 2e4, poissons_ratio: 0.4, density: 1000),
    damping: 4)";
pub(super) const HELD: &str =
    "supports: [(region: HalfSpace(point: (0, 0, 0.0299), normal: (0, 0, 1)))],";
pub(super) const AT_ONCE: &str =
    "integration: (settle: None), gravity: (acceleration: (0, 0, -9.81), ramp: 0),";

/// A world of `bodies` and what else a scene says.
pub(super) fn world(bodies: &str, rest: &str) -> World {
    crate::world(&format!("(version: 1, bodies: [{bodies}], {rest})"))
}

/// Steps to `time` (s); what must hold in every case is checked on the way.
pub(super) fn play(world: &mut World, time: f64) -> Result<(), WorldError> {
    while world.time() < time {
        world.step()?;
        if world.steps().is_multiple_of(50) {
            check(world);
        }
    }
    check(world);
    Ok(())
}

pub(super) fn check(world: &World) {
    for body in world.bodies() {
        let state = body.motion().state();
        let mut moving = state.positions.iter().chain(&state.velocities);
        assert!(moving.all(|v| v.is_finite()), "{}", body.name);
        let mass: f64 = body.motion().masses().iter().sum();
        let kept = mass / body.mass;
        assert!((kept - 1.0).abs() < 1e-12, "mass {mass}");
        let sum: DVec3 = state.forces.iter().sum();
        let size: f64 = state.forces.iter().map(|f| f.length()).sum();
        assert!(sum.length() <= 1e-11 * size, "{sum} of {size} N within");
    }
}

/// Energy is accounted for in every body but for so small a fraction.
pub(super) fn audit_closes(world: &World, most: f64) {
    for body in world.bodies() {
        let off = body.motion().audit().unexplained();
        assert!(off < most, "{}: audit off by {off}", body.name);
    }
}

/// Sizes of the connected pieces, largest first.
pub(super) fn pieces(world: &World) -> Vec<u32> {
    let mut sizes = world.bodies()[0].pieces().sizes;
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    sizes
}

/// What cuts the first body, which they do.
pub(super) fn cutting(world: &World) -> &Cutting {
    world.bodies()[0].cutting.as_ref().expect("it was cut")
}

pub(super) fn severed(world: &World) -> usize {
    cutting(world).severed_pairs()
}

/// A body, held and let go at once, with these strokes.
pub(super) fn cut(body: &str, strokes: &[String]) -> World {
    let strokes = strokes.join(", ");
    world(body, &format!("cuts: [{strokes}], {HELD} {AT_ONCE}"))
}

/// A stroke of a blade whose edge runs along `edge` through `from` and `to`.
pub(super) fn stroke(name: &str, edge: DVec3, from: DVec3, to: DVec3, times: [f64; 2]) -> String {
    let list = |v: DVec3| format!("({}, {}, {})", v.x, v.y, v.z);
    format!(
        "(name: \"{name}\", edge: [{}, {}], path: [(time: {}, position: {}), (time: {}, position: {})], \
         capture: Distance(0.01))",
        list(edge * -0.5),
        list(edge * 0.5),
        times[0],
        list(from),
        times[1],
        list(to)
    )
}

/// A horizontal cut through the whole block at a height (m).
pub(super) fn across(name: &str, height: f64, times: [f64; 2]) -> String {
    let at = |x: f64| DVec3::new(x, 0.0, height);
    stroke(name, DVec3::Y * 0.08, at(-0.04), at(0.04), times)
}

/// How far (m) the node that moved most is from its position at rest.
pub(super) fn largest_way(body: &Body) -> f64 {
    let pairs = body.motion().positions().iter().zip(&body.rest);
    pairs.map(|(x, rest)| x.distance(*rest)).fold(0.0, f64::max)
}
