//! Criterion benches of `phyxel-elastic`: `cargo bench -p benches --bench elastic`.
//!
//! Bodies are lattices along a Morton curve with 18 neighbours inside; throughput is counted in
//! directed pairs, so `ns/pair` compares across sizes.

use std::fmt::Display;
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{
    BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main,
};
use glam::DVec3;
use phyxel_elastic::{
    Dilatation, Elastic, Fiber, Material, Materials, Nodes, PronyTerm, Settings, Stencils,
};
use testkit::block::Block;
use testkit::cloud::Random;

/// Times a function under a name, at a size, on one thread.
fn time_on_one<T>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    size: impl Display,
    mut run: impl FnMut() -> T + Send,
) {
    let one = testkit::pool(1);
    group.bench_function(BenchmarkId::new(name, size), |b| {
        one.install(|| b.iter(&mut run));
    });
}

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

/// A lattice of so many nodes a side, positions stretched by 2 % and shaken, so that no product is zero by symmetry, and room
/// for forces.
fn lattice(side: usize) -> (Block, Vec<DVec3>, Vec<DVec3>) {
    let block = Block::eighteen([side; 3], 0.1);
    let mut random = Random::new(1);
    let deformed = block.positions.iter();
    let deformed = deformed.map(|x| *x * 1.02 + random.vector(0.002));
    let x: Vec<DVec3> = deformed.collect();
    let forces = vec![DVec3::ZERO; x.len()];
    (block, x, forces)
}

fn pairs(block: &Block) -> Throughput {
    Throughput::Elements(block.indices.len() as u64)
}

/// Nodes a side of the lattices: 1,000, 5,832, 97,336 and a million nodes.
const SIDES: [usize; 4] = [10, 18, 46, 100];

/// Every law and option, forces and tangent products, from 1e3 to 1e6 nodes on one thread.
fn laws(c: &mut Criterion) {
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
    for pass in ["forces", "tangent product"] {
        let mut group = c.benchmark_group(pass);
        // Ten evaluations of a million nodes take two seconds.
        group.sample_size(10);
        group.warm_up_time(Duration::from_millis(300));
        group.measurement_time(Duration::from_secs(1));
        for side in SIDES {
            let (block, x, mut f) = lattice(side);
            for (name, material, settings) in &cases {
                let mut body = elastic(&block, *material, settings);
                body.begin_viscous_step(1e-3);
                body.forces_into(&x, &mut f);
                group.throughput(pairs(&block));
                time_on_one(&mut group, name, x.len(), || match pass {
                    "forces" => body.forces_into(&x, &mut f),
                    _ => {
                        body.tangent_product_into(&x, &mut f);
                        0.0
                    }
                });
            }
        }
    }
}

criterion_group!(benches, laws);
criterion_main!(benches);
