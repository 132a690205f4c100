//! Which nodes carry a surfel.

use crate::cast::index;
use crate::render::Surfel;
use crate::tissue::NodeTree;
use glam::{DVec2, DVec3};

/// How the weight of a node that carries a surfel falls with its distance d.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum WeightLaw {
    /// To 0 a little beyond the farthest, so that a node on its way out fades: `(1 - d²/h²)²` with h = 1.1
    /// times the distance of the farthest node.
    #[default]
    Compact,
    /// By a bell, `exp(-d²/h²)` with h the distance of the farthest node (Aras 2014, eq. (58)).
    Gaussian,
}

/// Nodes looked at in order of distance before a surfel is content with fewer than it may have: more would hide more of a
/// cut's diffraction at some cost. A surfel that sees fewer than four of them (on a small piece beside a ragged cut)
/// takes those that these see, too.
const POOL: usize = 48;

/// Nodes and weights of every surfel: rows of fixed length, CSR with `offsets[i] = i * stride`.
///
/// Row i holds the nodes in order of distance; weights are those at the disk's middle and sum to 1. They are at least 0
/// but where a cut hides the middle: there they are those of a point that is seen, followed along their slopes. A
/// row with fewer nodes than the stride is padded with its first node at weight 0.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Binding {
    stride: usize,
    nodes: Vec<u32>,
    weights: Vec<f64>,
    /// Change of the weights along the surfel's two tangents (1/m).
    slopes: Vec<[f64; 2]>,
    /// Distance within which the surfel's nodes were sought (m): that of the farthest, or more where cuts hide all
    /// others.
    pub(super) reach: Vec<f64>,
    pub(super) sight: Vec<Sight>,
}

/// What cuts leave of a surfel's sight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sight {
    /// It sees the nearest nodes.
    Clear,
    /// It sees all of its nodes, but not some that are nearer.
    Behind,
    /// Some of its nodes are seen around a corner or by others, or it has few.
    Poor,
}

/// Pools of nodes after which a surfel that has seen none gives up: it is on a fragment without a node.
/// A longer search costs a long line of sight through the whole cut for every node of the body.
const POOLS: usize = 4;
/// Nodes below which a surfel takes what its nodes see.
const FEW: usize = 4;

/// One row before it is stored.
pub(crate) struct Row {
    nodes: Vec<u32>,
    weights: Vec<f64>,
    slopes: Vec<[f64; 2]>,
    reach: f64,
    sight: Sight,
}

impl Binding {
    /// An empty binding with rows of `min(neighbors, node_count)` entries.
    pub(crate) fn empty(neighbors: usize, node_count: usize) -> Self {
        Self {
            stride: neighbors.min(node_count).max(1),
            ..Self::default()
        }
    }

