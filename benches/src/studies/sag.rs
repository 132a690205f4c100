//! The bodies of chapter 6 hanging at small strain, in both models, against finite elements.

use glam::DVec3;
use phyxel::scene::Scene;
use phyxel::world::Body;
use phyxel_elastic::Material;
use phyxel_integrate::{ForceLaw, Supports};

use super::hanging::{BODIES, MODELS, overrides};
use crate::problems::cantilever::Tetrahedra;
use crate::problems::elements::{Elements, Order};
use crate::problems::model::{Law, Solid, small_displacements};
use crate::report::{Cell, Table};
use crate::{Effort, StudyError};

/// The material of chapter 6's scenes; forces scale with the modulus (Pa).
const SOLID: Solid = Solid {
    youngs_modulus: 1e4,
    poissons_ratio: 0.4,
    density: 1000.0,
};
/// Acceleration (m/s²); displacements are of small strain at any.
const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

/// How far a body sags in one model.
#[derive(Debug, Clone)]
pub(crate) struct Sag {
    pub(crate) body: &'static str,
    pub(crate) model: &'static str,
    nodes: usize,
    /// Mean over the mass (m): what the weight does work along.
    mean: f64,
    /// That of the finite elements.
    known: f64,
}

impl Sag {
    /// Error of the mean sag (%); None if no equilibrium was found.
    pub(crate) fn error(&self) -> Option<f64> {
        self.mean
            .is_finite()
            .then(|| 100.0 * (self.mean / self.known - 1.0))
    }
}

/// A body of a scene as it lies before anything moves.
fn body(name: &str, changes: &[&str]) -> Result<Body, StudyError> {
    let still = ["gravity=None", "integration.settle=None", "cuts=[]"];
    let changes: Vec<&str> = still.iter().chain(changes).copied().collect();
    let scene = Scene::embedded(name, &overrides(&changes)?)?;
    Ok(Body::new(&scene, &scene.bodies[0])?)
}

/// Mean sag (m) under the weight of `masses` (kg), supports held.
fn sag(
    law: &mut impl ForceLaw,
    rest: &[DVec3],
    masses: &[f64],
    supports: &Supports,
) -> Result<f64, StudyError> {
    let forces: Vec<DVec3> = masses.iter().map(|m| GRAVITY * *m).collect();
    // Two nodes never lie in one place.
    let held: std::collections::HashSet<[u64; 3]> = (0..rest.len())
        .filter(|node| supports.of(*node).is_some())
        .map(|node| rest[node].to_array().map(f64::to_bits))
        .collect();
    let free = |x: DVec3| {
        if held.contains(&x.to_array().map(f64::to_bits)) {
            DVec3::ZERO
        } else {
            DVec3::ONE
        }
    };
    let moved = small_displacements(law, rest, &forces, free)?;
    Ok(mean(&moved, masses))
}

fn mean(moved: &[DVec3], masses: &[f64]) -> f64 {
    let sum: f64 = moved.iter().zip(masses).map(|(u, m)| -u.z * m).sum();
    sum / masses.iter().sum::<f64>()
}

/// Linear tetrahedra on a body's own nodes.
fn by_tetrahedra(body: &Body) -> Result<f64, StudyError> {
    let material = Material::neo_hookean(SOLID.youngs_modulus, SOLID.poissons_ratio);
    let mut law = Tetrahedra::new(&body.rest, &body.tetrahedra, material);
    sag(&mut law, &body.rest, &body.masses, body.motion.supports())
}

/// Nodes of a body and its mean sag (m) in its own model, not a number if no equilibrium was found.
fn by_model(mut body: Body) -> (usize, f64) {
    let supports = body.motion.supports().clone();
    let found = sag(
        &mut Law(&mut body.elastic),
        &body.rest,
        &body.masses,
        &supports,
    );
    (body.rest.len(), found.unwrap_or(f64::NAN))
}

