//! What steps cost and how far off they are, and how contact compares with theory, as tables and SVG:
//! real-time factor of an explicit indentation, implicit steps against explicit ones, work and
//! precision of every integrator, force over indentation,
//! convergence in nodes, Hertz's pressure.
//!
//! `cargo run --release -p benches --example integrators -- FOLDER`, or parts of it by name behind the
//! folder: `speed`, `work`, `force`, `nodes`, `hertz`. Without a folder it only prints.
#![allow(clippy::print_stdout, reason = "a study prints")]
#![allow(
    clippy::missing_assert_message,
    clippy::unwrap_used,
    clippy::cast_precision_loss,
    reason = "a study stops where a test would fail"
)]

use benches::problems::indentation::{
    HERTZ, Press, SMALL, SOFT, SPHERES, cube, graded, hertz_force, hertz_pressure, hertz_radius,
    moment_radius, quarter,
};
use benches::problems::model::ElasticBody as Body;
use benches::problems::reference::Reference;
use benches::problems::solid::Solid;
use benches::report::{Plot, Scale, Series};
use glam::DVec3;
use phyxel_integrate::{
    Contact, ContactSettings, ContactSurface, EigenvalueSettings, ExplicitScheme, ForceLaw,
    Implicit, ImplicitScheme, ImplicitSettings, Motion, MotionSettings, NewtonSettings, Path, Pose,
    Pressed, RigidShape, RigidTool, StaticLoad, StepView, Supports, largest_eigenvalue, penalty,
    solve_static,
};
use std::path::PathBuf;
use std::time::Instant;

const SOLID: Solid = Solid {
    youngs_modulus: 1e5,
    poissons_ratio: 0.3,
    density: 1000.0,
};

fn largest_distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    let pairs = a.iter().zip(b).map(|(a, b)| a.distance(*b));
    pairs.fold(0.0, f64::max)
}

/// The 2 m cube of 5,832 nodes, held at bottom and sides, and the contact of its top.
fn block() -> (Body, Supports, Contact) {
    let low = DVec3::new(-1.0, -1.0, -2.0);
    let body = Body::block([17; 3], low, DVec3::new(1.0, 1.0, 0.0), SOLID, 0.1).unwrap();
    let held = body.nodes(|x| x.x.abs() > 1.0 - 1e-9 || x.y.abs() > 1.0 - 1e-9 || x.z < 1e-9 - 2.0);
    let supports = Supports::fixed(body.rest.len(), &held);
    let top = body.faces(|x| x.z > -1e-9);
    let surface = ContactSurface::from_triangles(&top, &body.rest, 3).unwrap();
    let settings = ContactSettings::new(penalty(SOLID.youngs_modulus, 2.0 / 17.0));
    (body, supports, Contact::new(surface, settings))
}

