//! Set-up time and memory from 1,000 nodes on: our search, weights and stencils against the search of
//! rstar alone, on the same points, threads and run; and the conservative set-up on the edges of a
//! jittered block of about as many nodes, solve included.
//!
//! `cargo run --release -p benches --example setup_scaling` (add a folder and `1000000` for the
//! largest size)
#![allow(
    clippy::print_stdout,
    clippy::cast_precision_loss,
    reason = "prints its table; counts are far below 2^53"
)]

use std::hint::black_box;
use std::time::Instant;

use benches::StudyError;
use benches::problems::block::jittered_stencils;
use benches::report::{Plot, Scale, Series, folder_of, median, write_csv};
use glam::DVec3;
use phyxel_mls::{
    ConservativeSettings, GradientStencils, Kernel, NearestSettings, Neighborhoods, SolveReport,
    k_nearest, kernel_weights,
};
use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;
use testkit::cloud::uniform;
use testkit::kuhn::kuhn_block;

/// Points of the unit cube in the order of a space-filling (Morton) curve.
fn ordered(count: usize) -> Vec<DVec3> {
    let mut points = uniform(count, 0.5, 9);
    let key = |x: &DVec3| {
        let cell = ((*x + 0.5) * 1024.0).as_u64vec3();
        (0..10).fold(0_u64, |key, bit| {
            let part = |c: u64, axis: u64| ((c >> bit) & 1) << (3 * bit + axis);
            key | part(cell.x, 0) | part(cell.y, 1) | part(cell.z, 2)
        })
    };
    points.sort_by_key(key);
    points
}

/// Seconds of one call.
fn time<T>(run: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let value = run();
    (start.elapsed().as_secs_f64(), value)
}

/// What rstar takes by itself for the 16 nearest of every point: loading and queries.
fn rstar_alone(points: &[DVec3]) -> f64 {
    time(|| {
        let entries: Vec<GeomWithData<[f64; 3], u32>> = (0_u32..)
            .zip(points)
            .map(|(index, x)| GeomWithData::new(x.to_array(), index))
            .collect();
        let tree = RTree::bulk_load(entries);
        let found: Vec<u32> = points
            .par_iter()
            .with_min_len(256)
            .map(|x| {
                // 17: the point itself comes first.
                tree.nearest_neighbor_iter(x.to_array())
                    .take(17)
                    .map(|entry| entry.data)
                    .fold(0, u32::wrapping_add)
            })
            .collect();
        black_box(found)
    })
    .0
}

/// Seconds of weights and conservative stencils on a block of about `count` nodes.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "cells per side are few"
)]
fn conservative(count: usize) -> (f64, usize, SolveReport) {
    let cells = (count as f64).cbrt().round() as usize - 1;
    let block = kuhn_block([cells; 3], 1.0, 0.2, 1);
    let graph =
        Neighborhoods::from_graph(block.offsets.clone(), block.indices.clone()).expect("edges");
    let (seconds, stencils) = time(|| {
        jittered_stencils(&block, &graph, &ConservativeSettings::default()).expect("finite data")
    });
    (
        seconds,
        block.positions.len(),
        stencils.report.expect("conservative stencils"),
    )
}

fn main() -> Result<(), StudyError> {
    let largest = std::env::args()
        .nth(2)
        .map_or(100_000, |n| n.parse().expect("a number of nodes"));
    println!(
        "{:>8} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7} {:>11} | {:>8} {:>10} {:>10} {:>7}",
        "nodes",
        "rstar ms",
        "search",
        "weights",
        "stencils",
        "sum ms",
        "ratio",
        "bytes",
        "nodes",
        "conserv.",
        "iterations",
        "ratio"
    );
    let mut rows = Vec::new();
    let (mut ours, mut theirs, mut solved) = (Vec::new(), Vec::new(), Vec::new());
    for count in [1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000] {
        if count > largest {
            break;
        }
        let points = ordered(count);
        let repeats = if count > 100_000 { 1 } else { 5 };
        let mut times = vec![Vec::new(); 4];
        let mut memory = 0;
        for _ in 0..repeats {
            times[0].push(rstar_alone(&points));
            let (search, found) =
                time(|| k_nearest(&points, &NearestSettings::default()).expect("finite points"));
            let graph = &found.neighborhoods;
            let (weighing, weights) =
                time(|| kernel_weights(Kernel::Polynomial, &points, &found.support_radii, graph));
            let (building, stencils) = time(|| {
                GradientStencils::plain(&points, graph, weights, 1e-3).expect("finite points")
            });
            times[1].push(search);
            times[2].push(weighing);
            times[3].push(building);
            memory = stencils.bytes();
        }
        let parts: Vec<f64> = times.into_iter().map(|t| 1e3 * median(t)).collect();
        let sum = parts[1] + parts[2] + parts[3];
        let ratio = sum / parts[0];
        let (seconds, nodes, report) = conservative(count);
        let milliseconds = 1e3 * seconds;
        println!(
            "{count:>8} {:>9.2} {:>9.2} {:>9.2} {:>9.2} {sum:>9.2} {ratio:>7.2} {memory:>11} | {nodes:>8} \
             {milliseconds:>10.1} {:>10} {:>7.2}",
            parts[0],
            parts[1],
            parts[2],
            parts[3],
            report.iterations,
            milliseconds / parts[0]
        );
        assert!(report.converged, "{report:?}");
        solved.push((nodes as f64, milliseconds));
        rows.push([
            count.to_string(),
            parts[0].to_string(),
            sum.to_string(),
            milliseconds.to_string(),
        ]);
        theirs.push((count as f64, parts[0]));
        ours.push((count as f64, sum));
        if count == 100_000 {
            assert!(
                ratio < 2.0,
                "set-up of 100,000 nodes takes {ratio:.2} times rstar's search"
            );
        }
    }
    let folder = folder_of("mls")?;
    let header = ["nodes", "rstar_ms", "setup_ms", "conservative_ms"];
    write_csv(&folder.join("setup_scaling.csv"), header, &rows)?;
    let lines = vec![
        Series::line("rstar alone, 16 nearest", theirs),
        Series::line("search, weights, stencils", ours),
        Series::line("conservative, on given edges", solved),
    ];
    Plot::new(
        "setup_scaling",
        "Set-up time, two threads",
        ["nodes", "set-up (ms)"],
        [Scale::Logarithmic; 2],
        lines,
    )
    .write(&folder)
}
