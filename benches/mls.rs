//! Criterion benches of `phyxel-mls`: search, weights, stencils, shape functions, partial update and
//! inverse map, each at 1e3, 1e4 and 1e5 nodes, on one thread and on all where it runs in parallel.
#![allow(missing_docs, reason = "criterion emits undocumented functions")]

mod time;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DMat3, DVec3};
use phyxel_mls::{
    Approximation, Basis, ConservativeSettings, Dimension, GradientStencils, KNearest, MaterialMap,
    NearestSettings, Neighborhoods, Order, ShapeScratch, inverse_square_weights, k_nearest,
    kernel_weights, mean_neighbor_distance, within_radius,
};
use testkit::cloud::Random;
use testkit::kuhn::{Block, kuhn_block};
use time::{time, time_on_one};

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
    group.sample_size(10);
    for (cells, nodes) in CELLS {
        let x = body(cells).0.positions;
        group.throughput(Throughput::Elements(nodes));
        let find = || nearest(black_box(&x));
        time(&mut group, "16 nearest, all threads", nodes, find);
        time_on_one(&mut group, "16 nearest, one thread", nodes, find);
        let find = || within_radius(black_box(&x), 1.6);
        time(&mut group, "radius 1.6, all threads", nodes, find);
    }
}

fn weights(c: &mut Criterion) {
    let mut group = c.benchmark_group("mls/weights");
    group.sample_size(20);
    for (cells, nodes) in CELLS {
        let (block, graph) = body(cells);
        let x = &block.positions;
        let KNearest {
            support_radii,
            neighborhoods,
            ..
        } = nearest(x);
        group.throughput(Throughput::Elements(nodes));
        time(&mut group, "polynomial", nodes, || {
            kernel_weights(black_box(x), &support_radii, &neighborhoods)
        });
        let edges = || inverse_square_weights(black_box(x), &graph);
        time(&mut group, "1/r2 on edges", nodes, edges);
    }
}

fn stencils(c: &mut Criterion) {
    let mut group = c.benchmark_group("mls/stencils");
    group.sample_size(10);
    for (cells, nodes) in CELLS {
        let (block, graph) = body(cells);
        let weights = inverse_square_weights(&block.positions, &graph);
        group.throughput(Throughput::Elements(nodes));
        let plain =
            || GradientStencils::plain(black_box(&block.positions), &graph, weights.clone(), 1e-3);
        time(&mut group, "plain, all threads", nodes, plain);
        time_on_one(&mut group, "plain, one thread", nodes, plain);
        let settings = ConservativeSettings::default();
        time(&mut group, "conservative, all threads", nodes, || {
            conservative(&block, &graph, weights.clone(), &settings)
        });
    }
}

fn shape_functions(c: &mut Criterion) {
    let mut group = c.benchmark_group("mls/shape_functions");
    group.sample_size(10);
    for (cells, nodes) in CELLS {
        let x = body(cells).0.positions;
        let near = nearest(&x).neighborhoods;
        let radii = vec![1.9; x.len()];
        group.throughput(Throughput::Elements(nodes));
        for order in [Order::Constant, Order::Linear, Order::Quadratic] {
            let approximation = Approximation {
                nodes: &x,
                support_radii: &radii,
                basis: Basis::polynomial(order, Dimension::Three),
            };
            let mut scratch = ShapeScratch::default();
            let mut phi = [0.0; 16];
            let mut gradient = [DVec3::ZERO; 16];
            // Few rows of random nodes are singular for quadratics: both outcomes count.
            let mut served = |(i, &at): (usize, &DVec3)| {
                let row = near.row(i);
                let (phi, gradient) = (&mut phi[..row.len()], &mut gradient[..row.len()]);
                approximation
                    .shape_functions_into(black_box(at), row, &mut scratch, phi, gradient)
                    .is_ok()
            };
            time(&mut group, format!("{order:?}, 16 nodes"), nodes, || {
                x.iter().enumerate().filter(|&node| served(node)).count()
            });
        }
    }
}

fn partial_update(c: &mut Criterion) {
    let mut group = c.benchmark_group("mls/partial_update");
    group.sample_size(20);
    for (cells, nodes) in CELLS {
        let (block, graph) = body(cells);
        let weights = inverse_square_weights(&block.positions, &graph);
        let settings = ConservativeSettings {
            tolerance: 1e-3,
            ..Default::default()
        };
        let mut stencils = conservative(&block, &graph, weights, &settings);
        let factors = vec![0.5; graph.pair_count()];
        // The same number of touched rows on every size: the time must not depend on the body's.
        for touched in [50_u32, 500] {
            let rows: Vec<u32> = (0..touched).collect();
            group.throughput(Throughput::Elements(u64::from(touched)));
            time(&mut group, format!("{touched} rows"), nodes, || {
                let factor = |pair| black_box(&factors)[pair];
                stencils.update_rows(&block.positions, &graph, factor, &rows)
            });
        }
    }
}

fn inverse_map(c: &mut Criterion) {
    let mut group = c.benchmark_group("mls/inverse_map");
    group.sample_size(10);
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
        group.throughput(Throughput::Elements(nodes));
        let make = || map.frame(black_box(&moved), &gradients);
        time(&mut group, "frame", nodes, make);
        let frame = map.frame(&moved, &gradients).expect("finite motion");
        let mut random = Random::new(3);
        let mut asked = || twist(DVec3::splat(0.5) * 9.0 + random.vector(4.0));
        let asked: Vec<DVec3> = (0..200).map(|_| asked()).collect();
        group.throughput(Throughput::Elements(200));
        time(&mut group, "200 points", nodes, || {
            let found = |&x: &DVec3| frame.preimage(x, 0.1, &|_, _| true);
            let found = asked.iter().filter_map(found);
            found.map(|found| found.position).sum::<DVec3>()
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
