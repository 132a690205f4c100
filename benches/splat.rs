//! Stages of a frame: radii, binding, carrying, drawing, the picture's file, a cut with its skin and clips.
#![allow(missing_docs, reason = "criterion emits undocumented functions")]

mod time;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{DMat3, DVec3, Vec3};
use phyxel_splat::{
    Camera, CutSampler, DrawMode, RenderSettings, Renderer, Splat, Surfel, Tissue, TissueSettings,
    TissueTexture, covering_radii,
};
use std::hint::black_box;
use testkit::cloud::{golden_sphere, lattice};
use time::time;

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
    let nodes = lattice([20; 3], 1.0, 0.0, 0);
    let nodes: Vec<DVec3> = nodes.iter().map(|p| (*p - 9.5) * 0.01).collect();
    let tissue = Tissue::new(&x, &normals, &areas, &nodes, &TissueSettings::default());
    (tissue.expect("a sphere binds"), nodes)
}

const SIZES: [u32; 3] = [1_000, 10_000, 100_000];

/// Radii alone; radii, shape operators, clips at edges and the nodes of every surfel; what moves them.
fn stages(c: &mut Criterion) {
    let mut group = c.benchmark_group("splat/stages");
    group.sample_size(20);
    for n in SIZES {
        let (tissue, nodes) = sphere(n);
        let ((x, normals, areas), settings) = (samples(n), TissueSettings::default());
        group.throughput(Throughput::Elements(u64::from(n)));
        let radii = || covering_radii(&x, &normals);
        time(&mut group, "radii", n, radii);
        let bind = || Tissue::new(&x, &normals, &areas, &nodes, &settings);
        time(&mut group, "bind to 8 nodes", n, bind);
        let gradients = vec![DMat3::from_rotation_x(0.1); nodes.len()];
        let mut splats = Vec::new();
        time(&mut group, "carry by 8 nodes", n, || {
            tissue.carry_into(black_box(&nodes), &gradients, &mut splats);
        });
    }
}

fn draw(c: &mut Criterion) {
    let mut group = c.benchmark_group("splat/draw_1280x720");
    group.sample_size(10);
    let half = DVec3::splat(0.1);
    let view = DVec3::new(-0.3, -0.5, -1.0);
    let camera = Camera::framing(-half, half, view, DVec3::Y, 16.0 / 9.0);
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
            time(&mut group, name, n, || renderer.draw(&view, &[], &camera));
        }
    }
    let (tissue, _) = sphere(10_000);
    let splats: Vec<Splat> = tissue.surfels().iter().map(Surfel::at_rest).collect();
    let colors = TissueTexture::liver(0.2).colors(tissue.surfels());
    let mut renderer = Renderer::new(RenderSettings::default());
    let frame = renderer.draw(&tissue.view(&splats, &colors), &[], &camera);
    time(&mut group, "PNG", 10_000, || {
        let mut file = Vec::new();
        frame.write_png(&mut file).map(|()| file)
    });
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
            let cut = |tissue: &mut Tissue| tissue.cut(&strip, &inside, &crosses);
            b.iter_batched_ref(|| tissue.clone(), cut, BatchSize::LargeInput);
        });
    }
    let big = strip.map(|t| t.map(|p| p * 10.0));
    time(&mut group, "samples", 10_000, || {
        CutSampler::new(10_000.0 / 0.18).points(&big)
    });
}

criterion_group!(benches, stages, draw, cut);
criterion_main!(benches);
