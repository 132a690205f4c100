//! What steps cost and how far off they are: implicit against explicit on the pressed 2 m cube, the
//! force over the indentation, and error against time of every integrator on one beam.
//!
//! `cargo run --release -p tests --example integrate_study`
#![allow(clippy::print_stdout, reason = "a study prints")]
#![allow(
    clippy::missing_assert_message,
    clippy::unwrap_used,
    clippy::cast_precision_loss,
    reason = "a study stops where a test would fail"
)]

#[allow(dead_code, reason = "shared with the tests")]
#[path = "../integrate_bodies.rs"]
mod integrate_bodies;

use glam::DVec3;
use integrate_bodies::{Body, Solid};
use phyxel_integrate::{
    Contact, ContactSettings, ContactSurface, EigenvalueSettings, ForceLaw, Implicit,
    ImplicitScheme, ImplicitSettings, Motion, MotionSettings, NewtonSettings, Path, Pose, Pressed,
    Scheme, Shape, StaticLoad, StepView, Supports, Tool, largest_eigenvalue, penalty, solve_static,
};
use std::time::Instant;

const SOLID: Solid = Solid {
    youngs_modulus: 1e5,
    poissons_ratio: 0.3,
    density: 1000.0,
};

fn largest_distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| a.distance(*b))
        .fold(0.0, f64::max)
}

fn cube() -> (Body, Supports, Contact) {
    let low = DVec3::new(-1.0, -1.0, -2.0);
    let body = Body::block([17; 3], low, DVec3::new(1.0, 1.0, 0.0), SOLID, 0.1);
    let held = body.nodes(|x| x.x.abs() > 1.0 - 1e-9 || x.y.abs() > 1.0 - 1e-9 || x.z < 1e-9 - 2.0);
    let supports = Supports::fixed(body.rest.len(), &held);
    let top = body.faces(|x| x.z > -1e-9);
    let surface = ContactSurface::from_triangles(&top, &body.rest, 4).unwrap();
    let stiffness = penalty(SOLID.youngs_modulus, 2.0 / 17.0);
    let settings = ContactSettings::new(stiffness);
    (body, supports, Contact::new(surface, settings))
}

/// 5,832 nodes, sphere of 1 m pressed 0.1 m deep in half a second.
fn pressed_cube() {
    let (mut body, supports, mut contact) = cube();
    let shape = Shape::Sphere { radius: 1.0 };
    let origin = DVec3::Z;
    let path = Path::ramp(0.0, 0.5, DVec3::Z * -0.1).unwrap();

    println!("indentation (m), force (N), force over Hertz, contact radius over Hertz");
    let mut x = body.rest.clone();
    for depth in [0.01, 0.02, 0.04, 0.06, 0.08, 0.1] {
        let pose = Pose::at(DVec3::Z * (1.0 - depth));
        let mut law = Pressed::new(&mut body, &mut contact, shape, pose);
        let settings = NewtonSettings::default();
        solve_static(
            &mut law,
            &mut x,
            &supports,
            &StaticLoad::default(),
            &settings,
        )
        .unwrap();
        let sum = law.tool_forces[0];
        let hertz = 4.0 / 3.0 * SOLID.youngs_modulus / 0.91 * f64::powf(depth, 1.5);
        let radius = (sum.area / std::f64::consts::PI / depth).sqrt();
        println!(
            "{depth}, {:.1}, {:.3}, {radius:.3}",
            sum.force.z,
            sum.force.z / hertz
        );
    }

    // Critical step with the contact of the deepest state.
    let settings = EigenvalueSettings::default();
    let masses = body.masses.clone();
    let bare = body.eigenvalue(&supports, &settings).critical_step;
    let mut law = Pressed::new(&mut body, &mut contact, shape, Pose::at(DVec3::Z * 0.9));
    let mut f = x.clone();
    law.forces_into(&x, &mut f);
    let product = |v: &[DVec3], out: &mut [DVec3]| law.tangent_product_into(v, out);
    let with = largest_eigenvalue(&masses, &supports, product, &mut Vec::new(), &settings)
        .unwrap()
        .critical_step;
    println!(
        "critical step {:.2} ms, in contact {:.2} ms",
        1e3 * bare,
        1e3 * with
    );

    let begin = Motion::new(
        &body.rest,
        &body.masses,
        supports,
        MotionSettings::default(),
    )
    .unwrap();
    let mut explicit = |share: f64| {
        let mut motion = begin.clone();
        let mut tool = Tool::on_path(shape, Pose::at(origin), path.clone());
        let press = &mut |view: &StepView<'_>, f: &mut [DVec3]| tool.press(&mut contact, view, f);
        let start = Instant::now();
        motion
            .advance_with(0.5, share * bare, |x, f| body.forces_into(x, f), press)
            .unwrap();
        (motion, start.elapsed().as_secs_f64(), tool.contact.force.z)
    };
    let (fine, _, _) = explicit(0.1);
    let (coarse, seconds, force) = explicit(0.9);
    let deepest = largest_distance(fine.positions(), &body.rest);
    println!(
        "explicit: {} steps of {:.2} ms, {:.2} ms each, {:.1} x real time, force {force:.0} N, error {:.1e} of the deepest",
        coarse.steps(),
        0.5e3 / coarse.steps() as f64,
        1e3 * seconds / coarse.steps() as f64,
        0.5 / seconds,
        largest_distance(coarse.positions(), fine.positions()) / deepest
    );
    for scheme in [ImplicitScheme::Newmark, ImplicitScheme::BackwardEuler] {
        let newton = NewtonSettings {
            tolerance: 1e-3,
            ..NewtonSettings::default()
        };
        let mut solver = Implicit::new(ImplicitSettings { scheme, newton }).unwrap();
        let mut motion = begin.clone();
        let (mut products, mut evaluations) = (0, 0);
        let start = Instant::now();
        for k in 0..50_u32 {
            let (moved, _) = path.at(0.01 * f64::from(k + 1));
            let pose = Pose::at(origin + moved);
            let mut law = Pressed::new(&mut body, &mut contact, shape, pose);
            let report = solver.step(&mut motion, 0.01, &mut law).unwrap();
            products += report.linear_iterations;
            evaluations += report.evaluations;
        }
        println!(
            "{scheme:?}: 50 steps of 10 ms, {:.1} ms each ({:.1} products, {:.1} evaluations), error {:.1e} of the deepest",
            1e3 * start.elapsed().as_secs_f64() / 50.0,
            f64::from(u32::try_from(products).unwrap()) / 50.0,
            f64::from(u32::try_from(evaluations).unwrap()) / 50.0,
            largest_distance(motion.positions(), fine.positions()) / deepest
        );
    }
}

