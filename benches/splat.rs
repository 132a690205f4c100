//! Stages of a frame: radii, binding, carrying, drawing, the picture's file, a cut with its skin and clips.
#![allow(missing_docs, reason = "criterion emits undocumented functions")]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{DMat3, DVec3, Vec3};
use phyxel_splat::{
    Camera, CutSampler, DrawMode, RenderSettings, Renderer, Splat, Surfel, Tissue, TissueSettings,
    TissueTexture, covering_radii,
};
use std::hint::black_box;
use testkit::cloud::golden_sphere;

/// Positions, normals and areas of a sphere of radius 0.1 m on a golden spiral.
fn samples(n: u32) -> (Vec<DVec3>, Vec<DVec3>, Vec<f64>) {
    let normals = golden_sphere(n);
    let x: Vec<DVec3> = normals.iter().map(|p| *p * 0.1).collect();
    let areas = vec![4.0 * std::f64::consts::PI * 0.01 / f64::from(n); x.len()];
    (x, normals, areas)
}

/// Them in 8,000 nodes.
fn sphere(n: u32) -> (Tissue, Vec<DVec3>) {
    let (x, normals, areas) = samples(n);
    let mut nodes = Vec::new();
    for i in 0..20_i32.pow(3) {
        let p = DVec3::new(
            f64::from(i % 20),
            f64::from(i / 20 % 20),
            f64::from(i / 400),
        );
        nodes.push((p - 9.5) * 0.01);
    }
    let tissue = Tissue::new(&x, &normals, &areas, &nodes, &TissueSettings::default());
    (tissue.expect("a sphere binds"), nodes)
}

const SIZES: [u32; 3] = [1_000, 10_000, 100_000];

fn radii(c: &mut Criterion) {
    let mut group = c.benchmark_group("splat/covering_radii");
    group.sample_size(10);
    for n in SIZES {
        let (x, normals, _) = samples(n);
        group.throughput(Throughput::Elements(u64::from(n)));
        group.bench_function(BenchmarkId::new("all", n), |b| {
            b.iter(|| black_box(covering_radii(&x, &normals)));
        });
    }
    group.finish();
}

/// Radii, shape operators, clips at edges and the nodes of every surfel.
fn bind(c: &mut Criterion) {
    let mut group = c.benchmark_group("splat/bind");
    group.sample_size(10);
    for n in SIZES {
        let ((x, normals, areas), (_, nodes)) = (samples(n), sphere(n));
        let settings = TissueSettings::default();
        group.throughput(Throughput::Elements(u64::from(n)));
        group.bench_function(BenchmarkId::new("8 nodes", n), |b| {
            b.iter(|| Tissue::new(&x, &normals, &areas, &nodes, &settings));
        });
    }
    group.finish();
}

fn carry(c: &mut Criterion) {
    let mut group = c.benchmark_group("splat/carry");
    for n in SIZES {
        let (tissue, nodes) = sphere(n);
        let gradients = vec![DMat3::from_rotation_x(0.1); nodes.len()];
        let mut splats = Vec::new();
        group.throughput(Throughput::Elements(u64::from(n)));
        group.bench_function(BenchmarkId::new("8 nodes", n), |b| {
            b.iter(|| tissue.carry_into(black_box(&nodes), &gradients, &mut splats));
        });
    }
    group.finish();
}

fn draw(c: &mut Criterion) {
    let mut group = c.benchmark_group("splat/draw_1280x720");
    group.sample_size(10);
    let half = DVec3::splat(0.1);
    let camera = Camera::framing(
        -half,
        half,
        DVec3::new(-0.3, -0.5, -1.0),
        DVec3::Y,
        16.0 / 9.0,
    );
    for n in SIZES {
        let (tissue, _) = sphere(n);
        let splats: Vec<Splat> = tissue.surfels().iter().map(Surfel::at_rest).collect();
        let colors = vec![Vec3::new(0.2, 0.05, 0.03); splats.len()];
        group.throughput(Throughput::Elements(u64::from(n)));
        for (mode, samples, name) in [
            (DrawMode::Disks, 1, "disks"),
            (DrawMode::SinglePass, 1, "single pass"),
            (DrawMode::ThreePass, 1, "three-pass"),
            (DrawMode::ThreePass, 2, "three-pass 2x2"),
        ] {
            let mut renderer = Renderer::new(RenderSettings {
                mode,
                samples,
                ..RenderSettings::default()
            });
            let view = tissue.view(&splats, &colors);
            group.bench_function(BenchmarkId::new(name, n), |b| {
                b.iter(|| black_box(renderer.draw(&view, &[], &camera)));
            });
        }
    }
    let (tissue, _) = sphere(10_000);
    let splats: Vec<Splat> = tissue.surfels().iter().map(Surfel::at_rest).collect();
    let colors = TissueTexture::liver(0.2).colors(tissue.surfels());
    let mut renderer = Renderer::new(RenderSettings::default());
    let frame = renderer.draw(&tissue.view(&splats, &colors), &[], &camera);
    group.bench_function("PNG", |b| {
        b.iter(|| {
            let mut file = Vec::new();
            frame.write_png(&mut file).map(|()| file)
        });
    });
    group.finish();
}

fn cut(c: &mut Criterion) {
    let mut group = c.benchmark_group("splat/cut");
    group.sample_size(10);
    let corner = |y: f64, z: f64| DVec3::new(0.0031, y, z);
    let strip = [
        [corner(0.02, 0.0), corner(0.2, 0.0), corner(0.02, 0.01)],
        [corner(0.02, 0.01), corner(0.2, 0.0), corner(0.2, 0.01)],
    ];
    let inside = |p: DVec3| p.length_squared() < 0.01;
    let crosses = |a: DVec3, b: DVec3| {
        let at = a.lerp(b, (0.0031 - a.x) / (b.x - a.x));
        (a.x < 0.0031) != (b.x < 0.0031) && at.y > 0.02 && at.z > 0.0 && at.z < 0.01
    };
    for n in SIZES {
        let (tissue, _) = sphere(n);
        group.bench_function(BenchmarkId::new("one strip", n), |b| {
            b.iter_batched_ref(
                || tissue.clone(),
                |tissue| {
                    tissue
                        .cut(&strip, &inside, &crosses)
                        .expect("finite triangles")
                },
                criterion::BatchSize::LargeInput,
            );
        });
    }
    group.bench_function("10,000 samples", |b| {
        let big = strip.map(|t| t.map(|p| p * 10.0));
        b.iter(|| black_box(CutSampler::new(10_000.0 / 0.18).points(&big)));
    });
    group.finish();
}

criterion_group!(benches, radii, bind, carry, draw, cut);
criterion_main!(benches);
