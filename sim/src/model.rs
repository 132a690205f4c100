//! From a body's description to nodes, masses and forces.

use phyxel_discretize::{DeformingPart, Solid, tetrahedra_edges};
use phyxel_elastic::{
    CutPolicy, Elastic, Material, MaterialSettings, Materials, Nodes, Settings, Stencils,
};
use phyxel_mls::{
    ConservativeSettings, GradientStencils, NearestSettings, Neighborhoods, dissertation_cloud,
    inverse_square_weights, k_nearest, widen_deficient_rows,
};

use crate::error::BodyProblem;
use crate::scene::{self, Form, Method, Region, Scene};
use crate::shape::{Sampled, sample};

/// Nodes of the uncut body whose neighbours span a direction this much less than the widest get their
/// neighbours' neighbours.
const FLAT: f64 = 1e-3;

/// Nearest nodes that become neighbours, both ways, where no tetrahedra tell: with 14 a beam of 3,968
/// points bends 4.8 % too far, with 18 6.0 %.
const NEAREST: usize = 14;

/// The stencils of a body on its neighbours, for its elastic model.
#[must_use]
pub fn elastic_stencils<'a>(
    stencils: &'a GradientStencils,
    graph: &'a Neighborhoods,
) -> Stencils<'a> {
    let (weights, matrices) = (&stencils.weights, &stencils.matrices);
    Stencils::plain(graph.offsets(), graph.indices(), weights, matrices)
        .with_multipliers(&stencils.scales, &stencils.multipliers)
}

/// Builds nodes and model of a body.
pub(crate) fn build(
    scene: &Scene,
    solid: &Solid,
    spec: &scene::Body,
) -> Result<(Sampled, Coupled, Elastic), BodyProblem> {
    let sampled = sample(solid, spec)?;
    // What one support holds moves as a rigid body from beginning to end.
    let supports = (1..).zip(&scene.supports);
    let ours = supports.filter(|(_, support)| support.acts_on(&spec.name));
    let regions = ours.map(|(number, support)| (number, &support.region));
    let holders = Region::numbered(regions, &sampled.positions);
    let mut part_of = Vec::new();
    if !spec.inclusions.is_empty() {
        let regions = spec.inclusions.iter().map(|part| &part.region);
        part_of = Region::numbered((1..).zip(regions), &sampled.positions);
    }
    let mut coupled = couple(&sampled, &holders, spec)?;
    let within = spec.inclusions.iter();
    let within = within.map(|part| part.within(&spec.material));
    let all: Vec<_> = [spec.material.clone()].into_iter().chain(within).collect();
    for (mass, &part) in coupled.masses.iter_mut().zip(&part_of) {
        *mass *= all[part as usize].density / spec.material.density;
    }
    let list: Vec<Material> = all.iter().map(MaterialSettings::law).collect();
    let materials = if part_of.is_empty() {
        Materials::Uniform(list[0])
    } else {
        Materials::PerNode {
            list: &list,
            of_node: &part_of,
        }
    };
    let (graph, stencils) = (&coupled.neighborhoods, &coupled.stencils);
    let rows = elastic_stencils(stencils, graph);
    let volumes = coupled.carried.as_ref().unwrap_or(&coupled.volumes);
    let nodes = Nodes::new(&sampled.positions, volumes);
    let settings = Settings {
        stabilization: spec.material.stabilization,
        dilatation: spec.material.dilatation,
        ..Settings::default()
    };
    let mut elastic = Elastic::new(&rows, &nodes, &materials, &settings)?;
    if coupled.carried.is_some() {
        let inert = |node: &u32| coupled.inert.binary_search(node).is_ok();
        let held = |node: &u32| holders[*node as usize] > 0 && !inert(node);
        let held: Vec<u32> = (0..).take(holders.len()).filter(held).collect();
        // At a corner of what is fixed a support leaves too little to tell a strain from.
        elastic.weaken_deficient(&held, &CutPolicy::default());
    }
    // Between two steps a viscous body answers at once.
    elastic.begin_viscous_step(0.0);
    Ok((sampled, coupled, elastic))
}

/// Nodes that know their neighbours.
pub(crate) struct Coupled {
    pub(crate) neighborhoods: Neighborhoods,
    pub(crate) stencils: GradientStencils,
    /// Volumes (m³) whose strain nodes carry, where these are not their volumes.
    carried: Option<Vec<f64>>,
    pub(crate) volumes: Vec<f64>,
    pub(crate) masses: Vec<f64>,
    /// Nodes within a support, which carry no strain.
    pub(crate) inert: Vec<u32>,
}

fn couple(sampling: &Sampled, holders: &[u32], spec: &scene::Body) -> Result<Coupled, BodyProblem> {
    match spec.method {
        Method::Conservative => conservative(sampling, holders, spec),
        Method::Dissertation {
            nearest,
            support_scale,
            neighbor_limit,
        } => {
            let (rest, density) = (&sampling.positions, spec.material.density);
            let settings = NearestSettings {
                nearest: nearest as usize,
                scale: support_scale,
                limit: neighbor_limit.map(|limit| limit as usize),
            };
            let near = k_nearest(rest, &settings)?;
            let tolerance = ConservativeSettings::for_cutting().rank_tolerance;
            let cloud = dissertation_cloud(rest, &near, density, tolerance)?;
            Ok(Coupled {
                neighborhoods: cloud.neighborhoods,
                stencils: cloud.stencils,
                carried: None,
                volumes: cloud.masses.volumes,
                masses: cloud.masses.masses,
                inert: Vec::new(),
            })
        }
    }
}

fn conservative(
    sampling: &Sampled,
    holders: &[u32],
    spec: &scene::Body,
) -> Result<Coupled, BodyProblem> {
    let (rest, all) = (&sampling.positions, &sampling.volumes);
    let edges = match spec.sampling.form {
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
    let mut weights = inverse_square_weights(rest, &neighborhoods);
    let deforming = DeformingPart::new(rest, &sampling.tetrahedra, all, holders);
    let (mut volumes, mut boundary) = (all, &sampling.boundary_vectors);
    if let Some(deforming) = &deforming {
        let graph = (neighborhoods.offsets(), neighborhoods.indices());
        deforming.uncouple(holders, graph, &mut weights);
        (volumes, boundary) = (&deforming.volumes, &deforming.boundary_vectors);
    }
    let settings = ConservativeSettings::for_cutting();
    let graph = &neighborhoods;
    let stencils =
        GradientStencils::conservative(rest, volumes, boundary, graph, weights, &settings)?;
    let density = spec.material.density;
    Ok(Coupled {
        neighborhoods,
        stencils,
        volumes: all.clone(),
        masses: all.iter().map(|v| density * v).collect(),
        inert: deforming
            .as_ref()
            .map_or_else(Vec::new, DeformingPart::inert),
        carried: deforming.map(|deforming| deforming.volumes),
    })
}
