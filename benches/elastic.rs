//! Criterion benches of `phyxel-elastic`: `cargo bench -p benches --bench elastic`.
//!
//! Bodies are lattices along a Morton curve with 18 neighbours inside; throughput is counted in
//! directed pairs, so `ns/pair` compares across sizes.

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use phyxel_elastic::{
    Dilatation, Elastic, Fiber, Material, Materials, Nodes, PronyTerm, Settings, Stencils,
};
use testkit::block::Block;
use testkit::cloud::Random;

fn stencils(block: &Block) -> Stencils<'_> {
    let (weights, matrices) = (&block.weights, &block.matrices);
    Stencils::plain(&block.offsets, &block.indices, weights, matrices)
        .with_multipliers(&block.scales, &block.multipliers)
}

fn elastic(block: &Block, material: Material, settings: &Settings) -> Elastic {
    let nodes = Nodes::new(&block.positions, &block.volumes);
    let materials = Materials::Uniform(material);
    Elastic::new(&stencils(block), &nodes, &materials, settings).expect("a valid lattice")
}

/// A lattice of so many nodes a side, deformed positions, and room for forces.
fn lattice(side: usize) -> (Block, Vec<DVec3>, Vec<DVec3>) {
    let block = Block::eighteen([side; 3], 0.1);
    let x = deformed(&block);
    let forces = vec![DVec3::ZERO; x.len()];
    (block, x, forces)
}

/// Stretched by 2 % and shaken, so that no product is zero by symmetry.
fn deformed(block: &Block) -> Vec<DVec3> {
    let mut random = Random::new(1);
    block
        .positions
        .iter()
        .map(|x| *x * 1.02 + random.vector(0.002))
        .collect()
}

fn pairs(body: &Elastic) -> Throughput {
    Throughput::Elements(body.pair_count() as u64)
}

/// Nodes a side of the lattices: 1,000, 5,832, 97,336 and a million nodes.
const SIDES: [usize; 4] = [10, 18, 46, 100];

/// From 1e3 to 1e6 nodes on all threads.
fn sizes(c: &mut Criterion) {
    let mut group = c.benchmark_group("forces, all threads");
    group.sample_size(10);
    for side in SIDES {
        let (block, x, mut f) = lattice(side);
        let settings = Settings::default();
        let mut body = elastic(&block, Material::neo_hookean(1e4, 0.4), &settings);
        group.throughput(pairs(&body));
        group.bench_function(BenchmarkId::new("Double", x.len()), |b| {
            b.iter(|| body.forces_into(&x, &mut f));
        });
    }
    group.finish();
}

/// Every law and option, forces and tangent products, from 1e3 to 1e6 nodes on one thread.
fn laws(c: &mut Criterion) {
    let one = testkit::pool(1);
    let neo = Material::neo_hookean(1e4, 0.4);
    let fiber = Fiber {
        direction: DVec3::X,
        stiffness: 1e4,
        exponent: 1.0,
        dispersion: 0.1,
    };
    let term = PronyTerm {
        ratio: 0.5,
        relaxation_time: 0.1,
    };
    let plain = Settings::default();
    let mean = Settings {
        dilatation: Dilatation::Mean,
        ..plain
    };
    let free = Settings {
        stabilization: 0.0,
        ..plain
    };
    let kirchhoff = Material::saint_venant_kirchhoff(1e4, 0.4);
    let rivlin = Material::mooney_rivlin(1e4, 0.4, 0.3);
    let cases = [
        ("neo-Hookean", neo, plain),
        ("neo-Hookean, no control", neo, free),
        ("neo-Hookean, mean dilatation", neo, mean),
        ("Saint Venant-Kirchhoff", kirchhoff, plain),
        ("Mooney-Rivlin", rivlin, plain),
        ("fibers", neo.with_fiber(fiber), plain),
        ("Prony series", neo.with_prony(&[term]), plain),
    ];
    for (pass, products) in [("forces", false), ("tangent product", true)] {
        let mut group = c.benchmark_group(pass);
        // Ten evaluations of a million nodes take two seconds.
        group.sample_size(10);
        group.warm_up_time(Duration::from_millis(300));
        group.measurement_time(Duration::from_secs(1));
        for side in SIDES {
            let (block, x, mut f) = lattice(side);
            for (name, material, settings) in cases {
                let mut body = elastic(&block, material, &settings);
                body.begin_viscous_step(1e-3);
                body.forces_into(&x, &mut f);
                group.throughput(pairs(&body));
                group.bench_function(BenchmarkId::new(name, x.len()), |b| {
                    one.install(|| {
                        b.iter(|| {
                            if products {
                                body.tangent_product_into(&x, &mut f);
                            } else {
                                body.forces_into(&x, &mut f);
                            }
                        });
                    });
                });
            }
        }
        group.finish();
    }
}