    /// Heap bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
            + size_of_val(&*self.weights)
            + size_of_val(&*self.slopes)
            + size_of_val(&*self.reach)
            + size_of_val(&*self.sight)
    }

    /// Entries per row.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Nodes and weights of one surfel.
    ///
    /// # Panics
    /// If `surfel` is out of range.
    #[must_use]
    #[inline]
    pub fn row(&self, surfel: usize) -> (&[u32], &[f64]) {
        let range = surfel * self.stride..(surfel + 1) * self.stride;
        (&self.nodes[range.clone()], &self.weights[range])
    }

    /// Mean of the nodes' values by the weights that carry one surfel.
    ///
    /// # Panics
    /// If `surfel` is out of range, or a node has no value.
    #[must_use]
    pub fn mean(&self, surfel: usize, values: &[f64]) -> f64 {
        let (nodes, weights) = self.row(surfel);
        let pairs = nodes.iter().zip(weights);
        pairs.map(|(&node, w)| w * values[node as usize]).sum()
    }

    /// Change of a surfel's weights along its two tangents (1/m), see
    /// [`crate::Surfel::tangents`]; each sums to 0.
    ///
    /// # Panics
    /// If `surfel` is out of range.
    #[must_use]
    #[inline]
    pub fn slopes(&self, surfel: usize) -> &[[f64; 2]] {
        &self.slopes[surfel * self.stride..(surfel + 1) * self.stride]
    }

    /// Takes nodes, weights and slopes out; the rest stays.
    pub(super) fn take_rows(&mut self) -> Self {
        Self {
            stride: self.stride,
            nodes: std::mem::take(&mut self.nodes),
            weights: std::mem::take(&mut self.weights),
            slopes: std::mem::take(&mut self.slopes),
            ..Self::default()
        }
    }

    /// Puts nodes, weights and slopes in: those of the first `count` rows of `of`, but of `rows` those of `others`.
    pub(super) fn put_rows(&mut self, of: &Self, count: usize, rows: &[u32], others: &Self) {
        let end = count * of.stride;
        self.nodes = of.nodes[..end].to_vec();
        self.weights = of.weights[..end].to_vec();
        self.slopes = of.slopes[..end].to_vec();
        for (k, &row) in rows.iter().enumerate() {
            let (nodes, weights, slopes) = self.row_mut(row as usize);
            let (own_nodes, own_weights) = others.row(k);
            nodes.copy_from_slice(own_nodes);
            weights.copy_from_slice(own_weights);
            slopes.copy_from_slice(others.slopes(k));
        }
    }

    /// Nodes, weights and slopes of some rows.
    pub(super) fn selected(&self, rows: &[u32]) -> Self {
        let mut selected = Self {
            stride: self.stride,
            ..Self::default()
        };
        for &row in rows {
            let (nodes, weights) = self.row(row as usize);
            selected.nodes.extend_from_slice(nodes);
            selected.weights.extend_from_slice(weights);
            let slopes = self.slopes(row as usize);
            selected.slopes.extend_from_slice(slopes);
        }
        selected
    }

    /// Whether a row has bitwise the same nodes, weights and slopes as that of another binding.
    pub(super) fn is_same_row(&self, other: &Self, row: usize) -> bool {
        let numbers = |own: &'_ Self| -> Vec<u64> {
            let slopes = own.slopes(row).as_flattened().iter();
            let numbers = own.row(row).1.iter().chain(slopes);
            numbers.map(|number| number.to_bits()).collect()
        };
        self.row(row).0 == other.row(row).0 && numbers(self) == numbers(other)
    }

    /// Appends rows that hold node 0 until they are replaced.
    pub(crate) fn extend_to(&mut self, rows: usize) {
        self.nodes.resize(rows * self.stride, 0);
        self.weights.resize(rows * self.stride, 0.0);
        self.slopes.resize(rows * self.stride, [0.0; 2]);
        self.reach.resize(rows, 0.0);
        self.sight.resize(rows, Sight::Clear);
    }

    /// Nodes, weights and slopes of one surfel, to be replaced.
    fn row_mut(&mut self, surfel: usize) -> (&mut [u32], &mut [f64], &mut [[f64; 2]]) {
        let range = surfel * self.stride..(surfel + 1) * self.stride;
        (
            &mut self.nodes[range.clone()],
            &mut self.weights[range.clone()],
            &mut self.slopes[range],
        )
    }

    /// Replaces one row.
    pub(crate) fn store(&mut self, surfel: usize, row: &Row) {
        let (nodes, weights, slopes) = self.row_mut(surfel);
        nodes.fill(row.nodes[0]);
        weights.fill(0.0);
        slopes.fill([0.0; 2]);
        slopes[..row.slopes.len()].copy_from_slice(&row.slopes);
        nodes[..row.nodes.len()].copy_from_slice(&row.nodes);
        weights[..row.weights.len()].copy_from_slice(&row.weights);
        self.reach[surfel] = row.reach;
        self.sight[surfel] = row.sight;
    }

    /// Leaves a surfel the nodes of that piece which carries most of it; whether others carried it, too.
    pub(crate) fn keep_to_one(&mut self, surfel: usize, pieces: &[u32]) -> bool {
        let (nodes, weights, slopes) = self.row_mut(surfel);
        let piece = |node: u32| pieces[index(node)];
        if nodes.iter().all(|&node| piece(node) == piece(nodes[0])) {
            return false;
        }
        let share = |of: &u32| -> f64 {
            let all = nodes.iter().zip(&*weights);
            let own = all.filter(|(node, _)| piece(**node) == piece(*of));
            own.map(|(_, weight)| weight).sum()
        };
        let most = nodes.iter().max_by(|a, b| share(a).total_cmp(&share(b)));
        let kept = *most.expect("a row has nodes");
        for ((node, weight), slope) in nodes.iter_mut().zip(&mut *weights).zip(&mut *slopes) {
            if piece(*node) != piece(kept) {
                (*node, *weight, *slope) = (kept, 0.0, [0.0; 2]);
            }
        }
        normalize(weights, slopes);
        true
    }
}

