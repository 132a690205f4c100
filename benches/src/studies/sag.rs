//! The bodies of chapter 6 hanging at small strain, in both models, against finite elements.

use glam::DVec3;
use phyxel::Body;
use phyxel_discretize::{nodal_volumes, tetrahedron_volume};
use phyxel_integrate::{BoundaryConditions, ForceLaw};

use super::embedded;
use crate::problems::elements::{Elements, Order};
use crate::problems::lanes::Lanes;
use crate::problems::model::{law, small_displacements};
use crate::problems::solid::Solid;
use crate::report::{Cell, Table, row};
use crate::{Effort, StudyError};

/// Bodies of chapter 6: their scenes, and the frames per second that Aras 2014 reports.
pub(super) const BODIES: [(&str, f64); 3] = [
    ("block-1408", 80.0),
    ("block-436", 125.0),
    ("liver-181", 120.0),
];

/// Models: what is added to a scene's name.
pub(super) const MODELS: [(&str, &str); 2] = [("", "default"), ("-dissertation", "dissertation")];

/// The material of chapter 6's scenes; forces scale with the modulus (Pa).
const SOLID: Solid = Solid {
    youngs_modulus: 1e4,
    poissons_ratio: 0.4,
    density: 1000.0,
};
/// Acceleration (m/s²); displacements are of small strain at any.
const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

/// How far a body's mean sag, over the mass (what the weight does work along), is off the finite elements' in one model
/// (%); None if no equilibrium was found.
#[derive(Debug, Clone)]
pub(crate) struct Sag {
    pub(crate) body: &'static str,
    pub(crate) model: &'static str,
    pub(crate) error: Option<f64>,
}

/// A body of a scene as it lies before anything moves.
fn body(name: &str, changes: &[&str]) -> Result<Body, StudyError> {
    let still = ["gravity=None", "integration.settle=None", "cuts=[]"];
    let changes: Vec<&str> = still.iter().chain(changes).copied().collect();
    let scene = embedded(name, &changes)?;
    Ok(Body::new(&scene, &scene.bodies[0])?)
}

/// Mean sag (m) under the weight of `masses` (kg), nodes fixed where `held` says.
fn sag(
    law: &mut impl ForceLaw,
    rest: &[DVec3],
    masses: &[f64],
    held: &[bool],
) -> Result<f64, StudyError> {
    let forces: Vec<DVec3> = masses.iter().map(|m| GRAVITY * *m).collect();
    let free = |node: usize| [DVec3::ONE, DVec3::ZERO][usize::from(held[node])];
    let moved = small_displacements(law, rest, &forces, free)?;
    Ok(mean(&moved, masses))
}

fn mean(moved: &[DVec3], masses: &[f64]) -> f64 {
    let sum: f64 = moved.iter().zip(masses).map(|(u, m)| -u.z * m).sum();
    sum / masses.iter().sum::<f64>()
}

/// Tetrahedra with nodes that are held or not.
#[derive(Debug, Clone)]
struct Mesh {
    rest: Vec<DVec3>,
    tetrahedra: Vec<[u32; 4]>,
    held: Vec<bool>,
}

impl Mesh {
    fn of(body: &Body) -> Self {
        Self {
            rest: body.rest.clone(),
            tetrahedra: body.tetrahedra.clone(),
            held: held(body),
        }
    }

    /// Eight tetrahedra instead of each, divided at the middles of the edges, the octahedron within along one of
    /// its diagonals (Bey 1995): the same body, and the same part of it held.
    fn divided(&self) -> Self {
        let Self {
            mut rest, mut held, ..
        } = self.clone();
        let mut middles = std::collections::HashMap::new();
        let mut tetrahedra = Vec::with_capacity(8 * self.tetrahedra.len());
        for &[a, b, c, d] in &self.tetrahedra {
            let mut middle = |p: u32, q: u32| {
                *middles.entry([p.min(q), p.max(q)]).or_insert_with(|| {
                    let (i, j) = (p as usize, q as usize);
                    rest.push(rest[i].midpoint(rest[j]));
                    held.push(held[i] && held[j]);
                    u32::try_from(rest.len() - 1).expect("fewer nodes than 2^32")
                })
            };
            let (ab, ac, ad) = (middle(a, b), middle(a, c), middle(a, d));
            let (bc, bd, cd) = (middle(b, c), middle(b, d), middle(c, d));
            tetrahedra.extend([
                [a, ab, ac, ad],
                [ab, b, bc, bd],
                [ac, bc, c, cd],
                [ad, bd, cd, d],
                [ab, ac, ad, bd],
                [ab, ac, bd, bc],
                [ac, ad, bd, cd],
                [ac, bc, cd, bd],
            ]);
        }
        let lies = |t: &[u32; 4]| tetrahedron_volume(t.map(|node| rest[node as usize])) > 0.0;
        debug_assert!(tetrahedra.iter().all(lies), "as they were");
        Self {
            rest,
            tetrahedra,
            held,
        }
    }

