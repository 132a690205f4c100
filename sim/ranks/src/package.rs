//! What a rank is given: the model of its nodes and of those around them.
//!
//! Local nodes are, in this order: padding, ghosts below, own nodes, ghosts above; each part ascending by the
//! nodes' numbers in the body. So every row is summed in the body's order. The padding makes own nodes
//! begin at a multiple of the elastic model's runs, as they do in the body.

mod change;
mod locals;
mod weak;

use glam::{DMat3, DVec3};
use phyxel::{Body, BodyProblem, elastic_stencils};
use phyxel_elastic::{Elastic, Material, Materials, Nodes, Settings, Stencils};
use phyxel_integrate::{BoundaryConditions, Motion, MotionSettings};
use serde::{Deserialize, Serialize};

use crate::layout::Layout;
pub(crate) use change::Change;
pub(crate) use locals::{Locals, number};
use locals::{of_rank, row};
use weak::{Weak, weak_nodes, weaken};

/// A rank's part of a body.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Package {
    /// Number in the body of the first own node.
    pub(crate) start: usize,
    /// How many chunks of nodes each rank has.
    pub(crate) chunks: Vec<usize>,
    /// Local number of the first own node, and how many there are.
    pub(crate) first: usize,
    pub(crate) count: usize,
    pub(crate) rest: Vec<DVec3>,
    /// Whether any rank has something that decays: its works need forces evaluated where the nodes are.
    pub(crate) carries: bool,
    /// Ranks that need positions of own nodes, with the local numbers of these.
    pub(crate) sends: Vec<(usize, Vec<u32>)>,
    /// Ranks whose nodes are ghosts here, with the local number of the first and how many.
    pub(crate) receives: Vec<(usize, usize, usize)>,
    /// Own nodes, counted from the first, that rank 0 sees in every step, and their positions among all such.
    pub(crate) watched: Vec<(u32, u32)>,
    /// How many nodes rank 0 sees in every step.
    pub(crate) watched_count: usize,
}

/// What a rank builds its nodes' motion and model from.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct RankModel {
    volumes: Vec<f64>,
    masses: Vec<f64>,
    offsets: Vec<u32>,
    indices: Vec<u32>,
    weights: Vec<f64>,
    matrices: Vec<DMat3>,
    scales: Vec<f64>,
    multipliers: Vec<DVec3>,
    materials: Vec<Material>,
    material_of: Vec<u32>,
    settings: Settings,
    held: Vec<u32>,
    motion: MotionSettings,
    supports: BoundaryConditions,
    control_scales: Vec<(u32, f64)>,
    fronts: Vec<(u32, DMat3)>,
    weak: Vec<Weak>,
    /// Nodes with an offset of their deformation gradient, ascending, and these.
    offsets_of_gradients: Vec<(u32, ([f64; 9], f64))>,
}

/// Packages for all ranks, and which nodes each has.
pub(crate) fn packages(
    layout: &Layout,
    body: &Body,
    watched: &[u32],
) -> (Vec<Package>, Vec<Locals>) {
    let halos = layout.halos(|node| body.neighborhoods.row(node));
    let locals: Vec<Locals> = (0..)
        .zip(halos)
        .map(|(rank, halo)| Locals::new(layout.range(rank), halo))
        .collect();
    let mut packages: Vec<Package> = locals
        .iter()
        .map(|locals| package(layout, locals, body, watched))
        .collect();
    for (rank, locals) in locals.iter().enumerate() {
        let all = &locals.ghosts[..];
        let mut at = 0;
        while at < all.len() {
            let owner = layout.rank_of(all[at] as usize);
            let range = layout.range(owner);
            let run = all[at..].partition_point(|&node| (node as usize) < range.end);
            packages[rank].receives.push((owner, locals.ghost(at), run));
            let offset = packages[owner].first;
            let nodes = all[at..at + run].iter();
            let nodes = nodes.map(|&node| number(offset + node as usize - range.start));
            let nodes = nodes.collect();
            packages[owner].sends.push((rank, nodes));
            at += run;
        }
    }
    (packages, locals)
}

