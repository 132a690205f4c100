//! Time of one update by two new triangles, for bodies and cuts of growing size, and the grid's beside it.
//!
//! `cargo run --release -p phyxel-enrich --example update_speed`; with `sight` only the time of crossing
//! tests; with `once SIDE LENGTH` one update only, for
//! counting instructions: `valgrind --tool=none` or `--tool=callgrind --toggle-collect='*update*'`.
#![allow(
    clippy::print_stdout,
    clippy::cast_precision_loss,
    reason = "prints a table; counts are small"
)]

use std::time::Instant;

use glam::DVec3;
use phyxel_enrich::{
    CutSettings, Cuts, EnrichmentGrid, FactorSettings, Graph, GridForm, GridSettings, PairFactors,
    Rule, grid_pair_factors,
};
use testkit::cloud;

/// A block of nodes on a jittered lattice of spacing 1 with up to 18 neighbours each.
fn block(size: [usize; 3]) -> (Vec<DVec3>, Vec<u32>, Vec<u32>) {
    let x = cloud::lattice(size, 1.0, 0.1, 3);
    let (offsets, indices) = cloud::lattice_rows(size);
    (x, offsets, indices)
}

/// Whether a place lies in the body.
type Inside<'a> = &'a (dyn Fn(DVec3) -> bool + Sync);

/// The blade's place after `k` captures, a spacing apart.
type Path = fn(usize, [usize; 3]) -> [DVec3; 2];

/// Straight along a bar, at half its height.
fn straight(k: usize, size: [usize; 3]) -> [DVec3; 2] {
    let (x, y) = (k as f64 + 3.4, 0.5 * size[1] as f64 - 0.3);
    let z = 0.5 * size[2] as f64 - 1.3;
    [DVec3::new(x, y, z), DVec3::new(x, y, z + 1.5)]
}

/// Straight in steps of a fiftieth of a spacing, with a blade of eight spacings.
fn tiny(k: usize, [side, ..]: [usize; 3]) -> [DVec3; 2] {
    let middle = 0.5 * side as f64;
    let (x, y) = (middle - 5.0 + 0.02 * k as f64, middle + 0.3);
    [
        DVec3::new(x, y, middle - 4.0),
        DVec3::new(x, y, middle + 4.0),
    ]
}

/// Up and down a folded path that fills a cube.
fn folded(k: usize, [side, ..]: [usize; 3]) -> [DVec3; 2] {
    let side = side as f64;
    let lanes = side - 3.0;
    let along = k as f64 % lanes;
    let lane = (k as f64 / lanes).floor();
    let rows = ((side - 3.0) / 2.6).floor();
    let x = if lane % 2.0 < 0.5 {
        along
    } else {
        lanes - along
    };
    let y = 1.3 + 2.6 * (lane % rows);
    let z = 1.2 + 2.0 * (lane / rows).floor();
    [DVec3::new(x + 0.4, y, z), DVec3::new(x + 0.4, y, z + 1.5)]
}

/// Paths and the bodies they go through, of about 1,000, 6,000 and 100,000 nodes.
const PATHS: [(&str, Path, [[usize; 3]; 3]); 3] = [
    ("tiny", tiny, [[10; 3], [18; 3], [46; 3]]),
    (
        "straight",
        straight,
        [[560, 2, 1], [560, 3, 4], [560, 13, 14]],
    ),
    ("folded", folded, [[10; 3], [18; 3], [46; 3]]),
];
/// Updates that are timed.
const COUNT: usize = 40;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    if arguments.get(1).is_some_and(|a| a == "once") {
        let number = |k: usize| arguments.get(k).and_then(|a| a.parse().ok()).unwrap_or(10);
        let (side, length) = (number(2), number(3));
        let touched = updates([side; 3], folded, length, 1)?.touched;
        println!("{side}³ nodes, {length} captures, {touched} pairs touched by the last");
        return Ok(());
    }
    if arguments.get(1).is_some_and(|a| a == "sight") {
        return sight();
    }
    println!(
        "path      nodes   triangles before   update of 2 triangles, median (quartiles)   pairs touched   bytes: body, cut"
    );
    for (name, path, sizes) in PATHS {
        for size in sizes {
            for length in [5, 50, 500] {
                if name == "folded" && size[0] == 10 && length == 500 {
                    continue; // the path is shorter there
                }
                let mut run = updates(size, path, length, COUNT)?;
                run.times.sort_by(f64::total_cmp);
                let at = |share: usize| 1e3 * run.times[COUNT * share / 4];
                println!(
                    "{name:8} {:6}   {:16}   {:8.4} ms ({:.4} to {:.4})   {:20}   {}, {}",
                    size.iter().product::<usize>(),
                    2 * length,
                    at(2),
                    at(1),
                    at(3),
                    run.touched / COUNT,
                    run.bytes[0],
                    run.bytes[1],
                );
            }
        }
    }
    sight()?;
    let (x, offsets, indices) = block([18; 3]);
    let graph = Graph::new(&x, &offsets, &indices)?;
    println!("the dissertation's grid, 5,832 nodes, a straight strip, built anew for each update:");
    for length in [5, 16] {
        let blades: Vec<[DVec3; 2]> = (0..=length)
            .map(|k| [6.3, 9.8].map(|z| DVec3::new(k as f64 + 0.4, 8.3, z)))
            .collect();
        for fine in [1.0, 0.5, 0.25] {
            let settings = GridSettings {
                spacing: fine,
                inflate: 3.0,
                most_points: 1 << 26,
            };
            let start = Instant::now();
            let Ok(grid) = EnrichmentGrid::from_blades(&blades, &settings) else {
                continue;
            };
            let built = start.elapsed();
            let reach = vec![2.5; x.len()];
            let factors = grid_pair_factors(
                std::slice::from_ref(&grid),
                &graph,
                &reach,
                GridForm::OneSidedMean,
            );
            println!(
                "{length} pieces, spacing {fine}: {:8.3} ms for {} points ({} kB), {:.3} ms with factors, lowest {:.2}",
                1e3 * built.as_secs_f64(),
                grid.values().len(),
                grid.bytes() / 1024,
                1e3 * start.elapsed().as_secs_f64(),
                factors.iter().copied().fold(1.0, f64::min),
            );
        }
    }
    Ok(())
}

