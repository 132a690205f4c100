//! What a rank is given: the model of its nodes and of those round them.
//!
//! Local nodes are, in this order: padding, ghosts below, own nodes, ghosts above; each part rising by the
//! nodes' numbers in the body. So every row is summed in the body's order. The padding makes own nodes
//! begin at a multiple of the elastic model's runs, as they do in the body.

use glam::{DMat3, DVec3};
use phyxel::world::{BodyProblem, Cutting, Member};
use phyxel_elastic::{
    Elastic, Frame, Material, Materials, Nodes, Offsets, Settings, Stencils, WATCHED_NODES,
};
use phyxel_integrate::{Motion, MotionSettings, Supports};
use serde::{Deserialize, Serialize};

use crate::layout::{Halo, Layout};

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
    supports: Supports,
    control_scales: Vec<(u32, f64)>,
    /// Weak nodes with the share that cuts left of each of their pairs, and offsets (m) of their bonds.
    weak: Vec<(u32, Vec<f64>)>,
    bond_offsets: Vec<f64>,
    /// Nodes with an offset of their deformation gradient, and these.
    offset_nodes: Vec<u32>,
    offsets_of_gradients: Vec<[f64; 9]>,
    /// Whether any rank has such: works of their decay need forces evaluated where the nodes are.
    pub(crate) carries: bool,
    /// Ranks that need places of own nodes, with the local numbers of these.
    pub(crate) sends: Vec<(usize, Vec<u32>)>,
    /// Ranks whose nodes are ghosts here, with the local number of the first and how many.
    pub(crate) receives: Vec<(usize, usize, usize)>,
    /// Own nodes, counted from the first, that rank 0 sees in every step, and their places among all such.
    pub(crate) watched: Vec<(u32, u32)>,
    /// How many nodes rank 0 sees in every step.
    pub(crate) watched_count: usize,
}

/// A rank's ghosts in their order, and where its own nodes begin among them.
fn ghosts(layout: &Layout, rank: usize, halo: &Halo) -> (Vec<u32>, usize) {
    let mut all: Vec<u32> = halo.first.iter().chain(&halo.second).copied().collect();
    all.sort_unstable();
    let start = layout.range(rank).start;
    let below = all.partition_point(|&node| (node as usize) < start);
    (all, below)
}

/// Packages for all ranks.
pub(crate) fn packages(layout: &Layout, member: &Member, watched: &[u32]) -> Vec<Package> {
    let body = &member.body;
    let halos = layout.halos(|node| body.neighborhoods.row(node));
    let (materials, material_of) = materials_of(&body.elastic);
    let parts: Vec<(Vec<u32>, usize)> = (0..layout.ranks())
        .map(|rank| ghosts(layout, rank, &halos[rank]))
        .collect();
    let mut packages: Vec<Package> = (0..layout.ranks())
        .map(|rank| {
            package(
                (layout, rank),
                member,
                (&halos[rank], &parts[rank]),
                (&materials, &material_of),
                watched,
            )
        })
        .collect();
    for rank in 0..layout.ranks() {
        let (all, below) = &parts[rank];
        let (all, below) = (&all[..], *below);
        let own = layout.range(rank).len();
        let first = packages[rank].first;
        let mut at = 0;
        while at < all.len() {
            let owner = layout.rank_of(all[at] as usize);
            let range = layout.range(owner);
            let run = all[at..].partition_point(|&node| (node as usize) < range.end);
            let local = if at < below {
                first - below + at
            } else {
                first + own + at - below
            };
            packages[rank].receives.push((owner, local, run));
            let offset = packages[owner].first;
            let nodes = all[at..at + run].iter();
            let nodes = nodes.map(|&node| number(offset + node as usize - range.start));
            let nodes = nodes.collect();
            packages[owner].sends.push((rank, nodes));
            at += run;
        }
    }
    packages
}