/// Sphere of 1 m pressed 0.1 m deep into 5,832 nodes in half a second.
fn speed() {
    let (mut body, supports, mut contact) = block();
    let shape = RigidShape::Sphere { radius: 1.0 };
    let origin = Pose::at(DVec3::Z);
    let path = Path::ramp(0.0, 0.5, DVec3::Z * -0.1).unwrap();
    let settings = EigenvalueSettings::default();
    let bare = body.eigenvalue(&supports, &settings).unwrap().critical_step;
    let mut x = body.rest.clone();
    let masses = body.masses.clone();
    let mut law = Pressed::new(&mut body, &mut contact, shape, Pose::at(DVec3::Z * 0.9));
    let (load, newton) = (StaticLoad::default(), NewtonSettings::default());
    solve_static(&mut law, &mut x, &supports, &load, &newton).unwrap();
    let product = |v: &[DVec3], out: &mut [DVec3]| law.tangent_product_into(v, out);
    let with = largest_eigenvalue(&masses, &supports, product, &mut Vec::new(), &settings);
    let with = with.unwrap().critical_step;
    println!(
        "critical step {:.2} ms; with the penalty's stiffness {:.2} ms",
        1e3 * bare,
        1e3 * with
    );
    let begin = Motion::new(&body.rest, &masses, supports, MotionSettings::default()).unwrap();
    let surface = contact.surface().clone();
    let plain = ContactSettings {
        implicit: false,
        ..*contact.settings()
    };
    let mut explicit = |settings: ContactSettings, largest: f64| {
        let mut contact = Contact::new(surface.clone(), settings);
        let mut motion = begin.clone();
        let mut tool = RigidTool::on_path(shape, origin, path.clone());
        let press = &mut |view: &StepView<'_>, f: &mut [DVec3]| tool.press(&mut contact, view, f);
        let start = Instant::now();
        motion
            .advance_with(0.5, largest, |x, f| body.forces_into(x, f), press)
            .unwrap();
        (motion, start.elapsed().as_secs_f64(), tool.contact.force.z)
    };
    let (fine, _, exact) = explicit(plain, 0.1 * with);
    let deepest = largest_distance(fine.positions(), begin.positions());
    let cases = [
        ("forces half a step ahead", *contact.settings(), 0.9 * bare),
        ("forces half a step ahead", *contact.settings(), 0.45 * bare),
        ("forces where nodes are", plain, 0.9 * with),
    ];
    for (name, settings, largest) in cases {
        // The machine may be busy with other things: the shortest of some runs is the cost.
        let runs: Vec<_> = (0..9).map(|_| explicit(settings, largest)).collect();
        let seconds = runs.iter().map(|run| run.1).fold(f64::INFINITY, f64::min);
        let (motion, _, force) = &runs[0];
        println!(
            "explicit, {name}: {} steps of {:.2} ms, {:.2} ms each, {:.1} x real time, force {:+.2} %, error {:.1e} of the deepest",
            motion.steps(),
            0.5e3 / motion.steps() as f64,
            1e3 * seconds / motion.steps() as f64,
            0.5 / seconds,
            100.0 * (force / exact - 1.0),
            largest_distance(motion.positions(), fine.positions()) / deepest
        );
    }
    for scheme in [ImplicitScheme::Newmark, ImplicitScheme::BackwardEuler] {
        let newton = NewtonSettings {
            tolerance: 1e-3,
            ..NewtonSettings::default()
        };
        let mut seconds = f64::INFINITY;
        let (mut products, mut error) = (0, 0.0);
        for _ in 0..3 {
            let mut solver = Implicit::new(ImplicitSettings { scheme, newton }).unwrap();
            let mut motion = begin.clone();
            let mut tool = RigidTool::on_path(shape, origin, path.clone());
            products = 0;
            let start = Instant::now();
            for _ in 0..50 {
                let tools = &mut [(&mut tool, &mut contact)];
                let report = solver.step_with(&mut motion, 0.01, &mut body, tools);
                products += report.unwrap().linear_iterations;
            }
            seconds = seconds.min(start.elapsed().as_secs_f64());
            error = largest_distance(motion.positions(), fine.positions()) / deepest;
        }
        println!(
            "{scheme:?}: 50 steps of 10 ms, {:.1} ms each ({:.1} products), error {error:.1e} of the deepest",
            1e3 * seconds / 50.0,
            products as f64 / 50.0,
        );
    }
}

/// Shortest of three runs (ms) and the motion at the end.
fn timed(mut run: impl FnMut() -> Motion) -> (f64, Motion) {
    let mut best: Option<(f64, Motion)> = None;
    for _ in 0..3 {
        let start = Instant::now();
        let motion = run();
        let time = 1e3 * start.elapsed().as_secs_f64();
        if best.as_ref().is_none_or(|(before, _)| time < *before) {
            best = Some((time, motion));
        }
    }
    best.unwrap()
}