/// Time of one crossing test where a skin asks for it: from points near the newest piece of a cut to
/// the nodes within 2.5 spacings of them, most of which are on the same side.
fn sight() -> Result<(), Box<dyn std::error::Error>> {
    println!("segments from 2,000 points near a wavy cut to the nodes round them:");
    for captures in [5, 50, 500] {
        let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
        let place = |k: f64, z: f64| {
            let turn = 0.02 * k;
            let radius = 30.0 + 0.5 * (0.4 * k).sin();
            DVec3::new(radius * turn.cos(), radius * turn.sin(), 0.6 * z + 0.01 * k)
        };
        let edge =
            |k: usize| -> Vec<DVec3> { (0..=20).map(|z| place(k as f64, f64::from(z))).collect() };
        let stroke = cuts.start(&edge(0))?;
        for k in 1..=captures {
            cuts.append(stroke, &edge(k))?;
        }
        let mut segments = Vec::new();
        for shift in cloud::uniform(2_000, 1.0, 5) {
            let at = place(captures as f64 - 2.0 + 2.0 * shift.x, 10.0 + 9.0 * shift.y);
            let eye = at * (1.0 + 0.05 * shift.z);
            let base = eye.floor();
            for k in 0..125 {
                let [i, j, l] = [k % 5, k / 5 % 5, k / 25].map(|c| f64::from(c) - 1.7);
                let node = base + DVec3::new(i, j, l);
                if node.distance(eye) < 2.5 {
                    segments.push((eye, node));
                }
            }
        }
        let start = Instant::now();
        let crossing = segments
            .iter()
            .filter(|(a, b)| cuts.crosses(*a, *b))
            .count();
        println!(
            "{:7} triangles: {:6.1} ns per segment, {crossing} of {} cross",
            cuts.triangle_count(),
            1e9 * start.elapsed().as_secs_f64() / segments.len() as f64,
            segments.len()
        );
    }
    Ok(())
}

/// Compares what small updates have left with every pair asked on its own, and with one update by the
/// whole cut.
fn check(graph: &Graph<'_>, cuts: &Cuts, factors: &PairFactors, inside: Inside<'_>) {
    let mut whole = PairFactors::new(graph, &FactorSettings::default());
    whole.update(graph, cuts, 0..cuts.triangle_count(), inside);
    let mut blind = PairFactors::new(
        graph,
        &FactorSettings {
            rule: Rule::Visibility,
            ..FactorSettings::default()
        },
    );
    blind.update(graph, cuts, 0..cuts.triangle_count(), inside);
    let mut crossed = 0;
    for (i, &x) in graph.positions().iter().enumerate() {
        let row = graph.offsets()[i] as usize..graph.offsets()[i + 1] as usize;
        for pair in row {
            let other = graph.positions()[graph.indices()[pair] as usize];
            let apart = cuts.crosses(x, other);
            crossed += usize::from(apart);
            let (many, once) = (factors.factor(pair), whole.factor(pair));
            let hidden = if apart { 0.0_f64 } else { 1.0 };
            assert_eq!(
                blind.factor(pair).to_bits(),
                hidden.to_bits(),
                "what a cut crosses it hides"
            );
            assert_eq!(many.to_bits(), once.to_bits(), "one update or many");
            assert!(apart || many >= 1.0, "only crossed pairs are weakened");
        }
    }
    assert!(crossed > 0, "the cut crosses pairs");
}

struct Run {
    /// Times (s) of the last updates, each with the append before it.
    times: Vec<f64>,
    /// Pairs that these touched, together.
    touched: usize,
    /// Bytes of the factors and of the cut at the end.
    bytes: [usize; 2],
}

/// `count` updates after `length` captures.
fn updates(
    size: [usize; 3],
    path: Path,
    length: usize,
    count: usize,
) -> Result<Run, Box<dyn std::error::Error>> {
    let (x, offsets, indices) = block(size);
    let top = DVec3::from(size.map(|n| n as f64 - 0.5));
    let inside = |p: DVec3| p.cmpge(DVec3::splat(-0.5)).all() && p.cmple(top).all();
    let graph = Graph::new(&x, &offsets, &indices)?;
    let mut factors = PairFactors::new(&graph, &FactorSettings::default());
    let mut cuts = Cuts::new(&CutSettings {
        weld_tolerance: 1e-6,
        ..CutSettings::for_spacing(1.0)
    });
    let stroke = cuts.start(&path(0, size))?;
    let (mut times, mut touched) = (Vec::new(), 0);
    for k in 1..=length + count {
        let start = Instant::now();
        let new = cuts.append(stroke, &path(k, size))?;
        let found = factors.update(&graph, &cuts, new, &inside);
        if k > length {
            times.push(start.elapsed().as_secs_f64());
            touched += found.pairs.len();
        }
    }
    check(&graph, &cuts, &factors, &inside);
    Ok(Run {
        times,
        touched,
        bytes: [factors.bytes(), cuts.bytes()],
    })
}
