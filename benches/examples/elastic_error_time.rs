//! Error of a cantilever against time: materials, neighbour rules, precisions and stabilisations of
//! `phyxel-elastic`, with the dissertation's own mode and linear tetrahedra beside them.
//!
//! `cargo run --release -p benches --example elastic_error_time -- target/studies/elastic`
//!
//! Prints a table and writes it as CSV, and two plots as SVG: error against milliseconds a step, and
//! against the time to a solution, which is one period of the beam's first bending mode in explicit
//! steps of 0.9 of the critical one. One thread; best of many evaluations.
#![allow(
    clippy::print_stdout,
    clippy::cast_precision_loss,
    reason = "prints its table; counts are far below 2^53"
)]

use std::time::Instant;

use benches::StudyError;
use benches::problems::cantilever as beam;
use benches::report::{Plot, Scale, Series, folder_of, write_csv};
use glam::DVec3;
use phyxel_elastic::{Dilatation, Material, Precision, Settings};
use phyxel_mls::{NearestSettings, Neighborhoods, k_nearest, within_radius};
use testkit::block::Block;
use testkit::cloud::Random;
use testkit::statics::Request;

const NU: f64 = 0.3;

/// First period of a slender beam with E = 1 and unit density: `2 pi / 1.8751² sqrt(rho A L⁴ / E I)`.
fn period() -> f64 {
    let (height, frequency_number) = (0.2_f64, 1.8751_f64);
    let slenderness = (12.0 / (height * height)).sqrt();
    std::f64::consts::TAU / frequency_number.powi(2) * slenderness
}

/// What one method needs and reaches.
struct Outcome {
    error: f64,
    step: f64,
    solution: f64,
}

/// Tip error (%), ms a step, ms for a period.
fn measure(block: &Block, masses: &[f64], answer: &mut dyn FnMut(Request<'_>) -> f64) -> Outcome {
    let n = masses.len();
    let error = beam::tip_error(block, NU, 1e-4, answer);
    // Largest eigenvalue of the held beam by power iteration at rest, 5 % added.
    let mut random = Random::new(1);
    let mut f = vec![DVec3::ZERO; n];
    answer(Request::Forces(&block.positions, &mut f));
    let mut v: Vec<DVec3> = (0..n).map(|_| random.vector(1.0)).collect();
    let mut kv = v.clone();
    let mut eigenvalue = 0.0;
    for _ in 0..80 {
        let size = v.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
        for (v, x) in v.iter_mut().zip(&block.positions) {
            *v = if x.x > 1e-9 { *v / size } else { DVec3::ZERO };
        }
        answer(Request::Product(&v, &mut kv));
        for ((v, kv), mass) in v.iter_mut().zip(&kv).zip(masses) {
            *v = *kv / *mass;
        }
        eigenvalue = v.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
    }
    let critical = 2.0 / (1.05 * eigenvalue).sqrt();
    let bent: Vec<DVec3> = block
        .positions
        .iter()
        .map(|x| *x * 1.01 + random.vector(1e-3))
        .collect();
    let mut best = f64::INFINITY;
    for _ in 0..200 {
        let start = Instant::now();
        answer(Request::Forces(&bent, &mut f));
        best = best.min(start.elapsed().as_secs_f64());
    }
    let steps = period() / (0.9 * critical);
    Outcome {
        error,
        step: 1e3 * best,
        solution: 1e3 * best * steps,
    }
}

/// Neighbour rules on a block.
fn rules(block: &Block) -> Vec<(&'static str, Neighborhoods)> {
    let nearest = NearestSettings::default();
    let near = k_nearest(&block.positions, &nearest).expect("a cloud");
    let near = near.neighborhoods.symmetrized().expect("few pairs");
    let radius = within_radius(&block.positions, 1.6 * 0.05).expect("a cloud");
    vec![
        ("edges", beam::edges(block)),
        ("16 nearest", near),
        ("radius 1.6", radius),
    ]
}

/// What one line of the plots shows.
struct Group {
    name: String,
    /// Milliseconds a step, error (%).
    steps: Vec<(f64, f64)>,
    /// Milliseconds a period, error (%).
    solutions: Vec<(f64, f64)>,
}

fn main() -> Result<(), StudyError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.expect("one thread").install(study)
}

