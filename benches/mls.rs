//! Criterion benches of `phyxel-mls`: search, weights, stencils, shape functions, partial update and
//! inverse map, each at 1e3, 1e4 and 1e5 nodes, on one thread and on all where it runs in parallel.
#![allow(missing_docs, reason = "criterion emits undocumented functions")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{DMat3, DVec3};
use phyxel_mls::{
    Approximation, Basis, ConservativeSettings, Dimension, GradientStencils, KNearest, MaterialMap,
    NearestSettings, Neighborhoods, Order, ShapeScratch, inverse_square_weights, k_nearest,
    kernel_weights, mean_neighbor_distance, within_radius,
};
use testkit::cloud::Random;
use testkit::kuhn::{Block, kuhn_block};

const CELLS: [(usize, u64); 3] = [(9, 1_000), (20, 9_261), (45, 97_336)];

/// A jittered block with the edges of its tetrahedra as graph.
fn body(cells: usize) -> (Block, Neighborhoods) {
    let block = kuhn_block([cells; 3], 1.0, 0.2, 1);
    let graph = Neighborhoods::from_graph(block.offsets.clone(), block.indices.clone())
        .expect("edges are a graph");
    (block, graph)
}

fn nearest(points: &[DVec3]) -> KNearest {
    k_nearest(points, &NearestSettings::default()).expect("finite points")
}

fn conservative(
    block: &Block,
    graph: &Neighborhoods,
    weights: Vec<f64>,
    settings: &ConservativeSettings,
) -> GradientStencils {
    let (x, volumes) = (black_box(&block.positions), &block.volumes);
    let surface = &block.boundary_vectors;
    GradientStencils::conservative(x, volumes, surface, graph, weights, settings)
        .expect("finite data")
}

fn search(c: &mut Criterion) {
    let mut group = c.benchmark_group("mls/search");
    let one = testkit::pool(1);
    for (cells, nodes) in CELLS {
        let (block, _) = body(cells);
        group
            .throughput(Throughput::Elements(nodes))
            .sample_size(10);
        group.bench_function(BenchmarkId::new("16 nearest, all threads", nodes), |b| {
            b.iter(|| nearest(black_box(&block.positions)));
        });
        group.bench_function(BenchmarkId::new("16 nearest, one thread", nodes), |b| {
            b.iter(|| one.install(|| nearest(black_box(&block.positions))));
        });
        group.bench_function(BenchmarkId::new("radius 1.6, all threads", nodes), |b| {
            b.iter(|| within_radius(black_box(&block.positions), 1.6));
        });
    }
}

fn weights(c: &mut Criterion) {
    let mut group = c.benchmark_group("mls/weights");
    for (cells, nodes) in CELLS {
        let (block, graph) = body(cells);
        let found = nearest(&block.positions);
        group
            .throughput(Throughput::Elements(nodes))
            .sample_size(20);
        group.bench_function(BenchmarkId::new("polynomial", nodes), |b| {
            let (radii, near) = (&found.support_radii, &found.neighborhoods);
            b.iter(|| kernel_weights(black_box(&block.positions), radii, near));
        });
        group.bench_function(BenchmarkId::new("1/r2 on edges", nodes), |b| {
            b.iter(|| inverse_square_weights(black_box(&block.positions), &graph));
        });
    }
}

fn stencils(c: &mut Criterion) {
    let mut group = c.benchmark_group("mls/stencils");
    let one = testkit::pool(1);
    for (cells, nodes) in CELLS {
        let (block, graph) = body(cells);
        let weights = inverse_square_weights(&block.positions, &graph);
        group
            .throughput(Throughput::Elements(nodes))
            .sample_size(10);
        let plain =
            || GradientStencils::plain(black_box(&block.positions), &graph, weights.clone(), 1e-3);
        group.bench_function(BenchmarkId::new("plain, all threads", nodes), |b| {
            b.iter(plain);
        });
        group.bench_function(BenchmarkId::new("plain, one thread", nodes), |b| {
            b.iter(|| one.install(plain));
        });
        let settings = ConservativeSettings::default();
        group.bench_function(BenchmarkId::new("conservative, all threads", nodes), |b| {
            b.iter(|| conservative(&block, &graph, weights.clone(), &settings));
        });
    }
}