fn package(
    (layout, rank): (&Layout, usize),
    member: &Member,
    (halo, (ghosts, below)): (&Halo, &(Vec<u32>, usize)),
    (materials, material_of): (&[Material], &[u32]),
    watched: &[u32],
) -> Package {
    let body = &member.body;
    let range = layout.range(rank);
    let first = below.next_multiple_of(WATCHED_NODES);
    let own = (range.start..range.end).map(number);
    let nodes: Vec<u32> = ghosts[..*below]
        .iter()
        .copied()
        .chain(own)
        .chain(ghosts[*below..].iter().copied())
        .collect();
    let padding = first - below;
    let local_of = |node: u32| {
        let at = node as usize;
        if range.contains(&at) {
            return Some(number(first + at - range.start));
        }
        let at = ghosts.binary_search(&node).ok()?;
        Some(number(if at < *below {
            padding + at
        } else {
            first + range.len() + at - below
        }))
    };
    let view = body.stencils.view(&body.neighborhoods);
    let corrected = !view.multipliers.is_empty();
    let pad = |value: f64| vec![value; padding];
    let spot = body.rest.get(range.start).copied().unwrap_or(DVec3::ZERO);
    let mut package = Package {
        start: range.start,
        chunks: layout.chunks(),
        first,
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
        control_scales: Vec::new(),
        weak: Vec::new(),
        bond_offsets: Vec::new(),
        offset_nodes: Vec::new(),
        offsets_of_gradients: Vec::new(),
        carries: body.elastic.has_offsets() || !body.elastic.weak_nodes().is_empty(),
        sends: Vec::new(),
        receives: Vec::new(),
        watched: Vec::new(),
        watched_count: watched.len(),
    };
    for &node in &nodes {
        let at = node as usize;
        // Rows of the second layer are cut off: they see nothing, and nobody reads what they give.
        let whole = halo.second.binary_search(&node).is_err();
        package.rest.push(body.rest[at]);
        package.volumes.push(body.elastic.volumes()[at]);
        package.masses.push(body.masses[at]);
        package.material_of.push(material_of[at]);
        for (&other, pair) in body
            .neighborhoods
            .row(at)
            .iter()
            .zip(body.neighborhoods.pairs(at))
        {
            if let Some(other) = local_of(other) {
                package.indices.push(other);
                package.weights.push(view.weights[pair]);
            }
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
    package.held = fixed.filter_map(|s| local_of(s.node)).collect();
    let scales = body.elastic.control_scales();
    let scales = scales.iter();
    package.control_scales = scales
        .filter(|(node, _)| halo.second.binary_search(node).is_err())
        .filter_map(|&(node, scale)| Some((local_of(node)?, scale)))
        .collect();
    // The local number of a node whose row is whole here.
    let whole = |node: u32| {
        let cut_off = halo.second.binary_search(&node).is_ok();
        local_of(node).filter(|_| !cut_off)
    };
    // Without a cut, weak nodes are those at corners of what is held.
    let factors = member.cutting.as_ref().map(Cutting::factors);
    for &node in body.elastic.weak_nodes() {
        if let Some(local) = whole(node) {
            let pairs = body.neighborhoods.pairs(node as usize);
            let left = |pair| factors.map_or(1.0, |factors| factors.factor(pair));
            package.weak.push((local, pairs.map(left).collect()));
        }
    }
    let bonds = body.elastic.bond_energies();
    let bonds = bonds.iter().zip(body.elastic.bond_offsets());
    let bonds = bonds.filter(|((node, _), _)| whole(*node).is_some());
    package.bond_offsets = bonds.map(|(_, offset)| offset).collect();
    let offsets = body.elastic.offsets();
    for (&node, value) in offsets.nodes.iter().zip(&offsets.values) {
        if let Some(local) = whole(node) {
            package.offset_nodes.push(local);
            package.offsets_of_gradients.push(*value);
        }
    }
    package.watched = (0_u32..)
        .zip(watched)
        .filter(|(_, node)| range.contains(&(**node as usize)))
        .map(|(place, &node)| (number(node as usize - range.start), place))
        .collect();
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
        for (node, shares) in &self.weak {
            let first = self.offsets[*node as usize] as usize;
            let share = |pair: usize| shares.get(pair - first).copied().unwrap_or(0.0);
            elastic.weaken(&[*node], &self.rest, &share);
        }
        elastic.set_bond_offsets(&self.bond_offsets);
        elastic.set_offsets(&Offsets {
            nodes: self.offset_nodes.clone(),
            values: self.offsets_of_gradients.clone(),
        });
        elastic.set_control_scales(&self.control_scales);
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

/// A count as the graph has it.
pub(crate) fn number(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
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
        self.weak = Vec::new();
        self.bond_offsets = Vec::new();
        self.offset_nodes = Vec::new();
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
