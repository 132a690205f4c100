//! Criterion benches of `phyxel-integrate`: one step of each scheme, the eigenvalue, and a contact, on
//! elastic blocks of about 1e3, 1e4 and 1e5 nodes.
#![allow(missing_docs, reason = "criterion emits undocumented functions")]
#![allow(clippy::unwrap_used, reason = "a bench stops where a test would fail")]

mod time;

use benches::{ElasticBody, Solid};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use phyxel_integrate::{
    BoundaryConditions, Contact, ContactSettings, ContactSurface, EigenvalueSettings,
    ExplicitScheme, ForceLaw, Implicit, ImplicitScheme, ImplicitSettings, Motion, MotionSettings,
    NewtonSettings, Pass, Pose, RigidShape, penalty,
};
use time::time;

const SOLID: Solid = Solid {
    youngs_modulus: 1e5,
    poissons_ratio: 0.3,
    density: 1000.0,
};
/// Cells along a side of the cubes.
const CELLS: [u32; 3] = [9, 21, 45];

/// A cube of a side of 1 m, fixed below.
fn cube(cells: u32) -> (ElasticBody, BoundaryConditions) {
    let body = ElasticBody::block([cells; 3], DVec3::ZERO, DVec3::ONE, SOLID, 0.1).unwrap();
    let supports = BoundaryConditions::fixed_where(&body.rest, |x| x.z < 1e-9);
    (body, supports)
}

/// It hangs, and moves by a scheme.
fn moving(body: &ElasticBody, supports: &BoundaryConditions, scheme: ExplicitScheme) -> Motion {
    let settings = MotionSettings {
        scheme,
        gravity: DVec3::new(0.0, 0.0, -9.81),
        ..MotionSettings::default()
    };
    Motion::new(&body.rest, &body.masses, supports.clone(), settings).unwrap()
}

fn steps(c: &mut Criterion) {
    let mut group = c.benchmark_group("integrate/step");
    group.sample_size(10);
    for cells in CELLS {
        let (mut body, supports) = cube(cells);
        let n = body.rest.len();
        group.throughput(Throughput::Elements(n as u64));
        let found = body.eigenvalue(&supports, &EigenvalueSettings::default());
        let step = 0.5 * found.unwrap().critical_step;
        for scheme in [
            ExplicitScheme::VelocityVerlet,
            ExplicitScheme::SymplecticEuler,
        ] {
            let mut motion = moving(&body, &supports, scheme);
            time(&mut group, format!("{scheme:?}"), n, || {
                let taken = motion.step(step, |x, f| body.forces_into(x, f));
                taken.unwrap();
            });
        }
        // The loops of the step alone: forces cost nothing.
        let mut motion = moving(&body, &supports, ExplicitScheme::VelocityVerlet);
        time(&mut group, "loops", n, || {
            motion.step(1e-9, |_, f| f[0].x).unwrap();
        });
        // Its two passes, and both with damping that spares the rigid motion of a free body.
        let pass = Pass {
            step: 1e-9,
            first: [0.5e-9, 1.0],
            second: [0.5e-9, 1.0],
        };
        time(&mut group, "first pass", n, || motion.begin_pass(&pass));
        let forces = motion.state().forces.clone();
        time(&mut group, "second pass", n, || {
            motion.end_pass(&pass, &forces, &[])
        });
        let settings = MotionSettings {
            damping: 3.0,
            ..MotionSettings::default()
        };
        let nowhere = BoundaryConditions::free(n);
        let mut free = Motion::new(&body.rest, &body.masses, nowhere, settings).unwrap();
        free.set_pieces(&vec![0; n]);
        time(&mut group, "loops, free and damped", n, || {
            free.step(1e-9, |_, f| f[0].x).unwrap();
        });
        for scheme in [
            ImplicitScheme::EnergyMomentum,
            ImplicitScheme::BackwardEuler,
        ] {
            let newton = NewtonSettings::with_tolerance(1e-3);
            let mut solver = Implicit::new(ImplicitSettings { scheme, newton }).unwrap();
            let begin = moving(&body, &supports, ExplicitScheme::VelocityVerlet);
            // Each sample from the begin: later steps of a body that comes to rest are cheaper.
            group.bench_function(BenchmarkId::new(format!("{scheme:?}"), n), |b| {
                let mut motion = begin.clone();
                b.iter(|| solver.step(&mut motion, 0.01, &mut body).unwrap());
            });
        }
    }
}

fn eigenvalue(c: &mut Criterion) {
    let mut group = c.benchmark_group("integrate/eigenvalue");
    group.sample_size(10);
    for cells in CELLS {
        let (mut body, supports) = cube(cells);
        let n = body.rest.len();
        group.throughput(Throughput::Elements(n as u64));
        time(&mut group, "cold", n, || {
            let found = body.eigenvalue(&supports, &EigenvalueSettings::default());
            found.unwrap()
        });
    }
}

fn contact(c: &mut Criterion) {
    let mut group = c.benchmark_group("integrate/contact");
    for cells in CELLS {
        let (body, _) = cube(cells);
        let top = body.faces(|x| x.z > 1.0 - 1e-9);
        let surface = ContactSurface::from_triangles(&top, &body.rest, 4).unwrap();
        group.throughput(Throughput::Elements(surface.point_count() as u64));
        let stiffness = penalty(SOLID.youngs_modulus, 1.0 / f64::from(cells));
        let mut contact = Contact::new(surface, ContactSettings::new(stiffness));
        let shape = RigidShape::Sphere { radius: 0.5 };
        let pose = Pose::at(DVec3::new(0.5, 0.5, 1.45));
        let mut f = vec![DVec3::ZERO; body.rest.len()];
        time(&mut group, "sphere", body.rest.len(), || {
            contact.add_forces(&shape, &pose, &body.rest, &mut f)
        });
    }
}

criterion_group!(benches, steps, eigenvalue, contact);
criterion_main!(benches);
