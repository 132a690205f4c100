//! Error of a cantilever against time: materials, neighbour rules and stabilizations of `phyxel-elastic`, with the
//! dissertation's model and linear tetrahedra beside them.
//!
//! The time is that of a solution: one period of the beam's first bending mode in explicit steps of 0.9 of the
//! critical one. One thread; least of many evaluations.

use std::path::Path;
use std::time::Instant;

use crate::StudyError;
use crate::problems::block::Block;
use crate::problems::cantilever as beam;
use crate::problems::model::{Law, dissertation};
use crate::report::{Series, add_point, plots};
use glam::DVec3;
use phyxel_elastic::{Dilatation, Material, Settings};
use phyxel_integrate::ForceLaw;
use phyxel_mls::{NearestSettings, k_nearest, within_radius};
use testkit::cloud::Random;

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
    solution: f64,
}

/// Tip error (%), ms for a period.
fn measure(block: &Block, masses: &[f64], law: &mut dyn ForceLaw) -> Outcome {
    let n = masses.len();
    let error = beam::tip_error(block, NU, 1e-4, law);
    // Largest eigenvalue of the fixed beam by power iteration at rest, 5 % added.
    let mut random = Random::new(1);
    let mut f = vec![DVec3::ZERO; n];
    law.forces_into(&block.rest, &mut f);
    let mut v: Vec<DVec3> = (0..n).map(|_| random.vector(1.0)).collect();
    let mut kv = v.clone();
    let mut eigenvalue = 0.0;
    for _ in 0..80 {
        let size = v.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
        for (v, x) in v.iter_mut().zip(&block.rest) {
            *v = if x.x > 1e-9 { *v / size } else { DVec3::ZERO };
        }
        law.tangent_product_into(&v, &mut kv);
        for ((v, kv), mass) in v.iter_mut().zip(&kv).zip(masses) {
            *v = *kv / *mass;
        }
        eigenvalue = v.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
    }
    let critical = 2.0 / (1.05 * eigenvalue).sqrt();
    let bent: Vec<DVec3> = block
        .rest
        .iter()
        .map(|x| *x * 1.01 + random.vector(1e-3))
        .collect();
    let mut best = f64::INFINITY;
    for _ in 0..200 {
        let start = Instant::now();
        law.forces_into(&bent, &mut f);
        best = best.min(start.elapsed().as_secs_f64());
    }
    let steps = period() / (0.9 * critical);
    Outcome {
        error,
        solution: 1e3 * best * steps,
    }
}

/// A block under each neighbour rule.
fn rules(block: &Block) -> Result<Vec<(&'static str, Block)>, StudyError> {
    let nearest = NearestSettings::default();
    let near = k_nearest(&block.rest, &nearest)?.neighborhoods;
    let radius = within_radius(&block.rest, 1.6 * 0.05)?;
    Ok(vec![
        ("edges", block.clone()),
        ("16 nearest", block.on_graph(near.symmetrized()?)?),
        ("radius 1.6", block.on_graph(radius)?),
    ])
}

pub(super) fn draw(folder: &Path) -> Result<(), StudyError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    pool.install(|| study(folder))
}

fn study(folder: &Path) -> Result<(), StudyError> {
    let mut groups = Vec::new();
    let mut note = |group: String, outcome: &Outcome| {
        add_point(&mut groups, &group, (outcome.solution, outcome.error.abs()));
    };
    let mut default_error = f64::INFINITY;
    let mut paper_error = 0.0;
    for jitter in [0.0, 0.25] {
        let block = beam::beam([20, 4, 4], jitter);
        for (rule, block) in &rules(&block)? {
            for (name, material) in [
                ("neo-Hookean", Material::neo_hookean(1.0, NU)),
                (
                    "Saint Venant-Kirchhoff",
                    Material::saint_venant_kirchhoff(1.0, NU),
                ),
                ("Mooney-Rivlin", Material::mooney_rivlin(1.0, NU, 0.3)),
            ] {
                for (label, stabilization, dilatation) in [
                    ("none", 0.0, Dilatation::Local),
                    ("control", 0.1, Dilatation::Local),
                    ("control + mean", 0.1, Dilatation::Mean),
                ] {
                    if dilatation == Dilatation::Mean && name.starts_with("Saint") {
                        continue; // has no volumetric part to average
                    }
                    let settings = Settings {
                        stabilization,
                        dilatation,
                    };
                    let mut body = beam::body(block, material, &settings);
                    let outcome = measure(block, &block.volumes, &mut Law(&mut body));
                    if *rule == "edges" && label == "control" {
                        default_error = default_error.min(outcome.error.abs());
                    }
                    note(format!("{rule}, {label}"), &outcome);
                }
            }
        }
        let svk = Material::saint_venant_kirchhoff(1.0, NU);
        let (mut paper, _) = dissertation(&block.rest, svk, 1.0)?;
        let masses = paper.volumes().to_vec();
        let outcome = measure(&block, &masses, &mut Law(&mut paper));
        paper_error = f64::max(paper_error, outcome.error.abs());
        note("dissertation".into(), &outcome);
        let mut tetrahedra = beam::Tetrahedra::new(
            &block.rest,
            &block.tetrahedra,
            Material::neo_hookean(1.0, NU),
        );
        let outcome = measure(&block, &block.volumes, &mut tetrahedra);
        note("linear tetrahedra".into(), &outcome);
    }
    assert!(
        default_error < 3.0 && paper_error > 50.0,
        "default {default_error} %, dissertation {paper_error} %"
    );
    let lines = groups.into_iter().map(|line| Series { dots: true, ..line });
    let plots = plots![
        "elastic_error_solution" "Tip of a cantilever, 525 nodes, nu 0.3, one thread",
            log "one period of bending, explicit (ms)", log "|error| of the tip (%)" => lines.collect();
    ];
    plots[0].write(folder)
}
