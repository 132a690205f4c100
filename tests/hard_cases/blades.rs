//! Blades: strokes that end at a surface, begin again, and weld as their own cut says.

use glam::DVec3;
use phyxel::{Action, Input, StrokePhase, World};

use super::stage::*;

const STILL: &str = "gravity: None, integration: (settle: None),";

#[test]
fn a_blade_that_ends_on_the_surface_severs() {
    for (height, end) in [(1e-3, 0.02), (0.0, 0.02), (-3.3e-3, 0.0197)] {
        let at = |x: f64| DVec3::new(x, 0.0, height);
        let cut = stroke("cut", DVec3::Y * 0.08, at(-0.04), at(end), [0.01, 0.1]);
        let mut world = world(BLOCK, &format!("cuts: [{cut}], {HELD} {STILL}"));
        play(&mut world, 0.12).expect("it runs");
        assert_eq!(pieces(&world).len(), 2, "{height}: {:?}", pieces(&world));
        assert_eq!(cutting(&world).missed_pairs, 0);
    }
}

#[test]
fn a_blade_that_trembles_leaves_no_crumbs() {
    let key = |k: u32| {
        let t = f64::from(k);
        let (x, z) = (-0.03 + 1.5e-3 * t, 1e-3 + 8e-4 * (1.9 * t).sin());
        let x = x + 2e-3 * (2.6 * t).sin();
        format!("(time: {}, position: ({x}, 0, {z}))", 0.01 + 2e-3 * t)
    };
    let path: Vec<String> = (0..42).map(key).collect();
    let cut = format!(
        "(name: \"cut\", edge: [(0, -0.04, 0), (0, 0.04, 0)], path: [{}], capture: Rate(1000))",
        path.join(", ")
    );
    let mut world = super::stage::cut(BLOCK, &[cut]);
    play(&mut world, 0.12).expect("it runs");
    let sizes = pieces(&world);
    assert_eq!(sizes.len(), 2, "{sizes:?}");
    let cutting = cutting(&world);
    assert_eq!(cutting.missed_pairs, 0);
    let cuts = &cutting.cuts;
    let vectors = (0..cuts.triangle_count()).map(|t| cuts.area(t) * cuts.normal(t));
    let vectors: Vec<DVec3> = vectors.collect();
    let sum: DVec3 = vectors.iter().sum();
    let back = vectors.iter().filter(|v| v.dot(sum) < 0.0);
    let back: f64 = back.map(|v| v.length()).sum();
    assert!(back < 0.02 * sum.length(), "{back} m2 of {sum} backwards");
}

/// Edges of a cut that has no path of its own.
fn lead(world: &mut World, edges: &[(StrokePhase, f64, f64)]) {
    let inputs = edges.iter().zip(0..).map(|(&(phase, x, z), step)| Input {
        step,
        action: Action::Blade {
            cut: 0,
            phase,
            edge: vec![DVec3::new(x, -0.04, z), DVec3::new(x, 0.04, z)],
        },
    });
    world.push(inputs.collect()).expect("the inputs are valid");
    for _ in edges {
        world.step().expect("it runs");
    }
}

#[test]
fn a_start_in_an_open_stroke_begins_a_new_one() {
    let far = across("cut", 1.0, [1.0, 2.0]);
    let mut world = world(BLOCK, &format!("cuts: [{far}], {HELD} {STILL}"));
    let edges = [
        (StrokePhase::Start, -0.024, -0.015),
        (StrokePhase::Update, -0.01, -0.015),
        (StrokePhase::Start, -0.024, 0.015),
        (StrokePhase::Update, -0.01, 0.015),
        (StrokePhase::End, -0.01, 0.015),
    ];
    lead(&mut world, &edges);
    let cuts = &cutting(&world).cuts;
    assert!(cuts.triangle_count() > 0);
    for t in 0..cuts.triangle_count() {
        let heights = cuts.triangle(t).map(|corner| corner.z);
        let there = heights.iter().all(|z| (z.abs() - 0.015).abs() < 1e-6);
        assert!(there, "between the strokes: {heights:?}");
    }
}

#[test]
fn each_cut_welds_as_it_says() {
    let vertices = |tolerance: &str| {
        let second = across("second", -0.015, [0.03, 0.05]);
        let weld = format!("weld_tolerance: {tolerance}, capture:");
        let second = second.replace("capture:", &weld);
        let first = across("first", 0.015, [0.01, 0.02]);
        let mut world = world(BLOCK, &format!("cuts: [{first}, {second}], {HELD} {STILL}"));
        play(&mut world, 0.06).expect("it runs");
        let (vertices, _) = cutting(&world).cuts.surface();
        vertices.iter().filter(|v| v.z < 0.0).count()
    };
    let (fine, coarse) = (vertices("Some(1e-6)"), vertices("Some(4e-3)"));
    assert!(coarse < fine, "{coarse} of {fine} vertices");
}
