//! What a run says to people is what it writes for programs.

use crate::program::Sandbox;

/// A block that is cut in two above a tool on which the lower half falls, drawn twice.
const SCENE: &str = include_str!("reports.ron");

#[test]
fn a_run_reports_what_its_summary_holds() {
    let sandbox = Sandbox::new(&[("small.ron", SCENE)]);
    let run = sandbox.run("run small.ron --out o");
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
    let [nodes, pairs] = ["/bodies/0/nodes", "/bodies/0/pairs"].map(count);
    let size = format!("{nodes} nodes, {pairs} pairs");
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
    assert!(number("/tools/0/largest_force") > 0.1, "it fell on it");
    let frames = format!("{} frames of 64x48", count("/pictures/frames"));
    assert!(row("pictures").starts_with(&frames), "{frames}");
    for (name, unit) in [
        ("volume", " l before"),
        ("energy", " J, elastic "),
        ("viscosity", " J lost"),
        ("audit", " of what is stored or dissipated"),
        ("step size", " ms: "),
        ("speed", " ms a step"),
        ("blade to step", "median "),
        ("files", "o: scene.ron"),
    ] {
        assert!(row(name).contains(unit), "{name}: {}", row(name));
    }
}

/// A small block with more keys.
fn block(more: &str) -> Sandbox {
    let scene = format!(
        "(version: 1, name: \"block\", bodies: [(shape: Box(size: (0.06, 0.03, 0.04)), sampling: (target: Nodes(150)), \
         material: (youngs_modulus: 2e4, poissons_ratio: 0.4))], \
         supports: [(region: HalfSpace(point: (0, 0, 0.019), normal: (0, 0, 1)))], {more})"
    );
    Sandbox::new(&[("block.ron", scene)])
}

fn warnings(sandbox: &Sandbox) -> (Vec<String>, serde_json::Value) {
    let run = sandbox.run("run block.ron --out o --json");
    assert_eq!(run.status, 0, "{run:?}");
    let summary: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    let told = serde_json::from_value(summary["warnings"].clone());
    (told.unwrap_or_default(), summary)
}

#[test]
fn check_takes_more_steps_than_settling_has() {
    let sandbox = block(
        "integration: (duration: 1, scheme: BackwardEuler(step: 0.05), settle: (limit: 0.2)), \
         gravity: (acceleration: (0, 0, -1))",
    );
    let check = sandbox.run("check block.ron");
    assert_eq!((check.status, check.stderr.as_str()), (0, ""), "{check:?}");
    assert!(check.stdout.contains("  time: about "), "{check:?}");
}

/// At 200 m/s it is farther than the body is long from one step to the next, and does what it does in a hundredth of the
/// step (0.667 mJ). A larger one crushes the body, and its energy closes, too.
#[test]
fn a_fast_tool_does_not_pass_through() {
    let run = |radius: f64| {
        let sandbox = block(&format!(
            "integration: (duration: 0.02, settle: None), tools: [(shape: Sphere(radius: {radius}), path: \
             [(time: 0, position: (0.05, 0, 0)), (time: 0.001, position: (-0.15, 0, 0))])]"
        ));
        let (warnings, summary) = warnings(&sandbox);
        let energy = |key: &str| summary["bodies"][0]["energy"][key].as_f64().unwrap();
        (warnings, energy("external_work"), energy("imbalance"))
    };
    let (warnings, work, _) = run(0.01);
    assert!((work / 0.667e-3 - 1.0).abs() < 0.1, "{work} J");
    assert!(warnings.is_empty(), "it touched: {warnings:?}");
    let (_, _, imbalance) = run(0.02);
    assert!(imbalance < 0.01, "{imbalance}");
}

/// A tolerance as large as the forces leaves energy unexplained.
#[test]
fn energy_that_steps_make_is_told() {
    let sandbox = block(
        "integration: (duration: 0.5, settle: None, scheme: EnergyMomentum(step: 0.01, tolerance: 0.9)), \
         gravity: (acceleration: (0, 0, -100), ramp: 0)",
    );
    let (warnings, _) = warnings(&sandbox);
    let told = warnings.iter().any(|text| text.contains("is unexplained"));
    assert!(told, "{warnings:?}");
}