/// What is done once, or once per cut.
fn setup(c: &mut Criterion) {
    let mut group = c.benchmark_group("set-up");
    group.sample_size(10);
    let (block, x, mut f) = lattice(18);
    let material = Material::neo_hookean(1e4, 0.4);
    group.bench_function("new", |b| {
        b.iter(|| elastic(&block, material, &Settings::default()));
    });
    let mut body = elastic(&block, material, &Settings::default());
    let touched: Vec<u32> = (0..100).collect();
    group.bench_function("update 100 rows", |b| {
        b.iter(|| body.update_rows(&touched, &stencils(&block)));
    });
    body.forces_into(&x, &mut f);
    group.bench_function("update 100 rows and evaluate what follows", |b| {
        b.iter(|| {
            body.update_rows(&touched, &stencils(&block))
                .expect("valid rows");
            body.forces_again(&x, &mut f)
        });
    });
    group.finish();
}

/// What scenes do besides forces and products, and forces of a body of which a half is held.
fn beside(c: &mut Criterion) {
    let one = testkit::pool(1);
    let mut group = c.benchmark_group("beside");
    group.sample_size(10);
    for side in SIDES {
        let (block, mut x, mut f) = lattice(side);
        let n = x.len();
        let material = Material::neo_hookean(1e4, 0.4);
        let mut body = elastic(&block, material, &Settings::default());
        let masses: Vec<f64> = block.volumes.iter().map(|v| 1e3 * v).collect();
        body.watch_stiffness(&masses);
        let middle = 0.05 * f64::from(u32::try_from(side).expect("small"));
        let is_held = |x: &DVec3| x.z < middle;
        for (x, rest) in x.iter_mut().zip(&block.positions) {
            if is_held(rest) {
                *x = *rest;
            }
        }
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::new("forces, watched", n), |b| {
            one.install(|| b.iter(|| body.forces_into(&x, &mut f)));
        });
        group.bench_function(BenchmarkId::new("gradients", n), |b| {
            one.install(|| b.iter(|| body.deformation_gradients()));
        });
        group.bench_function(BenchmarkId::new("stiffest nodes", n), |b| {
            one.install(|| b.iter(|| body.stiffest_nodes(8)));
        });
        let nodes = (0_u32..).zip(&block.positions);
        let held = nodes.filter(|(_, x)| is_held(x)).map(|(at, _)| at);
        body.set_held(&held.collect::<Vec<u32>>());
        group.bench_function(BenchmarkId::new("forces, watched, half held", n), |b| {
            one.install(|| b.iter(|| body.forces_into(&x, &mut f)));
        });
    }
    group.finish();
}

/// The passes of an evaluation alone, and those of a product with the stiffness.
fn passes(c: &mut Criterion) {
    let one = testkit::pool(1);
    let mut group = c.benchmark_group("passes");
    group.sample_size(10);
    for side in SIDES {
        let (block, x, mut f) = lattice(side);
        let n = x.len();
        let settings = Settings::default();
        let mut body = elastic(&block, Material::neo_hookean(1e4, 0.4), &settings);
        group.throughput(pairs(&body));
        group.bench_function(BenchmarkId::new("one, f64", n), |b| {
            one.install(|| b.iter(|| body.pass_one(&x, &mut f)));
        });
        group.bench_function(BenchmarkId::new("two, f64", n), |b| {
            one.install(|| b.iter(|| body.pass_two(&mut f)));
        });
        body.forces_into(&x, &mut f);
        group.bench_function(BenchmarkId::new("product, f64", n), |b| {
            one.install(|| b.iter(|| body.tangent_product_into(&x, &mut f)));
        });
    }
    group.finish();
}

criterion_group!(benches, sizes, laws, setup, beside, passes);
criterion_main!(benches);
