//! Hard cases of bodies, motion and tools.

use glam::DVec3;
use phyxel::World;
use testkit::tol::assert_within;

use super::stage::*;

#[test]
fn a_bar_is_twisted_by_360_degrees_and_back() {
    let bar = BLOCK.replace("(0.04, 0.04, 0.06)", "(0.02, 0.02, 0.06)");
    let turn = |time: f64, angle: f64| format!("(time: {time}, rotation: (0, 0, {angle}))");
    let keys: Vec<String> = (0..=8)
        .map(|k| {
            let k = f64::from(k);
            turn(0.1 * k, 90.0 * if k <= 4.0 { k } else { 8.0 - k })
        })
        .collect();
    let supports = format!(
        "supports: [
            (region: HalfSpace(point: (0, 0, 0.0299), normal: (0, 0, 1)), motion: Driven(path: [{}])),
            (region: HalfSpace(point: (0, 0, -0.0299), normal: (0, 0, -1)))],",
        keys.join(", ")
    );
    let rest = format!("{supports} integration: (settle: None), gravity: None,");
    let mut world = world(&bar, &rest);
    play(&mut world, 0.4).expect("it runs");
    let body = &world.bodies()[0];
    let gradients = body.elastic().deformation_gradients();
    let determinants = gradients.iter().map(|f| f.determinant());
    let smallest = determinants.fold(f64::INFINITY, f64::min);
    assert!(smallest > 0.2, "det F falls to {smallest}");
    let twisted = body.motion().audit().elastic;
    play(&mut world, 1.2).expect("it runs");
    let body = &world.bodies()[0];
    let back = body.motion().audit().elastic;
    assert!(back < 1e-3 * twisted, "{back} J of {twisted} J are left");
    assert!(largest_way(body) < 1e-3, "it is not back");
    audit_closes(&world, 0.01);
}

#[test]
fn nearly_incompressible_tissue_sags_and_keeps_its_volume() {
    let hang = |ratio: &str| {
        let body = BLOCK.replace("poissons_ratio: 0.4", &format!("poissons_ratio: {ratio}"));
        let body = body
            .replace("damping: 4", "damping: 20")
            .replace("2e4", "1e4");
        let mut world = world(&body, &format!("{HELD} {AT_ONCE}"));
        play(&mut world, 0.5).expect("it runs");
        let body = &world.bodies()[0];
        let heights = body.motion().positions().iter().map(|x| x.z);
        let lowest = heights.fold(f64::INFINITY, f64::min);
        let gradients = body.elastic().deformation_gradients();
        let volumes = gradients.iter().zip(&body.volumes);
        let volume: f64 = volumes.map(|(f, v)| f.determinant() * v).sum();
        (-0.03 - lowest, (volume / body.volume - 1.0).abs())
    };
    let (soft, changed) = hang("0.45");
    let (stiff, kept) = hang("0.499");
    assert!(stiff < soft && stiff > 0.6 * soft, "{stiff}, {soft} m");
    assert!(kept < 0.1 * changed, "volumes: {kept}, {changed} at 0.45");
}

#[test]
fn a_stiff_body_beside_a_soft_one_sets_the_step() {
    let body = |name: &str, modulus: &str, x: f64| {
        BLOCK
            .replace("\"block\"", &format!("\"{name}\", position: ({x}, 0, 0)"))
            .replace("2e4", modulus)
            .replace("Nodes(500)", "Nodes(150)")
    };
    let soft = world(&body("soft", "1e3", 0.0), &format!("{HELD} {AT_ONCE}")).step_size();
    let both = body("soft", "1e3", 0.0) + ", " + &body("stiff", "1e9", 0.1);
    let mut world = world(&both, &format!("{HELD} {AT_ONCE}"));
    let ratio = soft / world.step_size();
    assert!((900.0..1100.0).contains(&ratio), "{ratio} times shorter");
    while world.steps() < 3000 {
        world.step().expect("it runs");
    }
    check(&world);
    audit_closes(&world, 0.01);
}

#[test]
fn ten_nodes_are_too_few_and_some_thirty_hang() {
    let few = BLOCK.replace("Nodes(500)", "Nodes(10)");
    let text = format!("(version: 1, bodies: [{few}], {HELD} {AT_ONCE})");
    let error = World::new(crate::scene(&text)).expect_err("too few");
    let said = error.to_string();
    assert!(said.contains("10 nodes") && said.contains("30"), "{said}");
    let few = BLOCK.replace("Nodes(500)", "Spacing(0.018)");
    let mut world = world(&few, &format!("{HELD} {AT_ONCE}"));
    play(&mut world, 0.3).expect("it runs");
    let body = &world.bodies()[0];
    let count = body.rest.len();
    assert!((30..100).contains(&count), "{count} nodes");
    let nodes = body.rest.iter().zip(body.motion().positions());
    let fallen: f64 = nodes.map(|(rest, x)| rest.z - x.z).sum();
    assert!(fallen > 0.0, "it sags");
    audit_closes(&world, 0.01);
}

#[test]
fn steps_at_the_limit_stay_bounded() {
    let free = BLOCK.replace("damping: 4", "damping: 0");
    let rest = "integration: (settle: None, step_factor: 1),
        gravity: (acceleration: (0, 0, -0.5), ramp: 0),";
    let mut limit = world(&free, &format!("{HELD} {rest}"));
    play(&mut limit, 1.0).expect("it stays bounded");
    audit_closes(&limit, 0.05);
}

#[test]
fn a_tool_is_pushed_through_the_body() {
    let tool = "tools: [(shape: Sphere(radius: 0.008), path: [
        (time: 0, position: (-0.04, 0, 0)), (time: 0.3, position: (0.05, 0, 0))])],";
    let mut world = world(BLOCK, &format!("{tool} {HELD} {AT_ONCE}"));
    let mut largest: f64 = 0.0;
    let outcome = (1..=100_u32).try_for_each(|k| {
        let played = play(&mut world, 5e-3 * f64::from(k));
        largest = largest.max(world.tool_forces()[0].force.length());
        played
    });
    assert!(largest > 0.2, "the body resists with {largest} N");
    match outcome {
        Ok(()) => {
            let force = world.tool_forces()[0];
            assert_within("its way", force.pose.position.x, 0.05, 1e-12);
            assert!(force.force.length() < largest, "{force:?} once through");
        }
        Err(error) => {
            let said = error.to_string();
            let named = said.contains("body 'block'") && said.contains("node");
            assert!(named, "{said}");
        }
    }
}

#[test]
fn a_graded_body_is_cut_where_it_is_fine() {
    let graded = BLOCK.replace(
        "Nodes(500)",
        "Spacing(0.01), coarsest: 2, refine: [(from: (-0.02, -0.02, 0), to: (-0.02, 0.02, 0), radius: 0.006, factor: 0.5)]",
    );
    let mut world = cut(&graded, &[across("cut", 0.001, [0.01, 0.1])]);
    play(&mut world, 0.2).expect("it runs");
    assert_eq!(pieces(&world).len(), 2, "{:?}", pieces(&world));
    let body = &world.bodies()[0];
    let near = |p: DVec3| body.rest.iter().filter(|x| x.distance(p) < 0.008).count();
    let (fine, coarse) = (near(DVec3::X * -0.02), near(DVec3::X * 0.02));
    assert!(
        fine > 2 * coarse,
        "{fine} of fine, {coarse} of coarse nodes"
    );
    audit_closes(&world, 0.01);
}