    /// Mean sag (m) of linear tetrahedra.
    fn sag(&self) -> Result<f64, StudyError> {
        let mut law = Lanes::tetrahedra(&self.rest, &self.tetrahedra, SOLID);
        let volumes = nodal_volumes(&self.rest, &self.tetrahedra);
        let masses: Vec<f64> = volumes.iter().map(|v| SOLID.density * v).collect();
        sag(&mut law, &self.rest, &masses, &self.held)
    }
}

fn held(body: &Body) -> Vec<bool> {
    let supports = body.motion().supports();
    let nodes = 0..body.rest.len();
    nodes.map(|node| supports.of(node).is_some()).collect()
}

/// Nodes of a body and its mean sag (m) in its own model, not a number if no equilibrium was found.
fn by_model(body: &Body) -> (usize, f64) {
    let (held, mut elastic) = (held(body), body.elastic().clone());
    let found = sag(&mut law(&mut elastic), &body.rest, &body.masses, &held);
    (body.rest.len(), found.unwrap_or(f64::NAN))
}

/// Mean sag of triquadratic elements of the block, 7 x 7 x 21 cm, held at its top.
fn by_elements() -> Result<f64, StudyError> {
    let high = DVec3::new(0.035, 0.035, 0.105);
    let mut body = Elements::even([8, 8, 24], -high, high, Order::Quadratic, SOLID);
    let supports = BoundaryConditions::fixed_where(&body.rest, |x| x.z > high.z - 1e-9);
    let masses: Vec<f64> = body.volumes().iter().map(|v| v * SOLID.density).collect();
    let forces: Vec<DVec3> = masses.iter().map(|m| GRAVITY * *m).collect();
    let moved = body.solve(&supports, &forces)?;
    Ok(mean(&moved, &masses))
}

/// What finite elements say of a body, and coarser ones (m).
#[derive(Debug, Clone, Copy)]
struct Known {
    sag: f64,
    coarser: f64,
}

/// Nodes up to which a liver's tetrahedra are divided twice, not once.
const DIVIDED_TWICE: usize = 1000;

/// The reference for a body: of the block all samplings hold the same part, so that triquadratic elements serve
/// all; of a liver each holds a part of its own, as far as its nodes lie in the support.
fn known(name: &str, body: &Body) -> Result<Known, StudyError> {
    let whole = Mesh::of(body);
    let once = whole.divided();
    let (coarse, fine) = if body.rest.len() <= DIVIDED_TWICE {
        (once.sag()?, once.divided().sag()?)
    } else {
        (whole.sag()?, once.sag()?)
    };
    let extrapolated = fine + (fine - coarse) / 3.0;
    let (sag, coarser) = if name.starts_with("block") {
        (by_elements()?, extrapolated)
    } else {
        (extrapolated, fine)
    };
    Ok(Known { sag, coarser })
}

/// The sags of all bodies in both models, and their table.
pub(crate) fn measure(effort: Effort) -> Result<(Vec<Sag>, Table), StudyError> {
    let (mut sags, mut rows) = (Vec::new(), Vec::new());
    let finer: &[u32] = effort.choose(&[600, 2_000, 6_000], &[600]);
    for (name, _) in BODIES {
        let here = body(name, &[])?;
        let reference = known(name, &here)?;
        let error =
            |sag: f64, known: Known| sag.is_finite().then(|| 100.0 * (sag / known.sag - 1.0));
        let mut add = |model: &str, nodes: usize, error: Option<f64>| {
            let error = error.map_or("not found".into(), Cell::Number);
            rows.push(row![name, model, nodes, error]);
        };
        for (suffix, model) in MODELS {
            let (nodes, mean) = by_model(&body(&format!("{name}{suffix}"), &[])?);
            let error = error(mean, reference);
            add(model, nodes, error);
            sags.push(Sag {
                body: name,
                model,
                error,
            });
        }
        // Ten times the default's hourglass stabilization.
        let (nodes, mean) = by_model(&body(name, &["bodies[0].material.stabilization=1"])?);
        add("control 1", nodes, error(mean, reference));
        let (tetrahedra, coarser) = ("linear tetrahedra, the same nodes", "coarser reference");
        add(tetrahedra, nodes, error(Mesh::of(&here).sag()?, reference));
        add(coarser, nodes, error(reference.coarser, reference));
        for nodes in finer {
            let target = format!("bodies[0].sampling.target=Nodes({nodes})");
            let finer = body(name, &[&target])?;
            let reference = known(name, &finer)?;
            let own = Mesh::of(&finer).sag()?;
            let (nodes, mean) = by_model(&finer);
            add("default, more nodes", nodes, error(mean, reference));
            add(tetrahedra, nodes, error(own, reference));
            add(coarser, nodes, error(reference.coarser, reference));
        }
    }
    let table = Table::new(
        "sag",
        "Hanging at small strain: mean sag against finite elements",
        "body; model; nodes (1); error of the sag (%)",
        rows,
    );
    Ok((sags, table))
}
