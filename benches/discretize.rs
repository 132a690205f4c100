//! Criterion benches of `phyxel-discretize`: read, repair and inspect, inside test, octree, stuffing,
//! nodes without tetrahedra, surfels. The body is the built-in liver; reading measures the surface written as PLY.
#![allow(missing_docs, reason = "criterion emits undocumented functions")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use phyxel_discretize::{
    Grading, Mesh, Octree, Primitive, Refinement, RepairSettings, SampleSettings, SampleTarget,
    Solid, parse_mesh, ply_mesh, repair, sample_points, sample_surfels, sample_tetrahedra,
    space_filling_order, surface_mesh, tetrahedra_edges,
};

fn surface(spacing: f64) -> Mesh {
    surface_mesh(&Primitive::Liver.into(), spacing).expect("the liver is thicker than the spacing")
}

fn bodies() -> [(&'static str, Solid); 2] {
    [
        ("function", Solid::from(Primitive::Liver)),
        ("mesh", Solid::from_mesh(surface(0.004))),
    ]
}

fn files(c: &mut Criterion) {
    let mesh = surface(0.002);
    let bytes = ply_mesh(&mesh);
    let mut group = c.benchmark_group("discretize/files");
    group.throughput(Throughput::Elements(mesh.triangles.len() as u64));
    group.bench_function("read_ply", |b| b.iter(|| parse_mesh(black_box(&bytes))));
    group.sample_size(20);
    let settings = RepairSettings::default();
    group.bench_function("repair_and_inspect", |b| {
        b.iter(|| repair(black_box(&mesh), &settings));
    });
    group.finish();
}

fn inside(c: &mut Criterion) {
    let mut group = c.benchmark_group("discretize/contains");
    for spacing in [0.008, 0.002] {
        let mesh = surface(spacing);
        let triangles = mesh.triangles.len();
        let solid = Solid::from_mesh(mesh);
        let mut random = testkit::cloud::Random::new(1);
        let mut points: Vec<DVec3> = (0..1000).map(|_| random.vector(0.09)).collect();
        points = space_filling_order(&points).apply(&points);
        group.throughput(Throughput::Elements(1000));
        group.bench_function(BenchmarkId::new("winding", triangles), |b| {
            b.iter(|| points.iter().filter(|p| solid.contains(**p)).count());
        });
        group.bench_function(BenchmarkId::new("signed_distance", triangles), |b| {
            b.iter(|| {
                points
                    .iter()
                    .map(|p| solid.signed_distance(*p))
                    .sum::<f64>()
            });
        });
    }
    group.finish();
}

fn stuffing(c: &mut Criterion) {
    let mut group = c.benchmark_group("discretize/sample_tetrahedra");
    group.sample_size(10);
    let bodies = bodies();
    for (name, solid) in &bodies {
        for nodes in [1_000, 10_000, 100_000] {
            let settings = SampleSettings::nodes(nodes);
            group.throughput(Throughput::Elements(nodes as u64));
            group.bench_function(BenchmarkId::new(*name, nodes), |b| {
                b.iter(|| sample_tetrahedra(black_box(solid), &settings));
            });
        }
    }
    group.finish();
    let settings = SampleSettings::default();
    let nodes = sample_tetrahedra(&bodies[0].1, &settings).expect("the liver is sampled");
    c.bench_function("discretize/tetrahedra_edges/6000", |b| {
        b.iter(|| tetrahedra_edges(nodes.positions.len(), black_box(&nodes.tetrahedra)));
    });
}

/// Four times coarser inside, half the spacing in a ball at the front of the left lobe.
fn grading() -> Grading {
    let center = DVec3::new(0.04, 0.03, 0.03);
    Grading {
        coarsest: 4.0,
        refinements: vec![Refinement {
            from: center,
            to: center,
            radius: 0.02,
            factor: 0.5,
        }],
        ..Grading::default()
    }
}

fn graded(c: &mut Criterion) {
    let bodies = bodies();
    let mut group = c.benchmark_group("discretize/octree");
    group.sample_size(10);
    for (name, solid) in &bodies {
        for cell in [0.008, 0.004, 0.002] {
            let tree = Octree::new(solid, cell, &grading(), 100_000_000);
            let leaves = tree.expect("a spacing in range").leaves().len() as u64;
            group.throughput(Throughput::Elements(leaves));
            group.bench_function(BenchmarkId::new(*name, leaves), |b| {
                b.iter(|| Octree::new(black_box(solid), cell, &grading(), 100_000_000));
            });
        }
    }
    group.finish();
    for (kind, points) in [("graded_tetrahedra", false), ("points", true)] {
        let mut group = c.benchmark_group(format!("discretize/{kind}"));
        group.sample_size(10);
        for (name, solid) in &bodies {
            for spacing in [0.012, 0.006, 0.003] {
                let settings = SampleSettings {
                    target: SampleTarget::Spacing(spacing),
                    grading: grading(),
                    ..SampleSettings::default()
                };
                let run = || {
                    if points {
                        let s = sample_points(black_box(solid), &settings, true);
                        s.map(|s| s.positions.len())
                    } else {
                        let s = sample_tetrahedra(black_box(solid), &settings);
                        s.map(|s| s.positions.len())
                    }
                };
                let nodes = run().expect("the liver is sampled") as u64;
                group.throughput(Throughput::Elements(nodes));
                group.bench_function(BenchmarkId::new(*name, nodes), |b| b.iter(run));
            }
        }
        group.finish();
    }
}

fn surfels(c: &mut Criterion) {
    let mesh = surface(0.004);
    let solid = Solid::from(Primitive::Liver);
    let mut group = c.benchmark_group("discretize/sample_surfels");
    group.sample_size(10);
    for count in [1_000, 10_000, 100_000] {
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::new("liver", count), |b| {
            b.iter(|| sample_surfels(black_box(&mesh), count, Some(&solid)));
        });
    }
    group.finish();
}

criterion_group!(benches, files, inside, stuffing, graded, surfels);
criterion_main!(benches);
