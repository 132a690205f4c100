//! Time of an evaluation of forces against the order of the nodes:
//! `cargo run --release -p benches --example node_order [-- cells a side...]`.
//!
//! Boxes of jittered tetrahedra with conservative stencils, on one thread and on all. The orders take turns, each
//! with an evaluation before the one that counts; *ratio* is the median of the turns' ratios to the Hilbert curve.
#![allow(clippy::print_stdout, reason = "prints a table")]
#![allow(clippy::cast_precision_loss, reason = "sizes of a benchmark are small")]
#![allow(clippy::unwrap_used, reason = "a study stops where a test would fail")]

use std::time::Instant;

use benches::problems::block::view;
use glam::DVec3;
use phyxel_discretize::{NodeOrder, layered_order, space_filling_order};
use phyxel_elastic::{Elastic, Material, Materials, Nodes, Precision, Settings};
use phyxel_mls::{ConservativeSettings, GradientStencils, Neighborhoods, inverse_square_weights};
use testkit::cloud::Random;
use testkit::kuhn::{Block, kuhn_block};

/// Cells a side: 5,832 and 68,921 nodes.
const SIDES: [usize; 2] = [17, 40];
/// Seconds that the orders take turns for.
const PATIENCE: f64 = 4.0;

/// A body with its nodes in one order, and its times (s).
struct Ordered {
    name: &'static str,
    body: Elastic,
    positions: Vec<DVec3>,
    forces: Vec<DVec3>,
    times: Vec<f64>,
}

fn main() {
    let given: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let sides = if given.is_empty() {
        SIDES.to_vec()
    } else {
        given
    };
    println!("| nodes | storage | threads | order | ns/node, least | ns/node, median | ratio |");
    println!("|---|---|---|---|---|---|---|");
    for side in sides {
        let block = kuhn_block([side; 3], 0.1, 0.2, 1);
        for precision in [Precision::Double, Precision::Single] {
            measure(&block, precision);
        }
    }
}

fn measure(block: &Block, precision: Precision) {
    let count = u32::try_from(block.positions.len()).unwrap();
    let planes = NodeOrder {
        old_of_new: (0..count).collect(),
        new_of_old: (0..count).collect(),
    };
    let orders = [
        ("Hilbert", space_filling_order(&block.positions)),
        ("layers", layered_order(&block.offsets, &block.indices)),
        ("planes", planes),
        ("none", shuffled(count)),
    ];
    let mut bodies = orders.map(|(name, order)| ordered(name, &order, block, precision));
    for threads in [1, rayon::current_num_threads()] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| take_turns(&mut bodies));
        for ordered in &bodies {
            let mut times = ordered.times.clone();
            let turns = bodies[0].times.iter().zip(&times);
            let mut ratios: Vec<f64> = turns.map(|(hilbert, time)| hilbert / time).collect();
            times.sort_unstable_by(f64::total_cmp);
            ratios.sort_unstable_by(f64::total_cmp);
            let per_node = 1e9 / f64::from(count);
            println!(
                "| {count} | {precision:?} | {threads} | {} | {:.1} | {:.1} | {:.2} |",
                ordered.name,
                times[0] * per_node,
                times[times.len() / 2] * per_node,
                ratios[ratios.len() / 2]
            );
        }
    }
}

fn take_turns(bodies: &mut [Ordered]) {
    for ordered in &mut *bodies {
        ordered.times.clear();
    }
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < PATIENCE || bodies[0].times.len() < 5 {
        for ordered in &mut *bodies {
            // The bodies before it have taken the caches.
            ordered
                .body
                .forces_into(&ordered.positions, &mut ordered.forces);
            let start = Instant::now();
            ordered
                .body
                .forces_into(&ordered.positions, &mut ordered.forces);
            ordered.times.push(start.elapsed().as_secs_f64());
        }
    }
}

fn shuffled(count: u32) -> NodeOrder {
    let mut random = Random::new(7);
    let mut keyed: Vec<(f64, u32)> = (0..count).map(|i| (random.range(0.0, 1.0), i)).collect();
    keyed.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let old_of_new: Vec<u32> = keyed.into_iter().map(|(_, i)| i).collect();
    let mut new_of_old = vec![0; old_of_new.len()];
    for (new, &old) in (0..).zip(&old_of_new) {
        new_of_old[old as usize] = new;
    }
    NodeOrder {
        old_of_new,
        new_of_old,
    }
}

fn ordered(name: &'static str, order: &NodeOrder, block: &Block, precision: Precision) -> Ordered {
    let rest = order.apply(&block.positions);
    let volumes = order.apply(&block.volumes);
    let boundary = order.apply(&block.boundary_vectors);
    let (mut offsets, mut indices) = (vec![0], Vec::new());
    for &old in &order.old_of_new {
        let old = old as usize;
        let row = &block.indices[block.offsets[old] as usize..block.offsets[old + 1] as usize];
        let mut row: Vec<u32> = row.iter().map(|&j| order.new_of_old[j as usize]).collect();
        row.sort_unstable();
        indices.extend(row);
        offsets.push(u32::try_from(indices.len()).unwrap());
    }
    let graph = Neighborhoods::from_graph(offsets, indices).unwrap();
    let weights = inverse_square_weights(&rest, &graph);
    let settings = ConservativeSettings::default();
    let rows =
        GradientStencils::conservative(&rest, &volumes, &boundary, &graph, weights, &settings);
    let rows = rows.unwrap();
    let stencils = view(&rows, &graph);
    let nodes = Nodes {
        rest_positions: &rest,
        volumes: &volumes,
    };
    let settings = Settings {
        precision,
        ..Settings::default()
    };
    let material = Materials::Uniform(Material::neo_hookean(1e4, 0.45));
    let mut random = Random::new(1);
    let shake = |x: &DVec3| *x * 1.02 + random.vector(0.002);
    Ordered {
        name,
        body: Elastic::new(&stencils, &nodes, &material, &settings).unwrap(),
        positions: rest.iter().map(shake).collect(),
        forces: vec![DVec3::ZERO; rest.len()],
        times: Vec::new(),
    }
}