/// A load of a thousand times what the material holds: told at once, and no run without end.
#[test]
fn a_step_that_stays_tiny_is_told_and_ends_a_run() {
    let sandbox = block(
        "integration: (duration: 0.05, settle: None), gravity: (acceleration: (0, 0, -1e6), ramp: 0.001), \
         observe: (history_rate: 1000)",
    );
    let run = sandbox.run("run block.ron --out o");
    let lines: Vec<&str> = run.stderr.lines().collect();
    assert_eq!((run.status, lines.len()), (1, 2), "{run:?}");
    let told = "warning: body 'body': its step fell below a hundredth of the first";
    assert!(lines[0].starts_with(told), "{run:?}");
    assert!(lines[0].contains("stiffest is node"), "{run:?}");
    assert!(lines[1].contains("its stable step has fallen"), "{run:?}");
}

/// The upper of two blocks that touch falls through the lower one.
#[test]
fn bodies_that_fall_through_one_another_are_told_once() {
    let scene = "(version: 1, bodies: [\
         (name: \"low\", shape: Box(size: (0.04, 0.04, 0.04)), sampling: (target: Nodes(200))),\
         (name: \"high\", shape: Box(size: (0.04, 0.04, 0.04)), position: (0, 0, 0.04), sampling: (target: Nodes(200)))],\
         supports: [(body: \"low\", region: HalfSpace(point: (0, 0, -0.019), normal: (0, 0, -1)))],\
         gravity: (acceleration: (0, 0, -9.81)), integration: (duration: 0.1, settle: None))";
    let sandbox = Sandbox::new(&[("block.ron", scene)]);
    let (said, _) = warnings(&sandbox);
    assert!(said.is_empty(), "they only touch: {said:?}");
    let sandbox = Sandbox::new(&[("block.ron", scene.replace("0.1,", "0.2,"))]);
    let (said, _) = warnings(&sandbox);
    assert_eq!(said.len(), 1, "{said:?}");
    let told = "bodies 'low' and 'high' lie in one another";
    assert!(said[0].starts_with(told), "{said:?}");
}

#[test]
fn regions_without_nodes_and_nodes_of_two_supports_are_told() {
    let scene = SCENE
        .replace("material:", "inclusions: [(region: Sphere(center: (1, 0, 0), radius: 0.01), youngs_modulus: 5e4)], material:")
        .replace("supports: [", "supports: [(region: HalfSpace(point: (0, 0, 0.02), normal: (0, 0, 1)), motion: \
             Driven(path: [(time: 0), (time: 0.1, position: (0.001, 0, 0))])), ");
    let check = Sandbox::new(&[("small.ron", scene)]).run("check small.ron");
    for told in [
        "inclusions[0] has no node",
        "supports[0] and supports[1] have nodes in common",
    ] {
        assert!(check.stdout.contains(told), "{check:?}");
    }
}

/// Forces between bodies stand at the times of those on tools; a scene without the key has neither them nor pressures.
#[test]
fn forces_between_bodies_are_told() {
    let sandbox = Sandbox::empty();
    let args = "run stack --out o --set pictures=None --set integration.duration=0.25 --set bodies[0].sampling.target=Nodes(150) \
                --set bodies[1].sampling.target=Nodes(150)";
    let run = sandbox.run(args);
    assert_eq!(run.status, 0, "{run:?}");
    let file = |name: &str| sandbox.path().join("o").join(name);
    let has_pressures = || {
        let state = std::fs::read(file("final-lower.vtk")).unwrap();
        String::from_utf8_lossy(&state).contains("contact_pressure_Pa")
    };
    let rows = |name: &str| -> Vec<csv::StringRecord> {
        let mut reader = csv::Reader::from_path(file(name)).unwrap();
        reader.records().map(Result::unwrap).collect()
    };
    let (tools, between) = (rows("tools.csv"), rows("contacts.csv"));
    let times: Vec<&str> = tools.iter().map(|row| &row[0]).collect();
    for row in &between {
        assert!(times.contains(&&row[0]), "at the same times");
        assert_eq!([&row[2], &row[3]], ["lower", "upper"]);
    }
    let number = |row: &csv::StringRecord, k: usize| row[k].parse::<f64>().unwrap();
    let late = between.iter().filter(|row| number(row, 0) > 0.1);
    let late: Vec<f64> = late.map(|row| number(row, 6)).collect();
    let mean = late.iter().sum::<f64>() / late.len() as f64;
    let weight = 0.06 * 0.05 * 0.03 * 1000.0 * 9.81;
    assert!((mean / -weight - 1.0).abs() < 0.2, "{mean} N below");
    assert!(has_pressures());
    let run = sandbox.run(&format!("{args} --set contact=None"));
    assert_eq!(run.status, 0, "{run:?}");
    assert!(!file("contacts.csv").exists(), "of the earlier run");
    assert!(!has_pressures());
}
