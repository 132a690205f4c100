//! Bodies of points without tetrahedra, and skin from a file of points.

use glam::DVec3;
use phyxel::World;
use phyxel_cli::picture::Painter;
use phyxel_cli::run::{RunOptions, run};

use super::points_on_box;
use crate::play;

/// A column that hangs by its top under its weight, of either form.
fn column(sampling: &str, rest: &str) -> String {
    format!(
        "(version: 1, bodies: [(shape: Box(size: (0.04, 0.04, 0.08)), sampling: ({sampling}),
            material: (youngs_modulus: 1e4, poissons_ratio: 0.3, density: 1000), damping: 10)],
          supports: [(region: HalfSpace(point: (0, 0, 0.0399), normal: (0, 0, 1)))],
          integration: (settle: None), {rest})"
    )
}

/// Volumes and masses sum to the body's, the stencils conserve, and the column hangs as long as one of
/// tetrahedra, and bends as far where gravity pulls it aside, on a lattice and on an octree.
#[test]
fn a_column_of_points_hangs_and_bends_as_one_of_tetrahedra() {
    // 1.066 and 1.142 on the lattice: points bend and stretch a little too far.
    for (pull, most) in [("(0, 0, -9.81)", 0.1), ("(1, 0, 0)", 0.2)] {
        let hung = |sampling: &str| {
            let gravity = format!("gravity: (ramp: 0, acceleration: {pull})");
            let mut world = crate::world(&column(sampling, &gravity));
            world.rest_in_equilibrium().expect("it has an equilibrium");
            world
        };
        let meshed = way_of_end(&hung("target: Nodes(1500)"));
        for points in [
            "target: Nodes(1500), form: Points",
            "target: Nodes(1500), form: Points, coarsest: 2",
        ] {
            let world = hung(points);
            let body = &world.bodies()[0];
            assert!(body.tetrahedra.is_empty(), "{points}");
            let volume: f64 = body.volumes.iter().sum();
            let mass: f64 = body.masses.iter().sum();
            assert!((volume / 1.28e-4 - 1.0).abs() < 1e-12, "{volume} m³");
            assert!((mass / 0.128 - 1.0).abs() < 1e-12, "{mass} kg");
            let solved = body.stencils.report.expect("conservative stencils");
            assert!(solved.converged, "{solved:?}");
            let ratio = way_of_end(&world) / meshed;
            println!("{points}, {pull} m/s²: {ratio} of the way of tetrahedra");
            assert!((ratio - 1.0).abs() < most, "{points}, {pull}: {ratio}");
        }
    }
}

/// How far the lowest nodes of the column have moved (m), in the mean.
fn way_of_end(world: &World) -> f64 {
    let body = &world.bodies()[0];
    let nodes = body.rest.iter().zip(body.motion().positions());
    let low = nodes.filter(|(rest, _)| rest.z < -0.0399);
    let ways: Vec<DVec3> = low.map(|(rest, now)| *now - *rest).collect();
    (ways.iter().sum::<DVec3>() / ways.len() as f64).length()
}

/// A cut through a body of points leaves two pieces, and its files have the nodes.
#[test]
fn a_body_of_points_is_cut_and_written() {
    let cut = "gravity: None, cuts: [(edge: [(0, -0.05, 0), (0, 0.05, 0)], path: [
        (time: 0, position: (-0.05, 0, 0.003)), (time: 0.01, position: (0.05, 0, 0.003))])],";
    let text = column("target: Nodes(400), form: Points", cut);
    let mut world = crate::world(&text);
    play(&mut world, 0.012);
    let pieces = world.bodies()[0].pieces();
    assert_eq!(pieces.sizes.len(), 2, "{:?}", pieces.sizes);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut short = crate::scene(&text);
    short.integration.duration = 0.011;
    let options = RunOptions::quiet(folder.path(), 1);
    run(&short, &options).expect("it runs");
    let file = std::fs::read(folder.path().join("final-body.vtk")).expect("a file");
    let head = format!("POINTS {} double", world.bodies()[0].rest.len());
    let found = file.windows(head.len()).any(|part| part == head.as_bytes());
    assert!(found, "no '{head}'");
}