/// Error at 0.4 s of a plucked cantilever against the finest run, and the time it took.
fn work(charts: &mut Vec<Plot>) {
    let solid = Solid {
        youngs_modulus: 1e4,
        ..SOLID
    };
    let high = DVec3::new(0.4, 0.1, 0.1);
    let mut body = Body::block([12, 3, 3], DVec3::ZERO, high, solid, 0.1).unwrap();
    let held = body.nodes(|x| x.x < 1e-9);
    let supports = Supports::fixed(body.rest.len(), &held);
    let critical = body
        .eigenvalue(&supports, &EigenvalueSettings::default())
        .unwrap();
    let critical = critical.critical_step;
    let with = |scheme| {
        let settings = MotionSettings {
            scheme,
            ..MotionSettings::default()
        };
        let mut motion = Motion::new(&body.rest, &body.masses, supports.clone(), settings).unwrap();
        let swing = |x: &DVec3| DVec3::Z * (0.8 * (x.x / 0.4).powi(2));
        let v: Vec<DVec3> = body.rest.iter().map(swing).collect();
        motion.set_velocities(&v).unwrap();
        motion
    };
    let (verlet, euler) = (
        with(ExplicitScheme::VelocityVerlet),
        with(ExplicitScheme::SymplecticEuler),
    );
    // The beam starts without forces, where both explicit schemes take the same steps.
    let mut exact = verlet.clone();
    exact
        .advance_to(0.4, 0.005 * critical, |x, f| body.forces_into(x, f))
        .unwrap();
    let deepest = largest_distance(exact.positions(), &body.rest);
    println!("scheme, step over critical, milliseconds, error over the largest displacement");
    let mut curves = Vec::new();
    let mut steps = Vec::new();
    for (name, begin) in [("velocity Verlet", &verlet), ("symplectic Euler", &euler)] {
        let (mut points, mut by_step) = (Vec::new(), Vec::new());
        for share in [0.95, 0.7, 0.5, 0.35, 0.25, 0.125, 0.0625] {
            let (time, motion) = timed(|| {
                let mut motion = begin.clone();
                motion
                    .advance_to(0.4, share * critical, |x, f| body.forces_into(x, f))
                    .unwrap();
                motion
            });
            let error = largest_distance(motion.positions(), exact.positions()) / deepest;
            println!("{name}, {share}, {time:.2}, {error:.1e}");
            points.push((time, error));
            by_step.push((share, error));
        }
        curves.push(Series::line(name, points));
        steps.push(Series::line(name, by_step));
    }
    for (name, scheme) in [
        ("Newmark", ImplicitScheme::Newmark),
        ("backward Euler", ImplicitScheme::BackwardEuler),
    ] {
        let (mut points, mut by_step) = (Vec::new(), Vec::new());
        for count in [10_u32, 20, 40, 80, 160, 320] {
            let newton = NewtonSettings {
                tolerance: 1e-5,
                ..NewtonSettings::default()
            };
            let step = 0.4 / f64::from(count);
            let (time, motion) = timed(|| {
                let mut solver = Implicit::new(ImplicitSettings { scheme, newton }).unwrap();
                let mut motion = verlet.clone();
                for _ in 0..count {
                    solver.step(&mut motion, step, &mut body).unwrap();
                }
                motion
            });
            let error = largest_distance(motion.positions(), exact.positions()) / deepest;
            let share = step / critical;
            println!("{name}, {share:.2}, {time:.2}, {error:.1e}");
            points.push((time, error));
            by_step.push((share, error));
        }
        curves.push(Series::line(name, points));
        steps.push(Series::line(name, by_step));
    }
    let y = "error over the largest displacement";
    charts.push(Plot::new(
        "work_precision",
        "Work and precision of a plucked beam",
        ["time (ms)", y],
        [Scale::Logarithmic; 2],
        curves,
    ));
    let title = "Convergence in time on that beam";
    charts.push(Plot::new(
        "time_steps",
        title,
        ["step over the critical step", y],
        [Scale::Logarithmic; 2],
        steps,
    ));
}

/// Force over indentation of the 2 m cube, small strain, beside Hertz and finite elements.
fn force(charts: &mut Vec<Plot>) {
    println!("nodes, indentation over radius, force over E r²");
    let depths = [
        0.005, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09, 0.1,
    ];
    let hertz = |d: f64| 4.0 / 3.0 / 0.91 * d.powf(1.5);
    let mut reference = Reference::new([8, 12]).unwrap();
    let mut curves = vec![
        Series::line("Hertz, half space", depths.map(|d| (d, hertz(d))).to_vec()),
        Series::dots(
            "finite elements",
            depths
                .map(|d| (d, reference.press(1.0, d).unwrap().force))
                .to_vec(),
        ),
    ];
    for (name, mut press) in [
        ("5,832 regular nodes", cube(17).unwrap()),
        ("1,573 graded nodes", graded([10, 10, 12]).unwrap()),
    ] {
        let mut points = Vec::new();
        for depth in depths {
            let found = press.press(1.0 / SMALL, depth * SMALL, 1e-10).unwrap();
            let force = found.force / SMALL;
            points.push((depth, force));
            println!("{name}, {depth}, {force:.5}");
        }
        curves.push(Series::line(name, points));
    }
    let title = "Sphere of 1 m in a 2 m cube, sides and bottom fixed";
    let (x, y) = ("indentation (m)", "force over Young's modulus (m²)");
    charts.push(Plot::new(
        "force_indentation",
        title,
        [x, y],
        [Scale::Linear; 2],
        curves,
    ));
}