fn package(layout: &Layout, locals: &Locals, body: &Body, watched: &[u32]) -> Package {
    // Padding lies anywhere.
    let spot = body.rest.get(locals.own.start).copied();
    Package {
        start: locals.own.start,
        chunks: layout.chunks(),
        first: locals.first(),
        count: locals.own.len(),
        rest: locals.pick(&body.rest, spot.unwrap_or(DVec3::ZERO)),
        carries: body.elastic().decays(),
        sends: Vec::new(),
        receives: Vec::new(),
        watched: locals.watched(watched),
        watched_count: watched.len(),
    }
}

/// Models of a body's ranks.
pub(crate) struct Models<'a> {
    body: &'a Body,
    /// Materials of the body, each once, and which of them a node has.
    materials: Vec<Material>,
    material_of: Vec<u32>,
}

impl<'a> Models<'a> {
    pub(crate) fn new(body: &'a Body) -> Self {
        let elastic = body.elastic();
        let mut materials: Vec<Material> = Vec::new();
        let material_of = (0..elastic.node_count()).map(|node| {
            let material = elastic.material(node);
            let found = materials.iter().position(|known| known == material);
            number(found.unwrap_or_else(|| {
                materials.push(*material);
                materials.len() - 1
            }))
        });
        Self {
            body,
            material_of: material_of.collect(),
            materials,
        }
    }

    /// The model of a rank's nodes.
    pub(crate) fn of(&self, locals: &Locals) -> RankModel {
        let body = self.body;
        let view = elastic_stencils(&body.stencils, &body.neighborhoods);
        let state = body.elastic().state();
        let (mut offsets, mut indices, mut weights) = (Vec::new(), Vec::new(), Vec::new());
        offsets.resize(locals.padding() + 1, 0);
        for node in locals.nodes() {
            for (other, pair) in row(body, locals, node) {
                indices.push(other);
                weights.push(view.weights[pair]);
            }
            offsets.push(number(indices.len()));
        }
        let supports = body.motion().supports();
        let held = supports.fixed_nodes().into_iter();
        RankModel {
            volumes: locals.pick(body.elastic().volumes(), 1.0),
            masses: locals.pick(&body.masses, 1.0),
            offsets,
            indices,
            weights,
            matrices: locals.pick_whole(view.matrices, DMat3::ZERO),
            scales: locals.pick_whole(view.scales, 0.0),
            multipliers: locals.pick(view.multipliers, DVec3::ZERO),
            materials: self.materials.clone(),
            material_of: locals.pick(&self.material_of, 0),
            settings: *body.elastic().settings(),
            held: held.filter_map(|node| locals.local_of(node)).collect(),
            motion: *body.motion().settings(),
            supports: supports.part(locals.own.clone()),
            control_scales: of_rank(state.control, locals, |_| true),
            fronts: of_rank(state.fronts, locals, |_| true),
            weak: weak_nodes(body, locals, |_| true),
            offsets_of_gradients: of_rank(state.offsets, locals, |_| true),
        }
    }
}

impl RankModel {
    /// The model of the rank's nodes.
    pub(crate) fn elastic(&self, package: &Package) -> Result<Elastic, BodyProblem> {
        let mut elastic = Elastic::new(
            &Stencils {
                offsets: &self.offsets,
                indices: &self.indices,
                weights: &self.weights,
                matrices: &self.matrices,
                scales: &self.scales,
                multipliers: &self.multipliers,
            },
            &Nodes::new(&package.rest, &self.volumes),
            &Materials::PerNode {
                list: &self.materials,
                of_node: &self.material_of,
            },
            &self.settings,
        )?;
        elastic.set_held(&self.held);
        weaken(&mut elastic, &package.rest, &self.weak);
        elastic.set_state(&phyxel_elastic::State {
            offsets: self.offsets_of_gradients.clone(),
            control: self.control_scales.clone(),
            fronts: self.fronts.clone(),
            ..elastic.state()
        });
        elastic.watch_stiffness(&self.masses);
        Ok(elastic)
    }

    /// The motion of the rank's own nodes.
    pub(crate) fn motion(&self, package: &Package) -> Result<Motion, BodyProblem> {
        let own = package.first..package.first + package.count;
        Ok(Motion::new(
            &package.rest[own.clone()],
            &self.masses[own],
            self.supports.clone(),
            self.motion,
        )?)
    }
}

impl Package {
    /// Heap bytes.
    pub(crate) fn bytes(&self) -> usize {
        let sends: usize = self
            .sends
            .iter()
            .map(|(_, nodes)| size_of_val(&**nodes))
            .sum();
        size_of_val(&*self.rest) + sends
    }
}
