//! Criterion benches of `phyxel-integrate`: one step of each scheme, the eigenvalue, and a contact, on
//! elastic blocks of about 1e3, 1e4 and 1e5 nodes.
#![allow(missing_docs, reason = "criterion emits undocumented functions")]
#![allow(clippy::unwrap_used, reason = "a bench stops where a test would fail")]

use benches::{ElasticBody, Solid};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use phyxel_integrate::{
    BoundaryConditions, Contact, ContactSettings, ContactSurface, EigenvalueSettings,
    ExplicitScheme, ForceLaw, Implicit, ImplicitScheme, ImplicitSettings, Motion, MotionSettings,
    NewtonSettings, Pass, Pose, RigidShape, penalty,
};
use std::hint::black_box;

const SOLID: Solid = Solid {
    youngs_modulus: 1e5,
    poissons_ratio: 0.3,
    density: 1000.0,
};

struct Case {
    body: ElasticBody,
    supports: BoundaryConditions,
    critical: f64,
}

fn case(cells: u32) -> Case {
    let mut body = ElasticBody::block([cells; 3], DVec3::ZERO, DVec3::ONE, SOLID, 0.1).unwrap();
    let supports = BoundaryConditions::fixed_where(&body.rest, |x| x.z < 1e-9);
    let critical = body
        .eigenvalue(&supports, &EigenvalueSettings::default())
        .unwrap()
        .critical_step;
    Case {
        body,
        supports,
        critical,
    }
}

fn moving(case: &Case, scheme: ExplicitScheme) -> Motion {
    let settings = MotionSettings {
        scheme,
        gravity: DVec3::new(0.0, 0.0, -9.81),
        ..MotionSettings::default()
    };
    let (body, supports) = (&case.body, case.supports.clone());
    Motion::new(&body.rest, &body.masses, supports, settings).unwrap()
}

fn steps(c: &mut Criterion) {
    for cells in [9, 21, 45] {
        let mut case = case(cells);
        let n = case.body.rest.len();
        let mut group = c.benchmark_group("integrate/step");
        group
            .sample_size(10)
            .throughput(Throughput::Elements(n as u64));
        for scheme in [
            ExplicitScheme::VelocityVerlet,
            ExplicitScheme::SymplecticEuler,
        ] {
            let mut motion = moving(&case, scheme);
            let step = 0.5 * case.critical;
            group.bench_function(BenchmarkId::new(format!("{scheme:?}"), n), |b| {
                b.iter(|| {
                    motion
                        .step(step, |x, f| case.body.forces_into(x, f))
                        .unwrap();
                });
            });
        }
        // The loops of the step alone: forces cost nothing.
        let mut motion = moving(&case, ExplicitScheme::VelocityVerlet);
        group.bench_function(BenchmarkId::new("loops", n), |b| {
            b.iter(|| motion.step(1e-9, |_, f| f[0].x).unwrap());
        });
        // Its two passes, and both with damping that spares the rigid motion of a free body.
        let pass = Pass {
            step: 1e-9,
            first: [0.5e-9, 1.0],
            second: [0.5e-9, 1.0],
        };
        group.bench_function(BenchmarkId::new("first pass", n), |b| {
            b.iter(|| motion.begin_pass(&pass));
        });
        let forces = motion.state().forces.clone();
        group.bench_function(BenchmarkId::new("second pass", n), |b| {
            b.iter(|| black_box(motion.end_pass(&pass, &forces, &[])));
        });
        let mut free = Motion::new(
            &case.body.rest,
            &case.body.masses,
            BoundaryConditions::free(n),
            MotionSettings {
                damping: 3.0,
                ..MotionSettings::default()
            },
        )
        .unwrap();
        free.set_pieces(&vec![0; n]);
        group.bench_function(BenchmarkId::new("loops, free and damped", n), |b| {
            b.iter(|| free.step(1e-9, |_, f| f[0].x).unwrap());
        });
        for scheme in [
            ImplicitScheme::EnergyMomentum,
            ImplicitScheme::BackwardEuler,
        ] {
            let newton = NewtonSettings::with_tolerance(1e-3);
            let mut solver = Implicit::new(ImplicitSettings { scheme, newton }).unwrap();
            let begin = moving(&case, ExplicitScheme::VelocityVerlet);
            group.bench_function(BenchmarkId::new(format!("{scheme:?}"), n), |b| {
                let mut motion = begin.clone();
                b.iter(|| solver.step(&mut motion, 0.01, &mut case.body).unwrap());
            });
        }
        group.finish();
        let mut group = c.benchmark_group("integrate/eigenvalue");
        group
            .sample_size(10)
            .throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::new("cold", n), |b| {
            b.iter(|| {
                case.body
                    .eigenvalue(&case.supports, &EigenvalueSettings::default())
                    .unwrap()
            });
        });
        group.finish();
        let top = case.body.faces(|x| x.z > 1.0 - 1e-9);
        let surface = ContactSurface::from_triangles(&top, &case.body.rest, 4).unwrap();
        let stiffness = penalty(SOLID.youngs_modulus, 1.0 / f64::from(cells));
        let settings = ContactSettings::new(stiffness);
        let mut contact = Contact::new(surface, settings);
        let shape = RigidShape::Sphere { radius: 0.5 };
        let pose = Pose::at(DVec3::new(0.5, 0.5, 1.45));
        let mut f = vec![DVec3::ZERO; n];
        let mut group = c.benchmark_group("integrate/contact");
        group.throughput(Throughput::Elements(contact.surface().point_count() as u64));
        group.bench_function(BenchmarkId::new("sphere", n), |b| {
            b.iter(|| black_box(contact.add_forces(&shape, &pose, &case.body.rest, &mut f)));
        });
        group.finish();
    }
}

criterion_group!(benches, steps);
criterion_main!(benches);
