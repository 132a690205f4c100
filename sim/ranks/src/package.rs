//! What a rank is given: the model of its nodes and of those around them.
//!
//! Local nodes are, in this order: padding, ghosts below, own nodes, ghosts above; each part ascending by the
//! nodes' numbers in the body. So every row is summed in the body's order. The padding makes own nodes
//! begin at a multiple of the elastic model's runs, as they do in the body.

mod change;
mod locals;
mod weak;

use glam::{DMat3, DVec3};
use phyxel::{BodyProblem, Member, elastic_stencils};
use phyxel_elastic::{Elastic, Frame, Material, Materials, Nodes, Settings, Stencils};
use phyxel_integrate::{BoundaryConditions, Motion, MotionSettings};
use serde::{Deserialize, Serialize};

use crate::layout::Layout;
pub(crate) use change::Change;
pub(crate) use locals::{Locals, number};
use locals::{of_rank, row};
use weak::{Weak, carries, weak_nodes, weaken};

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
    frame: Frame,
    held: Vec<u32>,
    motion: MotionSettings,
    supports: BoundaryConditions,
    control_scales: Vec<(u32, f64)>,
    fronts: Vec<(u32, DMat3)>,
    weak: Vec<Weak>,
    /// Nodes with an offset of their deformation gradient, ascending, and these.
    offsets_of_gradients: Vec<(u32, ([f64; 9], f64))>,
    /// Whether any rank has such: works of their decay need forces evaluated where the nodes are.
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

/// Packages for all ranks, and which nodes each has.
pub(crate) fn packages(
    layout: &Layout,
    member: &Member,
    watched: &[u32],
) -> (Vec<Package>, Vec<Locals>) {
    let body = &member.body;
    let halos = layout.halos(|node| body.neighborhoods.row(node));
    let (materials, material_of) = materials_of(&body.elastic);
    let locals: Vec<Locals> = (0..)
        .zip(halos)
        .map(|(rank, halo)| Locals::new(layout.range(rank), halo))
        .collect();
    let mut packages: Vec<Package> = locals
        .iter()
        .map(|locals| package(layout, locals, member, (&materials, &material_of), watched))
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

fn package(
    layout: &Layout,
    locals: &Locals,
    member: &Member,
    (materials, material_of): (&[Material], &[u32]),
    watched: &[u32],
) -> Package {
    let body = &member.body;
    let range = locals.own.clone();
    let padding = locals.padding();
    let view = elastic_stencils(&body.stencils, &body.neighborhoods);
    let corrected = !view.multipliers.is_empty();
    let pad = |value: f64| vec![value; padding];
    let spot = body.rest.get(range.start).copied().unwrap_or(DVec3::ZERO);
    let state = body.elastic.state();
    let mut package = Package {
        start: range.start,
        chunks: layout.chunks(),
        first: locals.first(),
        count: range.len(),
        rest: vec![spot; padding],
        volumes: pad(1.0),
        masses: pad(1.0),
        offsets: vec![0; padding + 1],
        indices: Vec::new(),
        weights: Vec::new(),
        matrices: vec![DMat3::ZERO; padding],
        scales: if corrected { pad(0.0) } else { Vec::new() },
        multipliers: if corrected {
            vec![DVec3::ZERO; padding]
        } else {
            Vec::new()
        },
        materials: materials.to_vec(),
        material_of: vec![0; padding],
        settings: *body.elastic.settings(),
        frame: body.elastic.frame(),
        held: Vec::new(),
        motion: *body.motion.settings(),
        supports: body.motion.supports().part(range.clone()),
        control_scales: of_rank(state.control, locals, |_| true),
        fronts: of_rank(state.fronts, locals, |_| true),
        weak: Vec::new(),
        offsets_of_gradients: of_rank(state.offsets, locals, |_| true),
        carries: carries(member),
        sends: Vec::new(),
        receives: Vec::new(),
        watched: locals.watched(watched),
        watched_count: watched.len(),
    };
    for node in locals.nodes() {
        let at = node as usize;
        let whole = !locals.is_cut_off(node);
        package.rest.push(body.rest[at]);
        package.volumes.push(body.elastic.volumes()[at]);
        package.masses.push(body.masses[at]);
        package.material_of.push(material_of[at]);
        for (other, pair) in row(member, locals, node) {
            package.indices.push(other);
            package.weights.push(view.weights[pair]);
        }
        package.offsets.push(number(package.indices.len()));
        package.matrices.push(if whole {
            view.matrices[at]
        } else {
            DMat3::ZERO
        });
        if corrected {
            package
                .scales
                .push(if whole { view.scales[at] } else { 0.0 });
            package.multipliers.push(view.multipliers[at]);
        }
    }
    let supports = body.motion.supports().entries().iter();
    let fixed = supports.filter(|s| s.free == DMat3::ZERO && s.path.is_none());
    package.held = fixed.filter_map(|s| locals.local_of(s.node)).collect();
    package.weak = weak_nodes(member, locals, |_| true);
    package
}

impl Package {
    /// The model of the rank's nodes.
    pub(crate) fn elastic(&self) -> Result<Elastic, BodyProblem> {
        let mut elastic = Elastic::in_frame(
            &self.frame,
            &Stencils {
                offsets: &self.offsets,
                indices: &self.indices,
                weights: &self.weights,
                matrices: &self.matrices,
                scales: &self.scales,
                multipliers: &self.multipliers,
            },
            &Nodes::new(&self.rest, &self.volumes),
            &Materials::PerNode {
                list: &self.materials,
                of_node: &self.material_of,
            },
            &self.settings,
        )?;
        elastic.set_held(&self.held);
        weaken(&mut elastic, &self.rest, &self.weak);
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
    pub(crate) fn motion(&self) -> Result<Motion, BodyProblem> {
        let own = self.first..self.first + self.count;
        Ok(Motion::new(
            &self.rest[own.clone()],
            &self.masses[own],
            self.supports.clone(),
            self.motion,
        )?)
    }
}

/// Materials of a body, each once, and which of them a node has.
fn materials_of(elastic: &Elastic) -> (Vec<Material>, Vec<u32>) {
    let mut list: Vec<Material> = Vec::new();
    let of_node = (0..elastic.node_count()).map(|node| {
        let material = elastic.material(node);
        let found = list.iter().position(|known| known == material);
        number(found.unwrap_or_else(|| {
            list.push(*material);
            list.len() - 1
        }))
    });
    let of_node = of_node.collect();
    if list.is_empty() {
        list.extend((elastic.node_count() > 0).then(|| *elastic.material(0)));
    }
    (list, of_node)
}

impl Package {
    /// Drops what only the building of models needs.
    pub(crate) fn forget_rows(&mut self) {
        self.offsets = Vec::new();
        self.indices = Vec::new();
        self.weights = Vec::new();
        self.matrices = Vec::new();
        self.scales = Vec::new();
        self.multipliers = Vec::new();
        self.volumes = Vec::new();
        self.masses = Vec::new();
        self.material_of = Vec::new();
        self.held = Vec::new();
        self.control_scales = Vec::new();
        self.fronts = Vec::new();
        self.weak = Vec::new();
        self.offsets_of_gradients = Vec::new();
    }

    /// Heap bytes of what is left then.
    pub(crate) fn bytes(&self) -> usize {
        let sends: usize = self
            .sends
            .iter()
            .map(|(_, nodes)| size_of_val(&**nodes))
            .sum();
        size_of_val(&*self.rest) + sends
    }
}
