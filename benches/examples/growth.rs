//! Time and memory against the number of nodes, from 1e3 to 1e6, as a table and a plot.
//!
//! `cargo run --release -p benches --example growth -- FOLDER [FILE]`; the built-in liver
//! where no mesh file is given. Each time is the best of three (of one from 300,000 nodes on), search
//! for the spacing included.
#![allow(
    clippy::print_stdout,
    clippy::cast_precision_loss,
    reason = "an example prints counts"
)]

use std::time::Instant;

use benches::report::{Plot, Scale, Series};
use phyxel_discretize::{
    Grading, Primitive, RepairSettings, SampleError, SampleSettings, SampleTarget, Solid,
    read_mesh, repair, sample_points, sample_tetrahedra,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments
        .next()
        .ok_or("name the folder to write growth.svg into")?;
    let solid = match arguments.next() {
        None => Solid::from(Primitive::Liver),
        Some(file) => {
            let mesh = read_mesh(file.as_ref())?.mesh;
            Solid::from_mesh(repair(&mesh, &RepairSettings::default())?.0)
        }
    };
    let octree = Grading {
        coarsest: 4.0,
        ..Grading::default()
    };
    let ways = [
        ("tetrahedra, one spacing", Grading::default(), false),
        ("tetrahedra on an octree", octree.clone(), false),
        ("points of an octree", octree, true),
    ];
    println!("| nodes | way | time (s) | peak memory so far (MB) |\n|---:|---|---:|---:|");
    let mut curves = Vec::new();
    for (name, grading, points) in ways {
        let mut points_of = Vec::new();
        for wanted in [1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000] {
            let settings = SampleSettings {
                target: SampleTarget::NodeCount(wanted),
                grading: grading.clone(),
                ..SampleSettings::default()
            };
            let run = || -> Result<usize, SampleError> {
                Ok(if points {
                    sample_points(&solid, &settings, true)?.positions.len()
                } else {
                    sample_tetrahedra(&solid, &settings)?.positions.len()
                })
            };
            let mut best = f64::INFINITY;
            let mut nodes = 0;
            for _ in 0..if wanted < 300_000 { 3 } else { 1 } {
                let start = Instant::now();
                nodes = run()?;
                best = best.min(start.elapsed().as_secs_f64());
            }
            println!("| {nodes} | {name} | {best:.3} | {} |", peak_memory());
            points_of.push((nodes as f64, best));
        }
        println!("slope of {name}: {:.2}\n", slope(&points_of));
        curves.push((name, points_of));
    }
    let steepest = curves.iter().map(|c| slope(&c.1)).fold(0.0, f64::max);
    let series = curves.into_iter().map(|(name, points)| {
        let name = format!("{name} (slope {:.2})", slope(&points));
        Series::line(name, points)
    });
    Plot::new(
        "growth",
        "Time against the number of nodes",
        ["nodes", "seconds"],
        [Scale::Logarithmic; 2],
        series.collect(),
    )
    .write(out.as_ref())?;
    assert!(steepest < 1.3, "time grows faster than the number of nodes");
    Ok(())
}

/// Least-squares slope of the logarithms.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let mean = |f: fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / n;
    let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
    let covariance: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    covariance / logs.iter().map(|(x, _)| (x - mx) * (x - mx)).sum::<f64>()
}

/// Largest resident memory of this process in megabytes, where the system tells.
fn peak_memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok());
    kilobytes.map_or_else(|| "?".to_owned(), |k| (k / 1024).to_string())
}
