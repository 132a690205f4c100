//! Criterion benches of `phyxel`'s world: a step, a blade sample, settling and a return to an earlier copy, of the
//! embedded block and liver.
#![allow(missing_docs, reason = "criterion emits undocumented functions")]
#![allow(clippy::unwrap_used, reason = "a bench stops where a test would fail")]

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use glam::DVec3;
use phyxel::{Action, Input, StrokePhase, World};
use std::hint::black_box;

/// Steps before a world is measured: gravity pulls by then.
const WARM_UP: u32 = 50;

fn world(name: &str) -> World {
    let mut scene = phyxel_scene::embedded(name, &[]).unwrap();
    scene.pictures = None;
    World::new(scene).unwrap()
}

fn moving(name: &str) -> World {
    let mut world = world(name);
    for _ in 0..WARM_UP {
        world.step().unwrap();
    }
    world
}

/// An edge that hangs down at `x` (share of the body's width) and reaches through it, the first of a stroke.
fn blade(world: &World, x: f64, phase: StrokePhase) -> Input {
    let bounds = world.bodies()[0].solid.bounds();
    let (low, size) = (bounds.min, bounds.size());
    let at = |z: f64| low + size * DVec3::new(x, -0.1, z);
    let action = Action::Blade {
        cut: 0,
        phase,
        edge: vec![at(-0.1), at(1.1)],
    };
    Input {
        step: world.steps(),
        action,
    }
}

fn benches(c: &mut Criterion) {
    for name in ["block", "liver"] {
        let mut group = c.benchmark_group(format!("world/{name}"));
        group.sample_size(10);
        let start = moving(name);
        let mut world = start.clone();
        group.bench_function("step", |b| b.iter(|| world.step().unwrap()));
        // The second edge of a stroke, with the step that follows it; less a step, a capture.
        let mut cutting = start.clone();
        cutting
            .push(vec![blade(&cutting, 0.5, StrokePhase::Start)])
            .unwrap();
        cutting.step().unwrap();
        let mut next = blade(&cutting, 0.5, StrokePhase::Update);
        if let Action::Blade { edge, .. } = &mut next.action {
            let way = 0.4 * start.bodies()[0].solid.bounds().size().y;
            for point in edge {
                point.y += way;
            }
        }
        cutting.push(vec![next]).unwrap();
        group.bench_function("capture and step", |b| {
            b.iter_batched(
                || cutting.clone(),
                |mut world| {
                    world.step().unwrap();
                    world
                },
                BatchSize::PerIteration,
            );
        });
        // What a program goes back to at once.
        group.bench_function("copy", |b| b.iter(|| black_box(start.clone())));
        group.finish();
    }
    let mut group = c.benchmark_group("world/block");
    group.sample_size(10);
    group.bench_function("settle", |b| {
        b.iter_batched(
            || world("block"),
            |mut world| world.settle().unwrap(),
            BatchSize::PerIteration,
        );
    });
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
