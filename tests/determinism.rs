//! The same scene gives bitwise identical results, at any number of threads.

use std::path::Path;
use std::sync::LazyLock;

use phyxel::scene::Scene;
use phyxel_cli::output::{Interrupt, read_checkpoint, read_input};
use phyxel_cli::run::{CHECKPOINT, RunError, RunOptions, RunState, Summary, replay, resume, run};

use crate::Files;

/// A block that hangs, is cut through, tears and is pushed while it settles into motion, touches itself, and is drawn.
const SCENE: &str = include_str!("determinism.ron");

fn scene() -> Scene {
    crate::scene(SCENE)
}

/// Everything of a run that must not depend on the machine's load: files by name, the summary
/// without its timings.
fn run_with(threads: usize, folder: &Path) -> Files {
    let summary = run(&scene(), &RunOptions::quiet(folder, threads)).expect("the scene runs");
    results(&summary, folder)
}

fn results(summary: &Summary, folder: &Path) -> Files {
    let cuts = summary.cuts.as_ref().expect("the scene cuts");
    assert!(cuts.severed_pairs > 50, "the blade severs: {cuts:?}");
    // Twelve samples of the blade and its start; the rest tears.
    assert!(cuts.captures > 13, "it tears: {cuts:?}");
    let unexplained = summary.bodies[0].energy.imbalance;
    assert!(unexplained < 1e-2, "the audit closes");
    let freed = cuts.strokes.iter().map(|stroke| stroke.energy);
    let freed = freed.map(|energy| energy.released - energy.added - energy.decay);
    let freed: f64 = freed.sum();
    let whole = summary.bodies[0].energy.released_by_cuts;
    assert!(
        (freed - whole).abs() <= 1e-9 * whole.abs(),
        "strokes free {freed} J, all cuts {whole} J: {cuts:?}"
    );
    assert!(summary.tools[0].largest_force > 0.01, "the tool pushes");
    let files = crate::files(summary, folder, &["summary.json"]);
    for name in [
        "history.csv",
        "tools.csv",
        "contacts.csv",
        "input.csv",
        "animation.png",
        CHECKPOINT,
        "final-block.vtk",
        "final-block.ply",
        "frames/frame-00000.png",
        "states/block-00003.vtk",
        "states/block-00007.ply",
        "states/block.vtk.series",
    ] {
        assert!(files.contains_key(name), "no {name}: {:?}", files.keys());
    }
    files
}

/// A run in one go on one thread, once for all tests: its files, and how often it looked for an interrupt.
static WHOLE: LazyLock<(Files, u64)> = LazyLock::new(|| {
    let root = tempfile::tempdir().expect("a temporary folder");
    let many = 1_000_000;
    let never = Interrupt::after(many);
    let summary = run(&scene(), &stopping(&never, 1, root.path())).expect("the scene runs");
    let looks = many - never.left().expect("it counts");
    (results(&summary, root.path()), looks)
});

fn stopping(stop: &Interrupt, threads: usize, folder: &Path) -> RunOptions {
    RunOptions {
        interrupt: Some(stop.clone()),
        ..RunOptions::quiet(folder, threads)
    }
}

#[test]
fn two_threads_and_a_second_run_write_the_bits_of_one() {
    let root = tempfile::tempdir().expect("a temporary folder");
    assert!(WHOLE.0.len() > 5, "{} files", WHOLE.0.len());
    for (label, threads) in [("again", 1), ("two", 2)] {
        let other = run_with(threads, &root.path().join(label));
        same(label, &WHOLE.0, &other);
    }
}

fn same(label: &str, a: &Files, b: &Files) {
    assert_eq!(a.len(), b.len(), "{label}: {:?}, {:?}", a.keys(), b.keys());
    for (name, content) in a {
        assert!(b.get(name) == Some(content), "{label}: {name} differs");
    }
}

/// A run that is stopped, while it settles or with the blade in the tissue, and resumed from its
/// checkpoint, writes what a run in one go writes: history, frames, animation, summary.
#[test]
fn a_resumed_run_writes_the_bits_of_a_run_in_one_go() {
    let root = tempfile::tempdir().expect("a temporary folder");
    // Settling takes the first five of thirteen parts, the blade is in the tissue from the sixth on.
    for (label, part) in [("settling", 2), ("cutting", 9), ("through", 12)] {
        let folder = root.path().join(label);
        let stop = Interrupt::after(WHOLE.1 * part / 13);
        let outcome = run(&scene(), &stopping(&stop, 2, &folder));
        let stopped = matches!(outcome, Err(RunError::Interrupted { .. }));
        assert!(stopped, "{label}: {outcome:?}");
        let (scene, state): (_, RunState) =
            read_checkpoint(&folder.join(CHECKPOINT), &[]).expect("it was written");
        let summary = resume(&scene, state, &RunOptions::quiet(&folder, 1)).expect("it continues");
        same(label, &WHOLE.0, &results(&summary, &folder));
    }
}

/// What tools and blades did, as a run wrote it down, makes the same run again from a scene whose
/// paths lead nowhere.
#[test]
fn a_replayed_run_writes_the_bits_of_the_run_that_was_recorded() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let first = &WHOLE.0;
    let mut still = scene();
    let file = root.path().join("input.csv");
    std::fs::write(&file, &first["input.csv"]).expect("it can be written");
    let inputs = read_input(&file, &still).expect("it reads");
    assert!(inputs.len() > 100, "{} inputs", inputs.len());
    for key in &mut still.cuts[0].path {
        key.position.x += 1.0;
    }
    still.tools[0].path.truncate(1);
    // Where the blade's picture is comes from the scene, and so does that of a checkpoint.
    let same_but_frames = |files: &Files| -> Files {
        let of_scene = ["scene.ron", CHECKPOINT];
        let mut files = files.clone();
        files.retain(|name, _| !name.ends_with(".png") && !of_scene.contains(&&**name));
        files
    };
    let folder = root.path().join("again");
    let summary = replay(&still, inputs, &RunOptions::quiet(&folder, 2)).expect("it runs");
    let again = results(&summary, &folder);
    same("again", &same_but_frames(first), &same_but_frames(&again));
}
