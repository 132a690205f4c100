//! Contact of deformable bodies against closed forms, and of a cut's flanks against the uncut body.

use std::f64::consts::PI;

use glam::DVec3;
use phyxel::scene::Scene;
use phyxel::{Body, World};

use crate::report::{Cell, Report, Table, row};
use crate::{Effort, StudyError};

/// Figures beside those they are compared with.
#[derive(Default)]
struct Rows(Vec<Vec<Cell>>);

impl Rows {
    fn add(&mut self, case: &str, figure: &str, found: f64, expected: f64) {
        let error = (expected != 0.0).then(|| 1e2 * (found / expected - 1.0));
        self.0.push(row![case, figure, found, expected, error]);
    }
}

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let size = if effort == Effort::Full { 3 } else { 1 };
    let mut rows = Rows::default();
    for case in [press, patch, curved, bars, slide] {
        case(size, &mut rows)?;
    }
    let table = Table::new(
        "contact",
        "Contact of deformable bodies",
        "case; figure; found; expected; error (%)",
        rows.0,
    );
    Ok(Report::new(&[WORDS], vec![table], Vec::new()))
}

const WORDS: &str = "Flanks: a block is cut through, then pressed by 5 % or drawn by 5 %; its force stands beside the uncut \
     block's. Patch: two blocks whose nodes do not match, pressed by 1 %, Poisson's ratio 0: the force of one \
     block, and strain that differs from 1 %. Spheres: two equal ones, and one against a rigid plane at half the \
     approach (the same by symmetry), beside finite elements; at this depth Hertz (1882) is 12 % below them. \
     Cylinders: the same in a plane. A sphere on a block 30 times as stiff: the same by Hertz's modulus of both. \
     Bars: two that collide; contact lasts 2L/c. \
     Sliding: a block comes to rest after v²/2μg.";

fn scene(text: &str) -> Result<Scene, StudyError> {
    let text = format!("(version: 1, {text})");
    Ok(phyxel_scene::from_text(&text, "contact", "", &[])?)
}

/// The world at the end of a scene.
fn play(text: &str) -> Result<World, StudyError> {
    let scene = scene(text)?;
    let end = scene.integration.duration;
    let mut world = World::new(scene)?;
    world.play(end, |_| ())?;
    Ok(world)
}

/// Vertical force (N) of the supports on nodes of a body that are above a height (m).
fn reaction(body: &Body, above: f64) -> f64 {
    let mut entries = body.motion().reactions();
    entries.retain(|(node, _)| body.rest[*node as usize].z > above);
    entries.iter().map(|(_, force)| force.z).sum()
}

fn press(size: u32, rows: &mut Rows) -> Result<(), StudyError> {
    let block = |by: f64, cut: bool, damping: u32, duration: f64| {
        let cuts = if cut {
            "contact: (), cuts: [(edge: [(0, -0.05, 0.0003), (0, 0.05, 0.0003)], path: [
                (time: 0, position: (-0.05, 0, 0)), (time: 0.2, position: (0.05, 0, 0))])],"
        } else {
            ""
        };
        format!(
            "bodies: [(shape: Box(size: (0.06, 0.06, 0.08)), sampling: (target: Nodes({})), damping: {damping},
                material: (youngs_modulus: 5e3, poissons_ratio: 0.4, density: 1000))],
            supports: [(region: HalfSpace(point: (0, 0, -0.0399), normal: (0, 0, -1))),
                (region: HalfSpace(point: (0, 0, 0.0399), normal: (0, 0, 1)), motion: Driven(path: [
                    (time: 0.3), (time: 0.9, position: (0, 0, {})) ]))],
            {cuts} gravity: None, integration: (duration: {duration}, settle: None),",
            1000 * size,
            by * 0.08
        )
    };
    let force = |world: &World| -reaction(&world.bodies()[0], 0.0);
    for (figure, by) in [("force (N), pressed", -0.05), ("force (N), drawn", 0.05)] {
        let uncut = force(&play(&block(by, false, 30, 1.8))?);
        let cut = play(&block(by, true, 30, 1.8))?;
        let found = force(&cut);
        let expected = if by < 0.0 { uncut } else { 0.0 };
        rows.add("flanks", figure, found, expected);
        if by > 0.0 {
            rows.add("flanks", "the same over the uncut", found / uncut, 0.0);
            continue;
        }
        let mut world = World::new(scene(&block(by, true, 0, 11.8))?)?;
        world.restore(cut.state(), |_, _| ())?;
        let audit = |world: &World| *world.bodies()[0].motion().audit();
        let (stored, mut swings) = (audit(&world).elastic, 0.0_f64);
        world.play(11.8, |world| swings = swings.max(audit(world).kinetic))?;
        rows.add(
            "flanks",
            "undamped for 10 s, kinetic energy over stored",
            swings / stored,
            0.0,
        );
    }
    Ok(())
}

