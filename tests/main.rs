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
/// Every key of a scene: that it has an effect, and the right one.
mod scene_keys;
/// A world in a program: how its scene starts, and what is refused.
mod scene_properties;
mod scene_start;
/// Scenes with tools: weight on a table, a dropped ball, a torn surface.
mod scene_tools;

use std::collections::BTreeMap;
use std::path::Path;

use phyxel::World;
use phyxel::scene::Scene;
use phyxel_cli::run::Summary;

/// The scene of a text.
fn scene(text: &str) -> Scene {
    let scene = phyxel_scene::from_text(text, "test", "", &[]);
    scene.unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Its world.
fn world(text: &str) -> World {
    World::new(scene(text)).expect("it can be built")
}

/// Files of a run by name.
type Files = BTreeMap<String, Vec<u8>>;

/// What a run wrote into a folder, but for files of these names, and its summary without what says how long it took.
fn files(summary: &Summary, folder: &Path, but: &[&str]) -> Files {
    let mut json = serde_json::to_value(summary).expect("a summary is JSON");
    json.as_object_mut().expect("an object").remove("timings");
    let mut files = BTreeMap::from([("summary".to_owned(), json.to_string().into_bytes())]);
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.strip_prefix(folder).expect("below the folder");
            let name = name.to_string_lossy().into_owned();
            if path.is_dir() {
                folders.push(path);
            } else if !but.contains(&&*name) {
                files.insert(name, std::fs::read(&path).expect("a file"));
            }
        }
    }
    files
}

/// Steps to a time (s).
fn play(world: &mut World, until: f64) {
    while world.time() < until {
        world.step().expect("it steps");
    }
}
