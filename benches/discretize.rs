//! Criterion benches of `phyxel-discretize`: read, repair and inspect, inside test, octree, stuffing,
//! nodes without tetrahedra, surfels. The body is the built-in liver; reading measures the surface written as PLY.
#![allow(missing_docs, reason = "criterion emits undocumented functions")]

mod time;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use phyxel_discretize::{
    Grading, Mesh, Octree, Primitive, Refinement, RepairSettings, SampleSettings, SampleTarget,
    Solid, parse_mesh, ply_mesh, repair, sample_points, sample_surfels, sample_tetrahedra,
    space_filling_order, surface_mesh, tetrahedra_edges,
};
use testkit::cloud::uniform;
use time::time;

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
    let (bytes, triangles) = (ply_mesh(&mesh), mesh.triangles.len());
    let mut group = c.benchmark_group("discretize/files");
    group.sample_size(20);
    group.throughput(Throughput::Elements(triangles as u64));
    let read = || parse_mesh(black_box(&bytes));
    time(&mut group, "read_ply", triangles, read);
    let settings = RepairSettings::default();
    let mend = || repair(black_box(&mesh), &settings);
    time(&mut group, "repair_and_inspect", triangles, mend);
}

fn inside(c: &mut Criterion) {
    let mut group = c.benchmark_group("discretize/contains");
    group.throughput(Throughput::Elements(1000));
    for spacing in [0.008, 0.002] {
        let mesh = surface(spacing);
        let triangles = mesh.triangles.len();
        let solid = Solid::from_mesh(mesh);
        let points = uniform(1000, 0.09, 1);
        let points = space_filling_order(&points).apply(&points);
        time(&mut group, "winding", triangles, || {
            points.iter().filter(|p| solid.contains(**p)).count()
        });
        time(&mut group, "signed_distance", triangles, || {
            let distances = points.iter().map(|p| solid.signed_distance(*p));
            distances.sum::<f64>()
        });
    }
}

fn stuffing(c: &mut Criterion) {
    let mut group = c.benchmark_group("discretize/sample_tetrahedra");
    group.sample_size(10);
    let bodies = bodies();
    for (name, solid) in &bodies {
        for nodes in [1_000, 10_000, 100_000] {
            let settings = SampleSettings::nodes(nodes);
            group.throughput(Throughput::Elements(nodes as u64));
            let fill = || sample_tetrahedra(black_box(solid), &settings);
            time(&mut group, *name, nodes, fill);
        }
    }
    let settings = SampleSettings::default();
    let nodes = sample_tetrahedra(&bodies[0].1, &settings).expect("the liver is sampled");
    time(&mut group, "edges", 6000, || {
        tetrahedra_edges(nodes.positions.len(), black_box(&nodes.tetrahedra))
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
    for (name, solid) in &bodies() {
        let mut group = c.benchmark_group("discretize/octree");
        group.sample_size(10);
        for cell in [0.008, 0.004, 0.002] {
            let make = || Octree::new(black_box(solid), cell, &grading(), 100_000_000);
            let leaves = make().expect("a spacing in range").leaves().len() as u64;
            group.throughput(Throughput::Elements(leaves));
            time(&mut group, *name, leaves, make);
        }
        drop(group);
        for points in [false, true] {
            let kind = ["graded_tetrahedra", "points"][usize::from(points)];
            let mut group = c.benchmark_group(format!("discretize/{kind}"));
            group.sample_size(10);
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
                time(&mut group, *name, nodes, run);
            }
        }
    }
}

fn surfels(c: &mut Criterion) {
    let mesh = surface(0.004);
    let solid = Solid::from(Primitive::Liver);
    let mut group = c.benchmark_group("discretize/sample_surfels");
    group.sample_size(10);
    for count in [1_000, 10_000, 100_000] {
        group.throughput(Throughput::Elements(count as u64));
        let sample = || sample_surfels(black_box(&mesh), count, Some(&solid));
        time(&mut group, "liver", count, sample);
    }
}

criterion_group!(benches, files, inside, stuffing, graded, surfels);
criterion_main!(benches);
