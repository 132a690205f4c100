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
use crate::problems::model::{dissertation, law};
use crate::report::{Series, add_point, plots};
use glam::DVec3;
use phyxel_elastic::{Dilatation, Law, Material, Settings};
use phyxel_integrate::{BoundaryConditions, EigenvalueSettings, ForceLaw, largest_eigenvalue};
use phyxel_mls::{NearestSettings, k_nearest, within_radius};
use testkit::cloud::Random;

const NU: f64 = 0.3;

/// First period of a slender beam with E = 1 and unit density: `2 pi / 1.8751² sqrt(rho A L⁴ / E I)`.
fn period() -> f64 {
    let (height, frequency_number) = (0.2_f64, 1.8751_f64);
    let slenderness = (12.0 / (height * height)).sqrt();
    std::f64::consts::TAU / frequency_number.powi(2) * slenderness
}

/// Tip error (%), and time (ms) for a period.
fn measure(block: &Block, masses: &[f64], law: &mut dyn ForceLaw) -> Result<[f64; 2], StudyError> {
    let error = beam::tip_error(block, NU, 1e-4, law);
    let mut f = vec![DVec3::ZERO; masses.len()];
    law.forces_into(&block.rest, &mut f);
    let clamp = BoundaryConditions::fixed_where(&block.rest, |x| x.x <= 1e-9);
    let product = |v: &[DVec3], out: &mut [DVec3]| law.tangent_product_into(v, out);
    let settings = EigenvalueSettings::default();
    let found = largest_eigenvalue(masses, &clamp, product, &mut Vec::new(), &settings)?;
    let mut random = Random::new(1);
    let bent = block.rest.iter();
    let bent: Vec<DVec3> = bent.map(|x| *x * 1.01 + random.vector(1e-3)).collect();
    let mut best = f64::INFINITY;
    for _ in 0..200 {
        let start = Instant::now();
        law.forces_into(&bent, &mut f);
        best = best.min(start.elapsed().as_secs_f64());
    }
    let steps = period() / (0.9 * found.critical_step);
    Ok([error, 1e3 * best * steps])
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

/// Materials, and stabilizations with their dilatation.
fn options() -> impl Iterator<Item = (Material, &'static str, Settings)> {
    let materials = [
        Material::neo_hookean(1.0, NU),
        Material::saint_venant_kirchhoff(1.0, NU),
        Material::mooney_rivlin(1.0, NU, 0.3),
    ];
    let settings = [
        ("none", 0.0, Dilatation::Local),
        ("control", 0.1, Dilatation::Local),
        ("control + mean", 0.1, Dilatation::Mean),
    ];
    materials.into_iter().flat_map(move |material| {
        // One law has no volumetric part to average.
        let split = !matches!(material.law, Law::SaintVenantKirchhoff { .. });
        let settings = settings.into_iter();
        let settings = settings.filter(move |(.., mean)| split || *mean == Dilatation::Local);
        settings.map(move |(label, stabilization, dilatation)| {
            let settings = Settings {
                stabilization,
                dilatation,
                ..Settings::default()
            };
            (material, label, settings)
        })
    })
}

fn study(folder: &Path) -> Result<(), StudyError> {
    let mut groups = Vec::new();
    let mut note = |group: &str, [error, time]: [f64; 2]| {
        add_point(&mut groups, group, (time, error.abs()));
    };
    let (mut default_error, mut paper_error) = (f64::INFINITY, 0.0_f64);
    for jitter in [0.0, 0.25] {
        let block = beam::beam([20, 4, 4], jitter);
        for (rule, block) in &rules(&block)? {
            for (material, label, settings) in options() {
                let mut body = beam::body(block, material, &settings);
                let found = measure(block, &block.volumes, &mut law(&mut body))?;
                if *rule == "edges" && label == "control" {
                    default_error = default_error.min(found[0].abs());
                }
                note(&format!("{rule}, {label}"), found);
            }
        }
        let svk = Material::saint_venant_kirchhoff(1.0, NU);
        let (mut paper, _) = dissertation(&block.rest, svk, 1.0)?;
        let masses = paper.volumes().to_vec();
        let found = measure(&block, &masses, &mut law(&mut paper))?;
        paper_error = paper_error.max(found[0].abs());
        note("dissertation", found);
        let neo = Material::neo_hookean(1.0, NU);
        let mut tetrahedra = beam::Tetrahedra::new(&block.rest, &block.tetrahedra, neo);
        let found = measure(&block, &block.volumes, &mut tetrahedra)?;
        note("linear tetrahedra", found);
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