/// The nodes at rest, and what cuts leave of sight.
pub(crate) struct Search<'a> {
    pub(crate) law: WeightLaw,
    /// Nodes of a row at most.
    pub(crate) stride: usize,
    pub(crate) nodes: &'a [DVec3],
    pub(crate) tree: &'a NodeTree,
    /// Whether two points see each other.
    pub(crate) visible: &'a (dyn Fn(DVec3, DVec3) -> bool + Sync),
    /// The point within a distance at which a path goes around the end of a cut.
    pub(crate) way_round: &'a (dyn Fn(&Query, f64) -> Option<DVec3> + Sync),
}

impl Search<'_> {
    /// The row of a surfel.
    pub(crate) fn row(&self, query: &Query) -> Row {
        let eye = query.eye;
        let Look {
            mut found,
            hidden,
            nearest,
            horizon,
        } = self.look(eye);
        let seen = found.len();
        let mut direct = true;
        if !hidden.is_empty()
            && seen > 0
            && let Some(corner) = (self.way_round)(query, horizon)
        {
            let links = hidden
                .iter()
                .map(|&node| (node, self.nodes[index(node)]))
                .map(|(node, at)| (Link::round(eye, corner, at, node), at))
                .filter(|(link, _)| link.length <= horizon || seen < self.stride)
                .filter(|&(_, at)| (self.visible)(corner, at));
            found.extend(links.map(|(link, _)| link));
            sort(&mut found);
            found.truncate(self.stride);
            direct = found.iter().all(|link| link.straight);
        }
        direct &= seen == self.stride;
        if (1..FEW.min(self.stride)).contains(&found.len()) {
            self.look_by_nodes(eye, &mut found);
        }
        // Where sight is short, farther nodes may come in when a cut changes.
        let sought = if found.len() < self.stride || !direct {
            horizon
        } else {
            0.0
        };
        // Nothing visible at all (a fragment of tissue without a node): the nearest node carries it.
        if found.is_empty() {
            found.extend(nearest);
        }
        sort(&mut found);
        let reach = found.last().map_or(0.0, |link| link.length);
        let (mut weights, slopes) = weights(&found, self.law, query.normal, reach);
        // Carrying takes weights at the disk's middle: those of the anchor, followed along their slopes.
        for (weight, slope) in weights.iter_mut().zip(&slopes) {
            *weight -= slope[0] * query.anchor.x + slope[1] * query.anchor.y;
        }
        Row {
            nodes: found.into_iter().map(|link| link.node).collect(),
            weights,
            slopes,
            reach: if seen == 0 { reach } else { reach.max(sought) },
            sight: match (direct, hidden.is_empty()) {
                (false, _) => Sight::Poor,
                (true, false) => Sight::Behind,
                (true, true) => Sight::Clear,
            },
        }
    }

    /// The nearest nodes that the eye sees, and those that it does not.
    fn look(&self, eye: DVec3) -> Look {
        let mut look = Look::default();
        for (looked, node) in self.tree.nearest_neighbor_iter(eye.to_array()).enumerate() {
            let at = self.nodes[index(node.data)];
            let link = Link::straight(eye, at, node.data);
            look.nearest.get_or_insert(link);
            // With nothing in sight the search continues: better a far node of the own piece than a
            // near one of another.
            let pools = if look.found.is_empty() { POOLS } else { 1 };
            let most = pools * POOL;
            if look.found.len() == self.stride || looked >= most {
                break;
            }
            look.horizon = link.length;
            if (self.visible)(eye, at) {
                look.found.push(link);
            } else {
                look.hidden.push(node.data);
            }
        }
        look
    }

    /// Adds nodes that those found see.
    fn look_by_nodes(&self, eye: DVec3, found: &mut Vec<Link>) {
        let seen = found.len();
        let near = self.tree.nearest_neighbor_iter(eye.to_array());
        for node in near.take(POOL) {
            let at = self.nodes[index(node.data)];
            let known = found.iter().any(|link| link.node == node.data);
            let by_another = |link: &Link| (self.visible)(self.nodes[index(link.node)], at);
            if !known && found[..seen].iter().any(by_another) {
                found.push(Link::straight(eye, at, node.data));
            }
            if found.len() == self.stride {
                break;
            }
        }
    }
}

