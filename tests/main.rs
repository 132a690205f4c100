//! What needs two crates or more: one test binary, one module per subject.
#![allow(
    clippy::missing_assert_message,
    reason = "a failing test names its line; messages are given where the values are not in sight"
)]

/// Bitwise identical results from any number of threads, and from a second run.
mod determinism;
/// Hard cases, each with what must happen.
mod hard_cases;
/// Cuts by the crates below the world: no capture adds energy.
mod leaves_cut;
/// A scene pays for what it needs and for nothing else.
mod model_only;
/// Conservative stencils on sampled livers.
mod organ_stencils;
/// Every key of a scene: that it has an effect, and the right one.
mod scene_keys;
/// A world in a program: how its scene starts, and what is refused.
mod scene_properties;
mod scene_start;
/// Scenes with tools: weight on a table, a dropped ball, a torn surface.
mod scene_tools;

use phyxel::World;
use phyxel::scene::Scene;

/// The scene of a text.
fn scene(text: &str) -> Scene {
    let scene = phyxel_scene::from_text(text, "test", "", &[]);
    scene.unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Its world.
fn world(text: &str) -> World {
    World::new(scene(text)).expect("it can be built")
}

/// Steps to a time (s).
fn play(world: &mut World, until: f64) {
    while world.time() < until {
        world.step().expect("it steps");
    }
}
