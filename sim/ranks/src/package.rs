//! What a rank is given: the model of its nodes and of those round them.
//!
//! Local nodes are, in this order: padding, ghosts below, own nodes, ghosts above; each part rising by the
//! nodes' numbers in the body. So every row is summed in the body's order. The padding makes own nodes
//! begin at a multiple of the elastic model's runs, as they do in the body.

use std::ops::Range;

use glam::{DMat3, DVec3};
use phyxel::world::{BodyProblem, Cutting, Member};
use phyxel_elastic::{
    Elastic, Frame, Material, Materials, Nodes, Offsets, Rows, Settings, Stencils, WATCHED_NODES,
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
    fronts: Vec<(u32, DMat3)>,
    weak: Vec<Weak>,
    /// Nodes with an offset of their deformation gradient, rising, and these.
    offsets_of_gradients: Vec<(u32, [f64; 9])>,
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

/// A weak node.
#[derive(Debug, Serialize, Deserialize)]
struct Weak {
    node: u32,
    /// What cuts left of each of its pairs.
    shares: Vec<f64>,
    /// Offsets (m) of its bonds.
    offsets: Vec<f64>,
}

/// Nodes of a rank, by their numbers in the body.
#[derive(Debug)]
pub(crate) struct Locals {
    /// Own nodes.
    own: Range<usize>,
    /// Others, rising, and how many of them come before the own ones.
    ghosts: Vec<u32>,
    below: usize,
    /// Those of them whose rows are cut off, rising.
    cut_off: Vec<u32>,
}

impl Locals {
    fn new(own: Range<usize>, halo: Halo) -> Self {
        let mut ghosts: Vec<u32> = halo.first.iter().chain(&halo.second).copied().collect();
        ghosts.sort_unstable();
        Self {
            below: ghosts.partition_point(|&node| (node as usize) < own.start),
            ghosts,
            own,
            cut_off: halo.second,
        }
    }

    /// Local number of the first own node.
    fn first(&self) -> usize {
        self.below.next_multiple_of(WATCHED_NODES)
    }

    fn padding(&self) -> usize {
        self.first() - self.below
    }

    /// All but the padding, rising.
    fn nodes(&self) -> Vec<u32> {
        let own = self.own.clone().map(number);
        let (below, above) = self.ghosts.split_at(self.below);
        let below = below.iter().copied();
        below.chain(own).chain(above.iter().copied()).collect()
    }

    /// Local number of the ghost at a place among them.
    fn ghost(&self, at: usize) -> usize {
        if at < self.below {
            self.padding() + at
        } else {
            self.first() + self.own.len() + at - self.below
        }
    }

    /// Local number of a node, if it has one; of a larger node a larger one.
    fn local_of(&self, node: u32) -> Option<u32> {
        let at = node as usize;
        if self.own.contains(&at) {
            return Some(number(self.first() + at - self.own.start));
        }
        let at = self.ghosts.binary_search(&node).ok()?;
        Some(number(self.ghost(at)))
    }

    /// The same of a node whose row is whole here.
    fn whole(&self, node: u32) -> Option<u32> {
        self.local_of(node).filter(|_| !self.is_cut_off(node))
    }

    /// Whether a row is cut off: it sees nothing, and nobody reads what it gives.
    fn is_cut_off(&self, node: u32) -> bool {
        self.cut_off.binary_search(&node).is_ok()
    }

    /// Own ones of nodes that rank 0 sees in every step.
    fn watched(&self, watched: &[u32]) -> Vec<(u32, u32)> {
        let own = (0_u32..)
            .zip(watched)
            .filter(|(_, node)| self.own.contains(&(**node as usize)));
        own.map(|(place, &node)| (number(node as usize - self.own.start), place))
            .collect()
    }
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
    let view = body.stencils.view(&body.neighborhoods);
    let corrected = !view.multipliers.is_empty();
    let pad = |value: f64| vec![value; padding];
    let spot = body.rest.get(range.start).copied().unwrap_or(DVec3::ZERO);
    let elastic = &body.elastic;
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
        control_scales: of_rank(elastic.control_scales(), locals, |_| true),
        fronts: of_rank(elastic.fronts(), locals, |_| true),
        weak: Vec::new(),
        offsets_of_gradients: of_rank(gradient_offsets(elastic), locals, |_| true),
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

/// Neighbours of a node that a rank has, by their local numbers, and their pairs in the body.
fn row<'a>(
    member: &'a Member,
    locals: &'a Locals,
    node: u32,
) -> impl Iterator<Item = (u32, usize)> + 'a {
    let graph = &member.body.neighborhoods;
    let all = graph.row(node as usize).iter();
    all.zip(graph.pairs(node as usize))
        .filter_map(|(&other, pair)| Some((locals.local_of(other)?, pair)))
}