/// What an eye sees of the nodes around it.
#[derive(Default)]
struct Look {
    found: Vec<Link>,
    hidden: Vec<u32>,
    nearest: Option<Link>,
    /// Distance of the farthest node looked at (m).
    horizon: f64,
}

/// Weights that sum to 1, and their slopes along the surfel's tangents.
fn weights(links: &[Link], law: WeightLaw, normal: DVec3, reach: f64) -> (Vec<f64>, Vec<[f64; 2]>) {
    let tangents = <[DVec3; 2]>::from(Surfel::tangents(normal));
    let (mut weights, mut slopes) = (Vec::new(), Vec::new());
    for link in links {
        let (weight, per) = weight(law, link.length, reach);
        weights.push(weight);
        slopes.push(tangents.map(|t| per * link.arm.dot(t)));
    }
    normalize(&mut weights, &mut slopes);
    (weights, slopes)
}

/// Divides weights by their sum, and makes the slopes those of the quotients.
fn normalize(weights: &mut [f64], slopes: &mut [[f64; 2]]) {
    let sum: f64 = weights.iter().sum();
    let sums = slopes.iter().fold([0.0; 2], |sum: [f64; 2], s: &[f64; 2]| {
        [sum[0] + s[0], sum[1] + s[1]]
    });
    for (w, slope) in weights.iter_mut().zip(slopes) {
        *w /= sum;
        for (slope, total) in slope.iter_mut().zip(sums) {
            *slope = (*slope - *w * total) / sum;
        }
    }
}

/// A surfel that seeks its nodes.
pub(crate) struct Query {
    /// The point whose nearest nodes are sought and from which they must be visible.
    pub(crate) eye: DVec3,
    /// A point that lies well in the body beside the eye.
    pub(crate) inner: DVec3,
    pub(crate) normal: DVec3,
    /// The point of the disk above the eye, in its tangents from its middle (m).
    pub(crate) anchor: DVec2,
}

/// A node and the path to it.
#[derive(Debug, Clone, Copy)]
struct Link {
    node: u32,
    /// Length of the path (m).
    length: f64,
    /// The length times its gradient over the surfel's position (m).
    arm: DVec3,
    straight: bool,
}

impl Link {
    fn straight(from: DVec3, to: DVec3, node: u32) -> Self {
        let arm = from - to;
        Self {
            node,
            length: arm.length(),
            arm,
            straight: true,
        }
    }

    /// Round a corner: where the corner is near, the way is as long as if nothing was cut, so that
    /// the two sides of a cut come together at its end.
    fn round(from: DVec3, corner: DVec3, to: DVec3, node: u32) -> Self {
        let length = from.distance(corner) + corner.distance(to);
        Self {
            node,
            length,
            arm: (from - corner).normalize_or_zero() * length,
            straight: false,
        }
    }
}

fn sort(links: &mut [Link]) {
    links.sort_by(|a, b| a.length.total_cmp(&b.length).then(a.node.cmp(&b.node)));
}

/// Weight at a distance, and its slope over the distance.
fn weight(law: WeightLaw, length: f64, reach: f64) -> (f64, f64) {
    if reach <= 0.0 {
        return (1.0, 0.0);
    }
    match law {
        WeightLaw::Compact => {
            let per = (1.1 * reach).powi(2).recip();
            let q = 1.0 - length * length * per;
            (q * q, -4.0 * q * per)
        }
        WeightLaw::Gaussian => {
            let per = (reach * reach).recip();
            let weight = (-length * length * per).exp();
            (weight, -2.0 * per * weight)
        }
    }
}