fn study() -> Result<(), StudyError> {
    let mut rows: Vec<[String; 8]> = Vec::new();
    let mut groups: Vec<Group> = Vec::new();
    println!(
        "{:<9} {:<12} {:<24} {:<5} {:<16} {:>8} {:>9} {:>12}",
        "cloud", "rule", "material", "", "stabilisation", "error %", "ms/step", "ms/period"
    );
    let mut note = |names: [&str; 5], group: String, outcome: &Outcome| {
        let [cloud, rule, material, precision, stabilisation] = names;
        println!(
            "{cloud:<9} {rule:<12} {material:<24} {precision:<5} {stabilisation:<16} {:>+8.2} {:>9.4} {:>12.1}",
            outcome.error, outcome.step, outcome.solution
        );
        let numbers = [outcome.error, outcome.step, outcome.solution];
        let [a, b, c] = numbers.map(|number| number.to_string());
        let [cloud, rule, material, precision, stabilisation] = names.map(str::to_owned);
        rows.push([cloud, rule, material, precision, stabilisation, a, b, c]);
        let (a, b) = (
            (outcome.step, outcome.error.abs()),
            (outcome.solution, outcome.error.abs()),
        );
        match groups.iter_mut().find(|entry| entry.name == group) {
            Some(entry) => {
                entry.steps.push(a);
                entry.solutions.push(b);
            }
            None => groups.push(Group {
                name: group,
                steps: vec![a],
                solutions: vec![b],
            }),
        }
    };
    let mut default_error = f64::INFINITY;
    let mut paper_error = 0.0;
    for (cloud, jitter) in [("lattice", 0.0), ("jittered", 0.25)] {
        let block = beam::beam([20, 4, 4], jitter);
        for (rule, graph) in &rules(&block) {
            for (name, material) in [
                ("neo-Hookean", Material::neo_hookean(1.0, NU)),
                (
                    "Saint Venant-Kirchhoff",
                    Material::saint_venant_kirchhoff(1.0, NU),
                ),
                ("Mooney-Rivlin", Material::mooney_rivlin(1.0, NU, 0.3)),
            ] {
                for (storage, precision) in [("f64", Precision::Double), ("f32", Precision::Single)]
                {
                    for (stabilisation, zero_energy_control, dilatation) in [
                        ("none", 0.0, Dilatation::Local),
                        ("control", 0.1, Dilatation::Local),
                        ("control + mean", 0.1, Dilatation::Mean),
                    ] {
                        if dilatation == Dilatation::Mean && name.starts_with("Saint") {
                            continue; // has no volumetric part to average
                        }
                        let settings = Settings {
                            zero_energy_control,
                            precision,
                            dilatation,
                            ..Settings::default()
                        };
                        let mut body = beam::on_graph(&block, graph, material, &settings);
                        let outcome = measure(&block, &block.volumes, &mut beam::ask(&mut body));
                        let names = [cloud, rule, name, storage, stabilisation];
                        if *rule == "edges" && stabilisation == "control" {
                            default_error = default_error.min(outcome.error.abs());
                        }
                        note(names, format!("{rule}, {stabilisation}"), &outcome);
                    }
                }
            }
        }
        let svk = Material::saint_venant_kirchhoff(1.0, NU);
        let mut paper = beam::dissertation(&block, svk);
        let masses = paper.elastic_volumes().to_vec();
        let outcome = measure(&block, &masses, &mut beam::ask(&mut paper));
        paper_error = f64::max(paper_error, outcome.error.abs());
        let names = [cloud, "16 nearest", "Saint Venant-Kirchhoff", "f64", "none"];
        note(names, "dissertation".into(), &outcome);
        let mut tetrahedra = beam::Tetrahedra::new(
            &block.positions,
            &block.tetrahedra,
            Material::neo_hookean(1.0, NU),
        );
        let outcome = measure(&block, &block.volumes, &mut |request| {
            tetrahedra.answer(request)
        });
        let names = [cloud, "tetrahedra", "neo-Hookean", "f64", "none"];
        note(names, "linear tetrahedra".into(), &outcome);
    }
    assert!(
        default_error < 3.0 && paper_error > 50.0,
        "default {default_error} %, dissertation {paper_error} %"
    );
    let folder = folder_of("elastic")?;
    let header = [
        "cloud",
        "rule",
        "material",
        "storage",
        "stabilisation",
        "error_percent",
        "ms_per_step",
        "ms_per_period",
    ];
    write_csv(&folder.join("elastic_error_time.csv"), header, &rows)?;
    for (file, axis, second) in [
        ("elastic_error_step", "a force evaluation (ms)", false),
        (
            "elastic_error_solution",
            "one period of bending, explicit (ms)",
            true,
        ),
    ] {
        let lines: Vec<Series> = groups
            .iter()
            .map(|group| {
                let points = if second {
                    &group.solutions
                } else {
                    &group.steps
                };
                Series::dots(&group.name, points.clone())
            })
            .collect();
        Plot::new(
            file,
            "Tip of a cantilever, 525 nodes, nu 0.3, one thread",
            [axis, "|error| of the tip (%)"],
            [Scale::Logarithmic; 2],
            lines,
        )
        .write(&folder)?;
    }
    Ok(())
}