/// Whether the body has anything that decays.
fn carries(member: &Member) -> bool {
    let elastic = &member.body.elastic;
    elastic.has_offsets() || !elastic.weak_nodes().is_empty()
}

/// What a list by nodes of the body says of those nodes of a rank whose rows are whole there, of some.
fn of_rank<T>(
    list: impl IntoIterator<Item = (u32, T)>,
    locals: &Locals,
    some: impl Fn(u32) -> bool,
) -> Vec<(u32, T)> {
    let list = list.into_iter().filter(|(node, _)| some(*node));
    list.filter_map(|(node, value)| Some((locals.whole(node)?, value)))
        .collect()
}

/// Offsets of deformation gradients by nodes.
fn gradient_offsets(elastic: &Elastic) -> impl Iterator<Item = (u32, [f64; 9])> {
    let Offsets { nodes, values } = elastic.offsets();
    nodes.into_iter().zip(values)
}

/// Weak ones of a rank's nodes, of some.
fn weak_nodes(member: &Member, locals: &Locals, some: impl Fn(u32) -> bool) -> Vec<Weak> {
    let body = &member.body;
    // Without a cut, weak nodes are those at corners of what is held.
    let factors = member.cutting.as_ref().map(Cutting::factors);
    let left = |pair| factors.map_or(1.0, |factors| factors.factor(pair));
    let bonds = body.elastic.bond_energies();
    let offsets = body.elastic.bond_offsets();
    let mut weak = Vec::new();
    for &node in body.elastic.weak_nodes().iter().filter(|node| some(**node)) {
        if let Some(local) = locals.whole(node) {
            let from = bonds.partition_point(|(of, _)| *of < node);
            let to = bonds.partition_point(|(of, _)| *of <= node);
            let pairs = body.neighborhoods.pairs(node as usize);
            weak.push(Weak {
                node: local,
                shares: pairs.map(left).collect(),
                offsets: offsets[from..to].to_vec(),
            });
        }
    }
    weak
}

/// Takes the strain energy from weak nodes of a rank's model.
fn weaken(elastic: &mut Elastic, rest: &[DVec3], weak: &[Weak]) {
    if weak.is_empty() {
        return;
    }
    let nodes: Vec<u32> = weak.iter().map(|weak| weak.node).collect();
    let starts: Vec<usize> = nodes
        .iter()
        .map(|&node| elastic.pairs_of(node).start)
        .collect();
    let share = |pair: usize| {
        // Pairs are only asked for of these nodes.
        let at = starts.partition_point(|start| *start <= pair) - 1;
        weak[at]
            .shares
            .get(pair - starts[at])
            .copied()
            .unwrap_or(0.0)
    };
    elastic.weaken(&nodes, rest, &share);
    let bonds = elastic.bond_energies();
    let mut offsets = elastic.bond_offsets();
    for weak in weak {
        let from = bonds.partition_point(|(of, _)| *of < weak.node);
        let to = offsets.iter_mut().skip(from);
        for (to, offset) in to.zip(&weak.offsets) {
            *to = *offset;
        }
    }
    elastic.set_bond_offsets(&offsets);
}

/// Sets offsets of deformation gradients, rising.
fn set_offsets(elastic: &mut Elastic, offsets: &[(u32, [f64; 9])]) {
    let (nodes, values) = offsets.iter().copied().unzip();
    elastic.set_offsets(&Offsets { nodes, values });
}

/// What a cut changes in a rank's model.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Change {
    /// Local nodes whose rows it has rebuilt, rising, and whether these are whole here.
    nodes: Vec<u32>,
    whole: Vec<bool>,
    /// Weights of all those rows, which have no more digits.
    weights: Vec<f32>,
    /// Matrices and scales of whole ones.
    matrices: Vec<DMat3>,
    scales: Vec<f64>,
    /// Multipliers of nodes in those rows.
    multipliers: Vec<(u32, DVec3)>,
    /// What those nodes have, if anything; others of the rank stay as they are.
    control_scales: Vec<(u32, f64)>,
    fronts: Vec<(u32, DMat3)>,
    weak: Vec<Weak>,
    offsets_of_gradients: Vec<(u32, [f64; 9])>,
    carries: bool,
    /// Who is watched from now on, as in a package; `None` for those of before.
    watched: Option<(Vec<(u32, u32)>, usize)>,
}