/// Error of the force against nodes: block and Hertz.
fn nodes(charts: &mut Vec<Plot>) {
    let mut reference = Reference::new([8, 12]).unwrap();
    let known = SPHERES.map(|(r, d)| reference.press(r, d).unwrap().force);
    let errors = |press: &mut Press| {
        let of = |((r, d), known): ((f64, f64), f64)| {
            let found = press.press(r / SMALL, d * SMALL, 1e-10).unwrap();
            found.force / (known * SMALL) - 1.0
        };
        let both: Vec<_> = SPHERES.into_iter().zip(known).map(of).collect();
        both
    };
    let mut curves: Vec<Series> = SPHERES
        .iter()
        .map(|(r, d)| Series::line(format!("regular, r {r} m, d {d} m"), Vec::new()))
        .collect();
    for cells in [9, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 22] {
        let mut press = cube(cells).unwrap();
        let count = press.body.rest.len() as f64;
        let errors = errors(&mut press);
        println!("{count} regular nodes: {errors:.4?}");
        for (curve, error) in curves.iter_mut().zip(errors) {
            curve.points.push((count, 100.0 * error));
        }
    }
    let mut worst = Vec::new();
    for cells in [
        [7; 3],
        [8; 3],
        [9; 3],
        [10; 3],
        [10, 10, 12],
        [11; 3],
        [12; 3],
        [13; 3],
    ] {
        let mut press = graded(cells).unwrap();
        let errors = errors(&mut press);
        let count = press.body.rest.len() as f64;
        println!("{count} graded nodes: {errors:.4?}");
        let largest = errors
            .into_iter()
            .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        worst.push((count, 100.0 * largest));
    }
    curves.push(Series::line("graded, worst of the three", worst));
    let mut hertz = Vec::new();
    for (fine, coarse) in [(3, 9), (4, 9), (5, 8), (6, 8), (8, 8), (10, 8)] {
        let mut press = match quarter(fine, coarse) {
            Ok((press, _)) => press,
            Err(problem) => {
                println!("{fine} cells in 1.5 contact radii: left out, {problem}");
                continue;
            }
        };
        let found = press.press(HERTZ.0, HERTZ.1, 1e-8).unwrap();
        let error = found.force / (0.25 * hertz_force(SOFT, HERTZ.0, HERTZ.1)) - 1.0;
        println!(
            "{} nodes, Hertz, {fine} cells in 1.5 contact radii: {error:.4}",
            press.body.rest.len()
        );
        hertz.push((press.body.rest.len() as f64, 100.0 * error));
    }
    curves.push(Series::line("quarter of a large block, Hertz", hertz));
    let (title, x) = (
        "Indentation force against finite elements and Hertz",
        "nodes",
    );
    charts.push(Plot::new(
        "nodes",
        title,
        [x, "error (%)"],
        [Scale::Logarithmic, Scale::Linear],
        curves,
    ));
}

/// Pressure over the radius beside Hertz's.
fn hertz(charts: &mut Vec<Plot>) {
    let ends: Vec<f64> = (1..=8).map(|k| 0.15 * f64::from(k)).collect();
    let profile = (0..=100).map(|k| f64::from(k) / 100.0);
    let mut curves = vec![Series::line(
        "Hertz",
        profile.map(|r| (r, (1.0 - r * r).sqrt())).collect(),
    )];
    let middle = |k: usize| ends[k] - 0.075;
    for (name, fine) in [("8 cells in 1.5 contact radii", 8), ("10 cells", 10)] {
        let (mut press, size) = quarter(fine, 8).unwrap();
        press.press(HERTZ.0, HERTZ.1, 1e-8).unwrap();
        let rings = press.rings(hertz_radius(), hertz_pressure(), &ends);
        println!(
            "{name}, block of {size:.0} contact radii: contact radius {:.3} of Hertz's; mean pressures on rings, Hertz's beside",
            moment_radius(press.points())
        );
        for (k, ring) in rings.iter().enumerate() {
            println!(
                "{:.3}, {:.3}, {:.3}",
                middle(k),
                ring.pressure,
                ring.expected
            );
        }
        let points = rings
            .iter()
            .enumerate()
            .map(|(k, ring)| (middle(k), ring.pressure));
        curves.push(Series::dots(name, points.collect()));
    }
    let (x, y) = (
        "radius over Hertz's contact radius",
        "pressure over Hertz's largest",
    );
    charts.push(Plot::new(
        "hertz_pressure",
        "Mean pressure on rings",
        [x, y],
        [Scale::Linear; 2],
        curves,
    ));
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().map(PathBuf::from);
    let parts: Vec<String> = arguments.collect();
    let wants = |part: &str| parts.is_empty() || parts.iter().any(|p| p == part);
    let mut charts = Vec::new();
    if wants("speed") {
        speed();
    }
    if wants("work") {
        work(&mut charts);
    }
    if wants("force") {
        force(&mut charts);
    }
    if wants("nodes") {
        nodes(&mut charts);
    }
    if wants("hertz") {
        hertz(&mut charts);
    }
    if let Some(folder) = folder {
        std::fs::create_dir_all(&folder).unwrap();
        for chart in charts {
            chart.write(&folder).unwrap();
            println!("{}", folder.join(format!("{}.svg", chart.name)).display());
        }
    }
}
