//! From a body's description to nodes, masses and forces.

use glam::DVec3;
use phyxel_discretize::{
    Solid, boundary_triangles, nodal_boundary_vectors, nodal_volumes, tetrahedra_edges,
};
use phyxel_elastic::{
    CutPolicy, Elastic, Material, MaterialSettings, Materials, Nodes, Settings, Stencils,
};
use phyxel_mls::{
    ConservativeSettings, GradientStencils, NearestSettings, Neighborhoods, dissertation_cloud,
    inverse_square_weights, k_nearest, widen_deficient_rows,
};

use crate::error::BodyProblem;
use crate::scene::{self, Form, Method, Scene};
use crate::shape::{Sampled, sample};
use crate::support::holders;

/// Nodes of the uncut body whose neighbours span a direction this much less than the widest get their
/// neighbours' neighbours.
const FLAT: f64 = 1e-3;

/// Nearest nodes that become neighbours, both ways, where no tetrahedra tell: with 14 a beam of 3,968
/// points bends 4.8 % too far, with 18 6.0 % (`benches beam`).
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

/// Builds nodes and model of a body; also the material of each node, none if there is but one.
pub(crate) fn build(
    scene: &Scene,
    solid: &Solid,
    spec: &scene::Body,
) -> Result<(Sampled, Coupled, Vec<u32>, Elastic), BodyProblem> {
    let sampled = sample(solid, spec)?;
    let holders = holders(scene, spec, &sampled.positions);
    let part_of = parts_of(spec, &sampled.positions);
    let mut coupled = couple(&sampled, &holders, spec)?;
    let mut all = vec![spec.material.clone()];
    all.extend(
        spec.inclusions
            .iter()
            .map(|part| part.within(&spec.material)),
    );
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
    };
    let mut elastic = Elastic::new(&rows, &nodes, &materials, &settings)?;
    if coupled.carried.is_some() {
        // Nodes at a corner of what is fixed, which a support leaves too little to tell a strain from.
        let policy = CutPolicy::default();
        let too_few = |&node: &u32| {
            let at = node as usize;
            holders[at] > 0 && coupled.inert.binary_search(&node).is_err() && {
                let row = &stencils.weights[graph.pairs(at)];
                let linked = row.iter().filter(|&&weight| weight > 0.0).count();
                linked < policy.fewest_neighbors && linked < graph.row(at).len()
                    || stencils.ranks[at].condition > policy.largest_condition
            }
        };
        let weak: Vec<u32> = (0..).take(holders.len()).filter(too_few).collect();
        elastic.weaken(&weak, &sampled.positions, &|_| 1.0);
    }
    // Between two steps a viscous body answers at once.
    elastic.begin_viscous_step(0.0);
    Ok((sampled, coupled, part_of, elastic))
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
    let rest = &sampling.positions;
    let density = spec.material.density;
    match spec.method {
        Method::Conservative => {
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
            let deforming = Deforming::of(sampling, holders);
            let (mut volumes, mut boundary) = (&sampling.volumes, &sampling.boundary_vectors);
            if let Some(deforming) = &deforming {
                deforming.uncouple(&neighborhoods, holders, &mut weights);
                (volumes, boundary) = (&deforming.volumes, &deforming.boundary_vectors);
            }
            let stencils = GradientStencils::conservative(
                rest,
                volumes,
                boundary,
                &neighborhoods,
                weights,
                &ConservativeSettings::for_cutting(),
            )?;
            Ok(Coupled {
                neighborhoods,
                stencils,
                volumes: sampling.volumes.clone(),
                masses: sampling.volumes.iter().map(|v| density * v).collect(),
                inert: deforming.as_ref().map_or_else(Vec::new, Deforming::inert),
                carried: deforming.map(|deforming| deforming.volumes),
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
                stencils: cloud.stencils,
                carried: None,
                volumes: cloud.masses.volumes,
                masses: cloud.masses.masses,
                inert: Vec::new(),
            })
        }
    }
}

/// The part of a body that can deform, where a support holds whole tetrahedra: those do not, and the strain of a
/// node on their face is that of its other side. Taken for both sides it would be half of that, as if the
/// body were free up to half a spacing within the support: a liver of 622 nodes, held by a fifth of them, sags
/// 16 % too far then.
struct Deforming {
    /// Whether a node has any tetrahedron that can deform.
    carries: Vec<bool>,
    /// Volumes (m³) and boundary vectors (m²) of the tetrahedra that can; the volume of other nodes is that of all.
    volumes: Vec<f64>,
    boundary_vectors: Vec<DVec3>,
    /// Edges of those tetrahedra.
    edges: (Vec<u32>, Vec<u32>),
}

impl Deforming {
    /// `None` if all of the body can deform.
    fn of(sampling: &Sampled, holders: &[u32]) -> Option<Self> {
        let rest = &sampling.positions;
        let is_held = |tetrahedron: &[u32; 4]| {
            let [first, others @ ..] = tetrahedron.map(|node| holders[node as usize]);
            first > 0 && others.iter().all(|other| *other == first)
        };
        if !sampling.tetrahedra.iter().any(is_held) {
            return None;
        }
        let free = |tetrahedron: &&[u32; 4]| !is_held(tetrahedron);
        let tetrahedra: Vec<[u32; 4]> = sampling.tetrahedra.iter().filter(free).copied().collect();
        let mut carries = vec![false; rest.len()];
        for &node in tetrahedra.iter().flatten() {
            carries[node as usize] = true;
        }
        let mut volumes = nodal_volumes(rest, &tetrahedra);
        for ((volume, &carries), &whole) in volumes.iter_mut().zip(&carries).zip(&sampling.volumes)
        {
            if !carries {
                *volume = whole;
            }
        }
        let surface = boundary_triangles(&tetrahedra, |_| true);
        Some(Self {
            carries,
            volumes,
            boundary_vectors: nodal_boundary_vectors(rest, &surface),
            edges: tetrahedra_edges(rest.len(), &tetrahedra),
        })
    }

    /// Nodes without a tetrahedron that can, ascending.
    fn inert(&self) -> Vec<u32> {
        let nodes = (0_u32..).zip(&self.carries);
        nodes
            .filter(|(_, carries)| !**carries)
            .map(|(node, _)| node)
            .collect()
    }

    /// Takes the weights from pairs of one support that no deforming tetrahedron joins, and from all pairs of
    /// nodes that carry nothing.
    fn uncouple(&self, graph: &Neighborhoods, holders: &[u32], weights: &mut [f64]) {
        let (offsets, indices) = &self.edges;
        for node in 0..holders.len() {
            let joined = &indices[offsets[node] as usize..offsets[node + 1] as usize];
            for pair in graph.pairs(node) {
                let other = graph.indices()[pair] as usize;
                let together = holders[node] > 0 && holders[node] == holders[other];
                let apart = together && joined.binary_search(&graph.indices()[pair]).is_err();
                if apart || !self.carries[node] || !self.carries[other] {
                    weights[pair] = 0.0;
                }
            }
        }
    }
}

/// Number of each node's part, 0 for the body itself; empty without inclusions.
fn parts_of(spec: &scene::Body, rest: &[DVec3]) -> Vec<u32> {
    if spec.inclusions.is_empty() {
        return Vec::new();
    }
    let mut part_of = vec![0; rest.len()];
    for (number, part) in (1..).zip(&spec.inclusions) {
        for node in part.region.nodes(rest) {
            part_of[node as usize] = number;
        }
    }
    part_of
}