impl Change {
    /// The rank's part of a change of the rows of `nodes`, rising; `watched` if others are than before.
    pub(crate) fn new(
        locals: &Locals,
        member: &Member,
        nodes: &[u32],
        watched: Option<&[u32]>,
    ) -> Self {
        let view = member.body.stencils.view(&member.body.neighborhoods);
        let corrected = !view.multipliers.is_empty();
        let is_changed = |node: u32| nodes.binary_search(&node).is_ok();
        let elastic = &member.body.elastic;
        let mut change = Self {
            nodes: Vec::new(),
            whole: Vec::new(),
            weights: Vec::new(),
            matrices: Vec::new(),
            scales: Vec::new(),
            multipliers: Vec::new(),
            control_scales: of_rank(elastic.control_scales(), locals, is_changed),
            fronts: of_rank(elastic.fronts(), locals, is_changed),
            weak: weak_nodes(member, locals, is_changed),
            offsets_of_gradients: of_rank(gradient_offsets(elastic), locals, is_changed),
            carries: carries(member),
            watched: watched.map(|watched| (locals.watched(watched), watched.len())),
        };
        // Nodes in the rows, by their numbers in the body.
        let mut seen = Vec::new();
        for &node in nodes {
            let Some(local) = locals.local_of(node) else {
                continue;
            };
            let (at, whole) = (node as usize, !locals.is_cut_off(node));
            change.nodes.push(local);
            change.whole.push(whole);
            #[allow(
                clippy::cast_possible_truncation,
                reason = "models keep weights as f32"
            )]
            let weights = row(member, locals, node).map(|(_, pair)| view.weights[pair] as f32);
            change.weights.extend(weights);
            seen.push(node);
            if whole {
                change.matrices.push(view.matrices[at]);
                seen.extend_from_slice(member.body.neighborhoods.row(at));
                if corrected {
                    change.scales.push(view.scales[at]);
                }
            }
        }
        if corrected {
            seen.sort_unstable();
            seen.dedup();
            let known = seen.into_iter().filter_map(|node| {
                let local = locals.local_of(node)?;
                Some((local, view.multipliers[node as usize]))
            });
            change.multipliers = known.collect();
        }
        change
    }

    /// Takes it into the model.
    pub(crate) fn apply(
        self,
        elastic: &mut Elastic,
        package: &mut Package,
    ) -> Result<(), BodyProblem> {
        if let Some((watched, count)) = self.watched {
            package.watched = watched;
            package.watched_count = count;
        }
        package.carries = self.carries;
        if self.nodes.is_empty() {
            return Ok(());
        }
        let corrected = !self.multipliers.is_empty();
        let (mut matrices, mut scales) = (self.matrices.into_iter(), self.scales.into_iter());
        let (mut all_matrices, mut all_scales) = (Vec::new(), Vec::new());
        for whole in self.whole {
            let matrix = if whole { matrices.next() } else { None };
            let scale = if whole { scales.next() } else { None };
            all_matrices.push(matrix.unwrap_or(DMat3::ZERO));
            if corrected {
                all_scales.push(scale.unwrap_or(0.0));
            }
        }
        let weights: Vec<f64> = self.weights.into_iter().map(f64::from).collect();
        elastic.take_rows(&Rows {
            nodes: &self.nodes,
            weights: &weights,
            matrices: &all_matrices,
            scales: &all_scales,
            multipliers: &self.multipliers,
        })?;
        weaken(elastic, &package.rest, &self.weak);
        let Offsets { nodes, values } = elastic.offsets();
        let offsets = nodes.into_iter().zip(values).collect();
        let offsets = replaced(offsets, &self.nodes, self.offsets_of_gradients);
        set_offsets(elastic, &offsets);
        let scales = elastic.control_scales();
        elastic.set_control_scales(&replaced(scales, &self.nodes, self.control_scales));
        let fronts = elastic.fronts();
        elastic.restore_fronts(&replaced(fronts, &self.nodes, self.fronts));
        Ok(())
    }
}

/// A list by nodes, rising, with what `new` says of `nodes`.
fn replaced<T>(mut list: Vec<(u32, T)>, nodes: &[u32], new: Vec<(u32, T)>) -> Vec<(u32, T)> {
    list.retain(|(node, _)| nodes.binary_search(node).is_err());
    list.extend(new);
    list.sort_by_key(|(node, _)| *node);
    list
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
        set_offsets(&mut elastic, &self.offsets_of_gradients);
        elastic.set_control_scales(&self.control_scales);
        elastic.restore_fronts(&self.fronts);
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