fn patch(size: u32, rows: &mut Rows) -> Result<(), StudyError> {
    let blocks = |bodies: &str| {
        play(&format!(
            "bodies: [{bodies}],
            supports: [(region: HalfSpace(point: (0, 0, -0.0399), normal: (0, 0, -1))),
                (region: HalfSpace(point: (0, 0, 0.0399), normal: (0, 0, 1)), motion: Driven(path: [
                    (time: 0), (time: 0.4, position: (0, 0, -0.0008)) ]))],
            contact: (), gravity: None, integration: (duration: 1.2, settle: None),",
        ))
    };
    let material = "damping: 30, material: (youngs_modulus: 5e3, poissons_ratio: 0, density: 1000)";
    let one = blocks(&format!(
        "(shape: Box(size: (0.06, 0.06, 0.08)), sampling: (target: Nodes({})), {material})",
        1000 * size
    ))?;
    let half = |name: &str, z: f64, nodes: u32| {
        format!(
            "(name: \"{name}\", shape: Box(size: (0.06, 0.06, 0.04)), position: (0, 0, {z}),
            sampling: (target: Nodes({nodes})), {material})"
        )
    };
    let two = half("a", -0.02, 450 * size) + ", " + &half("b", 0.02, 700 * size);
    let two = blocks(&two)?;
    let [upper, whole] = [&two.bodies()[1], &one.bodies()[0]].map(|body| -reaction(body, 0.0));
    rows.add("patch", "force (N)", upper, whole);
    let (mut sum, mut volume, mut most) = (0.0, 0.0, 0.0_f64);
    for body in two.bodies() {
        let gradients = body.elastic().deformation_gradients();
        for (f, v) in gradients.iter().zip(&body.volumes) {
            let off = (1.0 - f.z_axis.z) / 0.01 - 1.0;
            sum += v * off * off;
            volume += v;
            most = most.max(off.abs());
        }
    }
    let rms = f64::sqrt(sum / volume);
    rows.add("patch", "strain off 1 %, rms", rms, 0.0);
    rows.add("patch", "strain off 1 %, largest", most, 0.0);
    Ok(())
}

/// Radius (m) of spheres and cylinders, how far (m) each is pushed in, Young's modulus (Pa), half a cylinder's length (m).
const RADIUS: f64 = 0.02;
const PUSH: f64 = 0.001;
const MODULUS: f64 = 5e3;
const HALF: f64 = 0.015;
/// Young's modulus of a block over that of the sphere on it: all but a thirtieth of the push goes into the sphere.
const STIFFER: f64 = 30.0;
/// Finite elements (`benches/peers/sphere.py`): force (N) on one of two spheres, radius (m) in contact, force (N/m) on one of two
/// cylinders.
const ON_SPHERE: f64 = 0.03742;
const IN_CONTACT: f64 = 4.47e-3;
const ON_CYLINDER: f64 = 3.013;

fn curved(size: u32, rows: &mut Rows) -> Result<(), StudyError> {
    let of = |name: &str, shape: &str, [modulus, ratio, z]: [f64; 3]| {
        format!(
            "(name: \"{name}\", shape: {shape}, position: (0, 0, {z}), sampling: (target: Nodes({})), damping: 30,
            material: (youngs_modulus: {modulus}, poissons_ratio: {ratio}, density: 1000))",
            2000 * size
        )
    };
    let body = |name: &str, shape: &str, ratio: f64, z: f64| of(name, shape, [MODULUS, ratio, z]);
    let held = "(body: \"a\", region: HalfSpace(point: (0, 0, -0.02), normal: (0, 0, -1)))";
    let rest = "gravity: None, integration: (duration: 1.0, settle: None),";
    let two = |shape: &str, ratio: f64| {
        play(&format!(
            "bodies: [{}, {}], supports: [{held}, (body: \"b\", region: HalfSpace(point: (0, 0, 0.02), normal: (0, 0, 1)),
            motion: Driven(path: [(time: 0), (time: 0.4, position: (0, 0, {}))]))], contact: (), {rest}",
            body("a", shape, ratio, -RADIUS),
            body("b", shape, ratio, RADIUS),
            -2.0 * PUSH
        ))
    };
    let sphere = format!("Ellipsoid(radii: ({RADIUS}, {RADIUS}, {RADIUS}))");
    let spheres = two(&sphere, 0.3)?;
    let plane = play(&format!(
        "bodies: [{}], supports: [{held}], tools: [(shape: Plane(normal: (0, 0, -1)), path: [
            (time: 0), (time: 0.4, position: (0, 0, {}))])], {rest}",
        body("a", &sphere, 0.3, -RADIUS),
        -PUSH
    ))?;
    let force = |world: &World| -reaction(&world.bodies()[1], 0.0);
    let pushed = plane.tool_forces()[0];
    rows.add("spheres", "force (N)", force(&spheres), ON_SPHERE);
    let on_plane = "force (N), a rigid plane";
    rows.add("spheres", on_plane, pushed.force.z, ON_SPHERE);
    let (between, _) = spheres.body_contact().expect("it is asked for");
    for (figure, area) in [
        ("radius in contact (m)", between[0].area),
        ("radius in contact (m), a rigid plane", pushed.area),
    ] {
        rows.add("spheres", figure, (area / PI).sqrt(), IN_CONTACT);
    }
    let block = "Box(size: (0.05, 0.05, 0.02))";
    let on_block = play(&format!(
        "bodies: [{}, {}], supports: [(body: \"a\", region: HalfSpace(point: (0, 0, -0.0199), normal: (0, 0, -1))),
            (body: \"b\", region: HalfSpace(point: (0, 0, {RADIUS}), normal: (0, 0, 1)),
            motion: Driven(path: [(time: 0), (time: 0.3, position: (0, 0, {}))]))], contact: (),
        gravity: None, integration: (duration: 0.6, settle: None),",
        of("a", block, [STIFFER * MODULUS, 0.3, -0.01]),
        body("b", &sphere, 0.3, RADIUS),
        -PUSH
    ))?;
    // By Hertz's modulus of both.
    let expected = ON_SPHERE / (1.0 + 1.0 / STIFFER);
    rows.add("sphere on a block", "force (N)", force(&on_block), expected);
    // A tube must have a hole.
    let cylinder = format!(
        "Tube(from: (0, -{HALF}, 0), to: (0, {HALF}, 0), inner_radius: 1e-4, outer_radius: {RADIUS})"
    );
    let cylinders = force(&two(&cylinder, 0.0)?);
    rows.add(
        "cylinders",
        "force (N)",
        cylinders,
        2.0 * HALF * ON_CYLINDER,
    );
    Ok(())
}