/// A plate pressed flat on the whole top: the force is that of the column's stiffness and the area of
/// contact that of the top, whatever the nodes.
#[test]
fn a_tool_feels_points_as_it_feels_tetrahedra() {
    let pressed = |form: &str| {
        let text = format!(
            "(version: 1, bodies: [(shape: Box(size: (0.04, 0.04, 0.04)),
                sampling: (target: Nodes(1000), form: {form}), damping: 40,
                material: (youngs_modulus: 1e4, poissons_ratio: 0.3, density: 1000))],
              supports: [(region: HalfSpace(point: (0, 0, -0.0199), normal: (0, 0, -1)))],
              tools: [(shape: Plane(normal: (0, 0, -1)), path: [
                (time: 0, position: (0, 0, 0.021)), (time: 0.1, position: (0, 0, 0.018))])],
              gravity: None, integration: (settle: None))"
        );
        let mut world = crate::world(&text);
        play(&mut world, 0.4);
        let felt = world.tool_forces()[0];
        (felt.force.z, felt.area)
    };
    let (meshed, points) = (pressed("Tetrahedra"), pressed("Points"));
    println!("tetrahedra {meshed:?}, points {points:?}");
    // 5.6 % more since points lie elsewhere and the law is another; why was not looked into.
    assert!((points.1 / 1.6e-3 - 1.0).abs() < 0.08, "{} m²", points.1);
    let ratio = points.0 / meshed.0;
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
}

/// Surfels from a file lie where the file has them, scaled, turned and moved with the body; their areas
/// sum to the surface; points that are not on the body are refused.
#[test]
fn skin_of_points_lies_on_the_body() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // In millimetres, lying: x is up.
    let text = points_on_box(DVec3::new(80.0, 40.0, 40.0), 2.0);
    let count = text.lines().count() - 1;
    std::fs::write(folder.path().join("scan.xyz"), text).expect("it can be written");
    let drawn = |scale: f64| {
        let text = format!(
            "(version: 1, bodies: [(shape: Box(size: (0.04, 0.04, 0.08)), position: (0.1, 0, 0),
                sampling: (target: Nodes(400)),
                surfels: (points: (file: \"scan.xyz\", scale: {scale}, up: X)))],
              pictures: (width: 64, height: 48))"
        );
        let scene = phyxel_scene::from_text(&text, "test", folder.path(), &[]).expect("a scene");
        let pictures = scene.pictures.clone().expect("it has pictures");
        let world = World::new(scene).expect("it can be built");
        Painter::new(&world, &pictures).map(|mut painter| {
            painter.carry(&world);
            painter
        })
    };
    let painter = drawn(1e-3).expect("the points fit");
    let skin = &painter.skins()[0];
    assert_eq!(skin.splats().len(), count);
    for splat in skin.splats() {
        let (x, normal) = (splat.position, splat.normal);
        let local = (x - DVec3::new(0.1, 0.0, 0.0)) / DVec3::new(0.02, 0.02, 0.04);
        let off = local.abs().max_element() - 1.0;
        assert!(off.abs() < 1e-12, "{x} is {off} off");
        let out = (local * normal).max_element();
        assert!((out - 1.0).abs() < 1e-12, "{x} has the normal {normal}");
    }
    let surfels = skin.tissue.surfels().iter();
    let area: f64 = surfels.map(|surfel| surfel.area).sum();
    let exact = 4.0 * 0.04 * 0.08 + 2.0 * 0.04 * 0.04;
    println!("area {} of the surface's", area / exact);
    assert!((area / exact - 1.0).abs() < 0.1, "{area} m² of {exact}");
    let error = drawn(1.0)
        .expect_err("points eighty metres apart")
        .to_string();
    assert!(
        error.contains("scan.xyz: its points lie") && error.contains("surfels.points.scale"),
        "{error}"
    );
}
