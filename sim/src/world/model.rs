//! From a body's description to nodes, masses and forces.

use glam::DVec3;
use phyxel_discretize::{Solid, tetrahedra_edges};
use phyxel_elastic::{
    Dilatation, Elastic, Fiber, Material, Materials, Nodes, Precision, PronyTerm, Settings,
};
use phyxel_mls::{
    ConservativeSettings, ConservativeStencils, NearestSettings, Neighborhoods, dissertation_cloud,
    inverse_square_weights, k_nearest, widen_deficient_rows,
};

use super::error::BodyProblem;
use super::shape::{Sampled, sample};
use super::stencils::Stencils;
use crate::scene::{self, Form, Method, Model};

/// Nodes of the uncut body whose neighbours span a direction this much less than the widest get their
/// neighbours' neighbours.
const FLAT: f64 = 1e-3;

/// Nearest nodes that become neighbours, both ways, where no tetrahedra tell: with 14 a beam of 3,968
/// points bends 4.8 % too far, with 18 6.0 % (`benches beam`).
const NEAREST: usize = 14;

/// What a body is made of, before it moves.
pub(super) struct Built {
    pub(super) rest: Vec<DVec3>,
    pub(super) volumes: Vec<f64>,
    pub(super) masses: Vec<f64>,
    /// Material of each node; empty for one.
    pub(super) parts: Vec<u32>,
    pub(super) tetrahedra: Vec<[u32; 4]>,
    pub(super) outer: Vec<u32>,
    pub(super) volume_error: Option<f64>,
    pub(super) missed: f64,
    pub(super) neighborhoods: Neighborhoods,
    pub(super) stencils: Stencils,
    pub(super) elastic: Elastic,
}

/// Builds nodes and model of a body.
pub(super) fn build(solid: &Solid, wish: &scene::Body) -> Result<Built, BodyProblem> {
    let sampling = sample(solid, wish)?;
    let part_of = parts_of(wish, &sampling.positions);
    let Coupled {
        neighborhoods,
        stencils,
        volumes,
        mut masses,
    } = couple(&sampling, wish)?;
    let parts = wish
        .inclusions
        .iter()
        .map(|part| wish.material.within(part));
    let all: Vec<scene::Material> = std::iter::once(wish.material.clone())
        .chain(parts)
        .collect();
    for (mass, &part) in masses.iter_mut().zip(&part_of) {
        let density = all[part as usize].density;
        if part > 0 {
            *mass *= density / wish.material.density;
        }
    }
    let list: Vec<Material> = all.iter().map(law_of).collect();
    let materials = if part_of.is_empty() {
        Materials::Uniform(list[0])
    } else {
        Materials::PerNode {
            list: &list,
            of_node: &part_of,
        }
    };
    let mut elastic = Elastic::new(
        &stencils.view(&neighborhoods),
        &Nodes {
            rest_positions: &sampling.positions,
            volumes: &volumes,
        },
        &materials,
        &Settings {
            zero_energy_control: wish.material.stabilization,
            precision: match wish.precision {
                scene::Precision::Double => Precision::Double,
                scene::Precision::Single => Precision::Single,
            },
            dilatation: match wish.material.dilatation {
                scene::Dilatation::Local => Dilatation::Local,
                scene::Dilatation::Mean => Dilatation::Mean,
            },
            ..Settings::default()
        },
    )?;
    // Between two steps a viscous body answers at once.
    elastic.begin_viscous_step(0.0);
    Ok(Built {
        rest: sampling.positions,
        volumes,
        masses,
        parts: part_of,
        tetrahedra: sampling.tetrahedra,
        outer: sampling.outer,
        volume_error: sampling.volume_error,
        missed: sampling.missed,
        neighborhoods,
        stencils,
        elastic,
    })
}

/// Nodes that know their neighbours.
struct Coupled {
    neighborhoods: Neighborhoods,
    stencils: Stencils,
    volumes: Vec<f64>,
    masses: Vec<f64>,
}