/// Mean sag of triquadratic elements of the block, 7 x 7 x 21 cm, held at its top.
fn by_elements() -> Result<f64, StudyError> {
    let high = DVec3::new(0.035, 0.035, 0.105);
    let mut body = Elements::even([8, 8, 24], -high, high, Order::Quadratic, SOLID);
    let supports = Supports::fixed_where(&body.rest, |x| x.z > high.z - 1e-9);
    let masses: Vec<f64> = body.volumes().iter().map(|v| v * SOLID.density).collect();
    let forces: Vec<DVec3> = masses.iter().map(|m| GRAVITY * *m).collect();
    let moved = body.solve(&supports, &forces)?;
    Ok(mean(&moved, &masses))
}

/// What the finite elements say of a body, and in words how.
struct Known {
    sag: f64,
    how: String,
    /// What coarser ones say.
    coarser: f64,
}

fn known(name: &str, effort: Effort) -> Result<Known, StudyError> {
    let most = match effort {
        Effort::Full => 16_000,
        Effort::Quick => 3_000,
    };
    let on = |nodes: u32| {
        let target = format!("bodies[0].sampling.target=Nodes({nodes})");
        let body = body(name, &[&target])?;
        Ok::<_, StudyError>((by_tetrahedra(&body)?, body.spacing))
    };
    let ((coarse, wide), (fine, narrow)) = (on(most / 4)?, on(most)?);
    let extrapolated = fine + (fine - coarse) / ((wide / narrow).powi(2) - 1.0);
    if name.starts_with("block") {
        return Ok(Known {
            sag: by_elements()?,
            how: "triquadratic, 8 x 8 x 24 intervals".to_owned(),
            coarser: extrapolated,
        });
    }
    Ok(Known {
        sag: extrapolated,
        how: format!("linear tetrahedra, {most} nodes, extrapolated"),
        coarser: fine,
    })
}

/// The sags of all bodies in both models, and their table.
pub(crate) fn measure(effort: Effort) -> Result<(Vec<Sag>, Table), StudyError> {
    let (mut sags, mut rows) = (Vec::new(), Vec::new());
    let finer: &[u32] = match effort {
        Effort::Full => &[600, 2_000, 6_000],
        Effort::Quick => &[600],
    };
    for (name, _) in BODIES {
        let known = known(name, effort)?;
        let mut add = |model: &str, nodes: Cell, error: Option<f64>| {
            rows.push(vec![
                Cell::Word(name.to_owned()),
                Cell::Word(model.to_owned()),
                nodes,
                error.map_or(Cell::Word("not found".to_owned()), Cell::Number),
            ]);
        };
        for (suffix, model) in MODELS {
            let (nodes, mean) = by_model(body(&format!("{name}{suffix}"), &[])?);
            let sag = Sag {
                body: name,
                model,
                nodes,
                mean,
                known: known.sag,
            };
            add(model, Cell::Count(sag.nodes), sag.error());
            sags.push(sag);
        }
        let error = |sag: f64| sag.is_finite().then(|| 100.0 * (sag / known.sag - 1.0));
        // Ten times the default's control of zero-energy modes.
        let (nodes, mean) = by_model(body(name, &["bodies[0].material.stabilization=1"])?);
        add("control 1", Cell::Count(nodes), error(mean));
        let here = body(name, &[])?;
        add(
            "linear tetrahedra, the same nodes",
            Cell::Count(here.rest.len()),
            error(by_tetrahedra(&here)?),
        );
        for nodes in finer {
            let target = format!("bodies[0].sampling.target=Nodes({nodes})");
            let finer = body(name, &[&target])?;
            let tetrahedra = by_tetrahedra(&finer)?;
            let (nodes, mean) = by_model(finer);
            add("default, more nodes", Cell::Count(nodes), error(mean));
            add(
                "linear tetrahedra, the same nodes",
                Cell::Count(nodes),
                error(tetrahedra),
            );
        }
        add(
            &format!("beside the reference ({})", known.how),
            Cell::Nothing,
            error(known.coarser),
        );
    }
    let table = Table {
        name: "sag",
        title: "Hanging at small strain: mean sag against finite elements".to_owned(),
        columns: super::cut::columns(&[
            ("body", ""),
            ("model", ""),
            ("nodes", "1"),
            ("error of the sag", "%"),
        ]),
        rows,
    };
    Ok((sags, table))
}