fn bars(size: u32, rows: &mut Rows) -> Result<(), StudyError> {
    let bar = |name: &str, x: f64, v: f64| {
        format!(
            "(name: \"{name}\", shape: Box(size: (0.1, 0.02, 0.02)), position: ({x}, 0, 0), velocity: ({v}, 0, 0),
            sampling: (target: Nodes({})), damping: 0,
            material: (youngs_modulus: 1e5, poissons_ratio: 0, density: 1000))",
            700 * size * size
        )
    };
    let scene = scene(&format!(
        "bodies: [{}, {}], contact: (), gravity: None, integration: (duration: 0.04, settle: None),",
        bar("a", -0.0502, 0.05),
        bar("b", 0.0502, -0.04)
    ))?;
    let mut world = World::new(scene)?;
    let total = |world: &World| {
        let audits = || world.bodies().iter().map(|body| body.motion().audit());
        let springs = world.body_contact().map_or(0.0, |(_, state)| state.energy);
        let stored: f64 = audits().map(|audit| audit.kinetic + audit.elastic).sum();
        let momentum: DVec3 = audits().map(|audit| audit.momentum).sum();
        (stored + springs, momentum)
    };
    world.settle()?;
    let (energy, momentum) = total(&world);
    let (mut first, mut last) = (f64::INFINITY, 0.0_f64);
    // A hundredth of ρ c v A.
    let least = 0.01 * 1000.0 * 10.0 * 0.045 * 4e-4;
    world.play(0.04, |world| {
        let (between, _) = world.body_contact().expect("it is asked for");
        if between.iter().any(|sum| sum.normal > least) {
            first = first.min(world.time());
            last = last.max(world.time());
        }
    })?;
    let (after, kept) = total(&world);
    rows.add("bars", "time in contact (s)", last - first, 0.02);
    rows.add("bars", "energy (J)", after, energy);
    let lost = (kept - momentum).length() / momentum.length();
    rows.add("bars", "momentum lost over momentum", lost, 0.0);
    Ok(())
}

fn slide(size: u32, rows: &mut Rows) -> Result<(), StudyError> {
    let world = play(&format!(
        "bodies: [(name: \"plate\", shape: Box(size: (0.2, 0.06, 0.01)), position: (0.03, 0, -0.005),
            sampling: (target: Nodes({})), material: (youngs_modulus: 3e4, poissons_ratio: 0.3)),
          (name: \"block\", shape: Box(size: (0.04, 0.04, 0.02)), position: (0, 0, 0.01), velocity: (0.4, 0, 0),
            sampling: (target: Nodes({})), damping: 5, material: (youngs_modulus: 3e4, poissons_ratio: 0.3))],
        supports: [(body: \"plate\", region: HalfSpace(point: (0, 0, -0.004), normal: (0, 0, -1)))],
        contact: (friction: 0.3), gravity: (acceleration: (0, 0, -9.81), ramp: 0.1),
        integration: (duration: 0.4, settle: (limit: 0.5)),",
        1500 * size,
        500 * size
    ))?;
    let body = &world.bodies()[1];
    let nodes = body.rest.iter().zip(body.motion().positions());
    let moved = nodes.zip(&body.masses).map(|((a, b), m)| m * (b.x - a.x));
    let found = moved.sum::<f64>() / body.masses.iter().sum::<f64>();
    let expected = 0.4 * 0.4 / (2.0 * 0.3 * 9.81);
    rows.add("sliding", "distance (m)", found, expected);
    rows.add("sliding", "speed at the end (m/s)", world.speed(), 0.0);
    Ok(())
}
