//! Reads, repairs and samples meshes, and prints one table row per mesh and spacing.
//!
//! `cargo run --release -p phyxel-discretize --example quality -- [--nodes N,N...] [--sweeps N]
//! [--coarsest C] FILE...`; for a file of tetrahedra the row of the tetrahedra as they come is printed
//! first. The word `liver` stands for the built-in shape. `step` is the stable explicit step times the
//! wave speed over the mean edge, as the smallest nodal value gives it.
#![allow(clippy::print_stdout, reason = "an example prints")]

use std::path::Path;
use std::time::Instant;

use phyxel_discretize::{
    Primitive, ReadError, RepairSettings, SampleSettings, SampleTarget, Solid, TetrahedraQuality,
    read_mesh, repair, sample_tetrahedra, tetrahedra_quality, tetrahedron_volume,
};

fn row(name: &str, nodes: usize, tets: usize, q: &TetrahedraQuality, error: f64, seconds: f64) {
    println!(
        "| {name} | {nodes} | {tets} | {:.1} | {:.1} | {:.2} | {:.3} | {:.2} | {:+.2} % | {:.0} ms |",
        q.smallest_dihedral,
        q.largest_dihedral,
        q.shortest_edge / q.mean_edge,
        q.smallest_volume,
        3.0 * q.smallest_step / q.mean_edge,
        100.0 * error,
        1e3 * seconds,
    );
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "| mesh | nodes | tets | min dihedral | max dihedral | shortest/mean edge | min/mean nodal volume | step | volume error | time |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
    let mut counts = vec![1000, 6000, 30_000];
    let mut settings = SampleSettings::default();
    let mut arguments = std::env::args().skip(1);
    while let Some(word) = arguments.next() {
        let mut value = || arguments.next().ok_or("a value after the option");
        match word.as_str() {
            "--nodes" => {
                let list = value()?;
                counts = list.split(',').map(str::parse).collect::<Result<_, _>>()?;
            }
            "--sweeps" => settings.smoothing_sweeps = value()?.parse()?,
            "--coarsest" => settings.grading.coarsest = value()?.parse()?,
            "liver" => sample(&word, &Primitive::Liver.into(), &counts, &settings),
            file => mesh(Path::new(file), &counts, &settings)?,
        }
    }
    Ok(())
}

fn mesh(path: &Path, counts: &[usize], settings: &SampleSettings) -> Result<(), ReadError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let start = Instant::now();
    let read = read_mesh(path)?;
    let read_seconds = start.elapsed().as_secs_f64();
    if !read.tetrahedra.is_empty() {
        let (vertices, tetrahedra) = (&read.mesh.vertices, &read.tetrahedra);
        let q = tetrahedra_quality(vertices, tetrahedra);
        let label = format!("{name} (own tetrahedra)");
        let (nodes, tets) = (vertices.len(), tetrahedra.len());
        row(&label, nodes, tets, &q, 0.0, read_seconds);
        let corners = |t: &[u32; 4]| t.map(|v| vertices[v as usize]);
        let volumes = tetrahedra.iter().map(|t| tetrahedron_volume(corners(t)));
        let volume: f64 = volumes.sum();
        report(&format!("{name}: volume of its tetrahedra {volume:.8e}"));
    }
    let start = Instant::now();
    match repair(&read.mesh, &RepairSettings::default()) {
        Err(error) => println!("| {name} | refused: {error} |"),
        Ok((mesh, found)) => {
            let seconds = start.elapsed().as_secs_f64();
            report(&format!(
                "{name}: read {read_seconds:.3} s, inspected {seconds:.3} s\n{found}"
            ));
            sample(&name, &Solid::from_mesh(mesh), counts, settings);
        }
    }
    Ok(())
}

#[allow(
    clippy::print_stderr,
    reason = "the table goes to stdout, reports beside it"
)]
fn report(text: &str) {
    eprintln!("{text}\n");
}

fn sample(name: &str, solid: &Solid, counts: &[usize], settings: &SampleSettings) {
    for &count in counts {
        let settings = SampleSettings {
            target: SampleTarget::NodeCount(count),
            ..settings.clone()
        };
        let start = Instant::now();
        match sample_tetrahedra(solid, &settings) {
            Ok(s) => {
                let seconds = start.elapsed().as_secs_f64();
                let error = s.report.tetrahedra_error.unwrap_or(f64::NAN);
                let (nodes, tets) = (s.positions.len(), s.tetrahedra.len());
                row(name, nodes, tets, &s.report.quality, error, seconds);
                let sum: f64 = s.volumes.iter().sum();
                assert!(
                    (sum / s.report.volume - 1.0).abs() < 1e-9 && s.report.quality.inverted == 0,
                    "the nodes' volumes sum to {sum} of {} m³",
                    s.report.volume
                );
                report(&s.report.to_string());
            }
            Err(error) => println!("| {name} | {count}: {error} |"),
        }
    }
}
