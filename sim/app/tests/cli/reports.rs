//! What a run says to people is what it writes for programs.

use crate::program::Sandbox;

/// A block that is cut in two above a tool on which the lower half falls, drawn twice.
const SCENE: &str = r#"(
    version: 1,
    bodies: [(
        name: "block",
        shape: Box(size: (0.03, 0.03, 0.06)),
        sampling: (target: Spacing(0.008)),
        material: (youngs_modulus: 2e4, viscosity: [(ratio: 0.1, time: 0.1)]),
        surfels: (target: Count(400)),
    )],
    supports: [(region: HalfSpace(point: (0, 0, 0.029), normal: (0, 0, 1)))],
    cuts: [(
        edge: [(-0.1, 0, 0), (0.1, 0, 0)],
        path: [(time: 0, position: (0, -0.03, 0.001)), (time: 0.05, position: (0, 0.03, 0.001))],
    )],
    tools: [(
        name: "table",
        shape: Plane(normal: (0, 0, 1)),
        path: [(time: 0, position: (0, 0, -0.033))],
    )],
    integration: (duration: 0.15, settle: None),
    pictures: (width: 64, height: 48, rate: 10),
)"#;

#[test]
fn a_run_reports_what_its_summary_holds() {
    let sandbox = Sandbox::new(&[("small.ron", SCENE)]);
    let run = sandbox.run(&["run", "small.ron", "--out", "o"]);
    assert_eq!((run.status, run.stdout.as_str()), (0, ""), "{run:?}");
    let summary = std::fs::read(sandbox.path().join("o/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    let row = |name: &str| {
        let rows = run.stderr.lines().filter_map(|l| l.trim().split_once("  "));
        let row = rows.into_iter().find(|(head, _)| *head == name);
        row.unwrap_or_else(|| panic!("no `{name}`: {}", run.stderr))
            .1
    };
    let count = |path: &str| summary.pointer(path).unwrap().as_u64().unwrap();
    let number = |path: &str| summary.pointer(path).unwrap().as_f64().unwrap();
    assert_eq!(row("body"), "block");
    let size = format!(
        "{} nodes, {} pairs",
        count("/bodies/0/nodes"),
        count("/bodies/0/pairs")
    );
    assert!(row("size").starts_with(&size), "{size}");
    let mass = format!("{:.6} kg before", number("/bodies/0/mass_before"));
    assert!(row("mass").starts_with(&mass), "{mass}");
    assert_eq!(row("pieces"), "2");
    let steps = count("/stepping/steps").to_string();
    assert!(row("steps").starts_with(&steps), "{steps}");
    let cuts = format!("{} captures", count("/cuts/captures"));
    assert!(row("cuts").starts_with(&cuts), "{cuts}");
    let force = format!("table: at most {:.3} N", number("/tools/0/largest_force"));
    assert!(row("tool").starts_with(&force), "{force}");
    assert!(
        number("/tools/0/largest_force") > 0.1,
        "the half fell on it"
    );
    let frames = format!("{} frames of 64x48", count("/pictures/frames"));
    assert!(row("pictures").starts_with(&frames), "{frames}");
    for (name, unit) in [
        ("volume", " l before"),
        ("energy", " J, elastic "),
        ("viscosity", " J lost"),
        ("audit", " of what is stored or damped"),
        ("step size", " ms: "),
        ("speed", " ms a step"),
        ("blade to step", "median "),
        ("files", "o: scene.ron"),
    ] {
        assert!(row(name).contains(unit), "{name}: {}", row(name));
    }
}