fn couple(sampling: &Sampled, wish: &scene::Body) -> Result<Coupled, BodyProblem> {
    let rest = &sampling.positions;
    let density = wish.material.density;
    match wish.method {
        Method::Conservative => {
            let edges = match wish.sampling.form {
                Form::Tetrahedra => {
                    let (offsets, indices) = tetrahedra_edges(rest.len(), &sampling.tetrahedra);
                    Neighborhoods::from_graph(offsets, indices)?
                }
                Form::Points => {
                    let settings = NearestSettings {
                        nearest: NEAREST,
                        limit: Some(NEAREST),
                        ..NearestSettings::default()
                    };
                    k_nearest(rest, &settings)?.neighborhoods.symmetrized()?
                }
            };
            // Nodes of tetrahedra that lie flat on the surface see no third direction along edges.
            let (neighborhoods, _) = widen_deficient_rows(rest, &edges, FLAT)?;
            let weights = inverse_square_weights(rest, &neighborhoods);
            let mut stencils = ConservativeStencils::new(
                rest,
                &sampling.volumes,
                &sampling.boundary_vectors,
                &neighborhoods,
                weights,
                &ConservativeSettings::for_cutting(),
            )?;
            // The model reads the factored form.
            stencils.forget_pair_gradients();
            Ok(Coupled {
                neighborhoods,
                stencils: Stencils::Conservative(Box::new(stencils)),
                volumes: sampling.volumes.clone(),
                masses: sampling.volumes.iter().map(|v| density * v).collect(),
            })
        }
        Method::Dissertation {
            nearest,
            support_scale,
            neighbor_limit,
        } => {
            let near = k_nearest(
                rest,
                &NearestSettings {
                    nearest: nearest as usize,
                    scale: support_scale,
                    limit: neighbor_limit.map(|limit| limit as usize),
                },
            )?;
            let tolerance = ConservativeSettings::for_cutting().rank_tolerance;
            let cloud = dissertation_cloud(rest, &near, density, tolerance)?;
            Ok(Coupled {
                neighborhoods: cloud.neighborhoods,
                stencils: Stencils::Plain(Box::new(cloud.stencils)),
                volumes: cloud.masses.volumes,
                masses: cloud.masses.masses,
            })
        }
    }
}

/// Number of each node's part, 0 for the body itself; empty without inclusions.
fn parts_of(wish: &scene::Body, rest: &[DVec3]) -> Vec<u32> {
    if wish.inclusions.is_empty() {
        return Vec::new();
    }
    let mut part_of = vec![0; rest.len()];
    for (number, part) in (1..).zip(&wish.inclusions) {
        for (of, &x) in part_of.iter_mut().zip(rest) {
            if part.region.contains(x) {
                *of = number;
            }
        }
    }
    part_of
}

/// A scene's material as the elastic model has it.
fn law_of(wish: &scene::Material) -> Material {
    let (modulus, ratio) = (wish.youngs_modulus, wish.poissons_ratio);
    let law = match wish.model {
        Model::StableNeoHookean => Material::stable_neo_hookean(modulus, ratio),
        Model::NeoHookean => Material::neo_hookean(modulus, ratio),
        Model::SaintVenantKirchhoff => Material::saint_venant_kirchhoff(modulus, ratio),
        Model::MooneyRivlin { share } => Material::mooney_rivlin(modulus, ratio, share),
    };
    let terms = wish.viscosity.iter().map(|term| PronyTerm {
        ratio: term.ratio,
        relaxation_time: term.time,
    });
    let law = law
        .with_volume_constant(wish.volume_constant)
        .with_prony(&terms.collect::<Vec<_>>());
    match wish.fiber {
        None => law,
        Some(fiber) => law.with_fiber(Fiber {
            direction: fiber.direction,
            stiffness: fiber.stiffness,
            exponent: fiber.exponent,
            dispersion: fiber.dispersion,
        }),
    }
}