/// Error at 0.4 s of a plucked cantilever against the finest run, and the time it took.
fn work_precision() {
    let solid = Solid {
        youngs_modulus: 1e4,
        ..SOLID
    };
    let mut body = Body::block(
        [12, 3, 3],
        DVec3::ZERO,
        DVec3::new(0.4, 0.1, 0.1),
        solid,
        0.1,
    );
    let held = body.nodes(|x| x.x < 1e-9);
    let supports = Supports::fixed(body.rest.len(), &held);
    let critical = body
        .eigenvalue(&supports, &EigenvalueSettings::default())
        .critical_step;
    let with = |scheme| {
        let settings = MotionSettings {
            scheme,
            ..MotionSettings::default()
        };
        let mut motion = Motion::new(&body.rest, &body.masses, supports.clone(), settings).unwrap();
        let v: Vec<DVec3> = body
            .rest
            .iter()
            .map(|x| DVec3::Z * (0.8 * (x.x / 0.4).powi(2)))
            .collect();
        motion.set_velocities(&v).unwrap();
        motion
    };
    let (verlet, euler) = (with(Scheme::VelocityVerlet), with(Scheme::SymplecticEuler));
    let mut exact = verlet.clone();
    exact
        .advance_to(0.4, 0.02 * critical, |x, f| body.forces_into(x, f))
        .unwrap();
    let deepest = largest_distance(exact.positions(), &body.rest);
    println!("scheme, step over critical, milliseconds, error over the largest displacement");
    for share in [0.9, 0.45, 0.225, 0.1125] {
        for begin in [&verlet, &euler] {
            let mut motion = begin.clone();
            let start = Instant::now();
            motion
                .advance_to(0.4, share * critical, |x, f| body.forces_into(x, f))
                .unwrap();
            let time = 1e3 * start.elapsed().as_secs_f64();
            let error = largest_distance(motion.positions(), exact.positions()) / deepest;
            println!(
                "{:?}, {share}, {time:.2}, {error:.1e}",
                motion.settings().scheme
            );
        }
    }
    for scheme in [ImplicitScheme::Newmark, ImplicitScheme::BackwardEuler] {
        for count in [20_u32, 40, 80, 160] {
            let newton = NewtonSettings {
                tolerance: 1e-5,
                ..NewtonSettings::default()
            };
            let mut solver = Implicit::new(ImplicitSettings { scheme, newton }).unwrap();
            let mut motion = verlet.clone();
            let start = Instant::now();
            for _ in 0..count {
                solver
                    .step(&mut motion, 0.4 / f64::from(count), &mut body)
                    .unwrap();
            }
            let time = 1e3 * start.elapsed().as_secs_f64();
            let error = largest_distance(motion.positions(), exact.positions()) / deepest;
            let share = 0.4 / f64::from(count) / critical;
            println!("{scheme:?}, {share:.2}, {time:.2}, {error:.1e}");
        }
    }
}

fn main() {
    pressed_cube();
    work_precision();
}