fn shape_functions(c: &mut Criterion) {
    let mut group = c.benchmark_group("mls/shape_functions");
    for (cells, nodes) in CELLS {
        let (block, _) = body(cells);
        let found = nearest(&block.positions);
        let radii = vec![1.9; block.positions.len()];
        group
            .throughput(Throughput::Elements(nodes))
            .sample_size(10);
        for order in [Order::Constant, Order::Linear, Order::Quadratic] {
            let approximation = Approximation {
                nodes: &block.positions,
                support_radii: &radii,
                basis: Basis::polynomial(order, Dimension::Three),
            };
            let mut scratch = ShapeScratch::default();
            let mut phi = [0.0; 16];
            let mut gradient = [DVec3::ZERO; 16];
            group.bench_function(
                BenchmarkId::new(format!("{order:?}, 16 nodes"), nodes),
                |b| {
                    b.iter(|| {
                        let mut served = 0;
                        for (i, &x) in block.positions.iter().enumerate() {
                            let row = found.neighborhoods.row(i);
                            let k = row.len();
                            // Few rows of random nodes are singular for quadratics: both outcomes count.
                            let made = approximation.shape_functions_into(
                                black_box(x),
                                row,
                                &mut scratch,
                                &mut phi[..k],
                                &mut gradient[..k],
                            );
                            served += usize::from(made.is_ok());
                        }
                        served
                    });
                },
            );
        }
    }
}

fn partial_update(c: &mut Criterion) {
    let mut group = c.benchmark_group("mls/partial_update");
    for (cells, nodes) in CELLS {
        let (block, graph) = body(cells);
        let weights = inverse_square_weights(&block.positions, &graph);
        let settings = ConservativeSettings {
            tolerance: 1e-3,
            ..Default::default()
        };
        let mut stencils = conservative(&block, &graph, weights, &settings);
        let factors = vec![0.5; graph.pair_count()];
        group.sample_size(20);
        // The same number of touched rows on every size: the time must not depend on the body's.
        for touched in [50_u32, 500] {
            let rows: Vec<u32> = (0..touched).collect();
            group.throughput(Throughput::Elements(u64::from(touched)));
            group.bench_function(BenchmarkId::new(format!("{touched} rows"), nodes), |b| {
                b.iter(|| {
                    stencils.update_rows(
                        &block.positions,
                        &graph,
                        |pair| black_box(&factors)[pair],
                        &rows,
                    )
                });
            });
        }
    }
}

fn inverse_map(c: &mut Criterion) {
    let mut group = c.benchmark_group("mls/inverse_map");
    for (cells, nodes) in CELLS {
        let (block, graph) = body(cells);
        let mean = mean_neighbor_distance(&block.positions, &graph);
        let radii: Vec<f64> = mean.iter().map(|r| 1.7 * r).collect();
        let map = MaterialMap::new(&block.positions, &radii, &graph).expect("finite positions");
        let twist = |x: DVec3| DMat3::from_rotation_z(0.05 * x.z) * x;
        let moved: Vec<DVec3> = block.positions.iter().map(|&x| twist(x)).collect();
        let gradient = |x: DVec3| {
            let turn = DMat3::from_rotation_z(0.05 * x.z);
            let slope = DVec3::Z.cross(turn * x) * 0.05;
            DMat3::from_cols(turn.x_axis, turn.y_axis, turn.z_axis + slope)
        };
        let gradients: Vec<DMat3> = block.positions.iter().map(|&x| gradient(x)).collect();
        group.sample_size(10);
        group.throughput(Throughput::Elements(nodes));
        group.bench_function(BenchmarkId::new("frame", nodes), |b| {
            b.iter(|| map.frame(black_box(&moved), &gradients));
        });
        let frame = map.frame(&moved, &gradients).expect("finite motion");
        let mut random = Random::new(3);
        let asked: Vec<DVec3> = (0..200)
            .map(|_| twist(DVec3::splat(0.5) * 9.0 + random.vector(4.0)))
            .collect();
        group.throughput(Throughput::Elements(200));
        group.bench_function(BenchmarkId::new("200 points", nodes), |b| {
            b.iter(|| {
                asked
                    .iter()
                    .filter_map(|&x| frame.preimage(x, 0.1, &|_, _| true))
                    .map(|found| found.position)
                    .sum::<DVec3>()
            });
        });
    }
}

criterion_group!(
    benches,
    search,
    weights,
    stencils,
    shape_functions,
    partial_update,
    inverse_map
);
criterion_main!(benches);
