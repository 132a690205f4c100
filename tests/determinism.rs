//! The same scene gives the same bits, at any number of threads.

use std::path::Path;

use phyxel::run::{RunOptions, run};
use phyxel::scene::Scene;

/// A block that hangs, is cut through while it settles into motion, and is drawn.
const SCENE: &str = r#"(
    version: 1,
    name: "bits",
    bodies: [(
        name: "block",
        shape: Box(size: (0.06, 0.03, 0.04)),
        sampling: (target: Nodes(1200)),
        material: (youngs_modulus: 2e4, poissons_ratio: 0.4, density: 1000),
        surfels: (target: Count(2000)),
    )],
    supports: [(region: HalfSpace(point: (0, 0, 0.019), normal: (0, 0, 1)))],
    cuts: [(
        edge: [(0, 0, -0.03), (0, 0, 0.005)],
        path: [
            (time: 0.02, position: (0.003, -0.03, 0)),
            (time: 0.12, position: (0.003, 0.03, 0)),
        ],
        capture: Distance(0.005),
    )],
    integration: (duration: 0.16, settle: Some((limit: 0.1))),
    pictures: Some((width: 160, height: 90, rate: 20, animation: true)),
)"#;

/// Everything of a run that must not depend on the machine's load: files by name, the summary
/// without its timings.
fn run_with(threads: usize, folder: &Path) -> Vec<(String, Vec<u8>)> {
    let scene = Scene::from_text(SCENE, "test", Path::new(""), &[]).expect("the scene is valid");
    let options = RunOptions {
        out: folder.to_owned(),
        threads: Some(threads),
        quiet: true,
    };
    let summary = run(&scene, &options).expect("the scene runs");
    let cuts = summary.cuts.as_ref().expect("the scene cuts");
    assert!(cuts.severed_pairs > 50, "the blade severs: {cuts:?}");
    assert!(
        summary.bodies[0].energy.imbalance < 1e-2,
        "the audit closes"
    );
    let mut json = serde_json::to_value(&summary).expect("a summary is JSON");
    json.as_object_mut().expect("an object").remove("timings");
    let mut files = vec![("summary".to_owned(), json.to_string().into_bytes())];
    for name in ["history.csv", "animation.png"] {
        let content = std::fs::read(folder.join(name)).expect("the run wrote it");
        files.push((name.to_owned(), content));
    }
    let frames = std::fs::read_dir(folder.join("frames")).expect("the run drew frames");
    for frame in frames {
        let path = frame.expect("a file").path();
        let content = std::fs::read(&path).expect("a readable frame");
        files.push((
            path.file_name()
                .expect("a name")
                .to_string_lossy()
                .into_owned(),
            content,
        ));
    }
    files.sort();
    files
}

#[test]
fn one_thread_two_threads_and_a_second_run_write_the_same_bits() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let once = run_with(1, &root.path().join("one"));
    assert!(once.len() > 5, "{} files", once.len());
    for (label, threads) in [("again", 1), ("two", 2)] {
        let other = run_with(threads, &root.path().join(label));
        assert_eq!(once.len(), other.len(), "{label}: as many files");
        for ((name, a), (other_name, b)) in once.iter().zip(&other) {
            assert_eq!(name, other_name);
            assert!(a == b, "{label}: {name} differs");
        }
    }
}
