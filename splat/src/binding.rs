//! Which nodes carry a surfel.

use crate::cast::{count, index};
use glam::DVec3;
use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Weight of a node at distance d from a surfel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WeightLaw {
    /// `(1 - d²/h²)²` with h = 1.1 times the distance of the farthest node: smooth, and a node on
    /// its way out fades.
    #[default]
    Compact,
    /// `exp(-d²/h²)` with h the distance of the farthest node (Aras 2014, eq. (58)).
    Gaussian,
}

/// How surfels are bound to nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct BindSettings {
    /// Nodes per surfel at most.
    pub neighbors: usize,
    /// Nodes looked at in order of distance before a surfel is content with fewer than
    /// `neighbors`; more hides more of a cut's diffraction at some cost.
    pub pool: usize,
    /// Weight law.
    pub law: WeightLaw,
}

impl Default for BindSettings {
    fn default() -> Self {
        Self {
            neighbors: 8,
            pool: 48,
            law: WeightLaw::Compact,
        }
    }
}

/// Nodes and weights of every surfel: rows of fixed length, CSR with `offsets[i] = i * stride`.
///
/// Row i holds the nodes in order of distance; weights are at least 0 and sum to 1. A row with
/// fewer nodes than the stride is padded with its first node at weight 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Binding {
    stride: usize,
    nodes: Vec<u32>,
    weights: Vec<f64>,
    /// Distance from the surfel to the farthest node of its row (m).
    reach: Vec<f64>,
}

/// Search structure over the nodes' rest positions.
pub(crate) type NodeTree = RTree<GeomWithData<[f64; 3], u32>>;

/// Bulk-loads a tree over finite points.
pub(crate) fn point_tree(points: &[DVec3]) -> NodeTree {
    RTree::bulk_load(
        points
            .iter()
            .enumerate()
            .map(|(i, p)| GeomWithData::new(p.to_array(), count(i)))
            .collect(),
    )
}

/// One row before it is stored.
pub(crate) struct Row {
    nodes: Vec<u32>,
    weights: Vec<f64>,
    reach: f64,
}

impl Binding {
    /// An empty binding with rows of `min(neighbors, node_count)` entries.
    pub(crate) fn empty(settings: &BindSettings, node_count: usize) -> Self {
        Self {
            stride: settings.neighbors.min(node_count).max(1),
            nodes: Vec::new(),
            weights: Vec::new(),
            reach: Vec::new(),
        }
    }

    /// Number of surfels bound.
    #[must_use]
    pub fn len(&self) -> usize {
        self.reach.len()
    }

    /// True if no surfel is bound.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.reach.is_empty()
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
    pub fn row(&self, surfel: usize) -> (&[u32], &[f64]) {
        let range = surfel * self.stride..(surfel + 1) * self.stride;
        (&self.nodes[range.clone()], &self.weights[range])
    }

    /// Distance from a surfel to its farthest node (m).
    ///
    /// # Panics
    /// If `surfel` is out of range.
    #[must_use]
    pub fn reach(&self, surfel: usize) -> f64 {
        self.reach[surfel]
    }

    /// Appends rows that hold node 0 until they are replaced.
    pub(crate) fn push_placeholders(&mut self, n: usize) {
        let rows = self.reach.len() + n;
        self.nodes.resize(rows * self.stride, 0);
        self.weights.resize(rows * self.stride, 0.0);
        self.reach.resize(rows, 0.0);
    }

    /// Replaces one row.
    pub(crate) fn store(&mut self, surfel: usize, row: &Row) {
        let range = surfel * self.stride..(surfel + 1) * self.stride;
        let (nodes, weights) = (&mut self.nodes[range.clone()], &mut self.weights[range]);
        nodes.fill(row.nodes[0]);
        weights.fill(0.0);
        nodes[..row.nodes.len()].copy_from_slice(&row.nodes);
        weights[..row.weights.len()].copy_from_slice(&row.weights);
        self.reach[surfel] = row.reach;
    }

    /// Rows for the surfels at `queries` (rest frame), in parallel. Per query: the point whose
    /// nearest nodes are sought, and the point from which nodes must be visible.
    pub(crate) fn rows(
        &self,
        queries: &[(DVec3, DVec3)],
        node_positions: &[DVec3],
        tree: &NodeTree,
        settings: &BindSettings,
        visible: &(dyn Fn(DVec3, DVec3) -> bool + Sync),
    ) -> Vec<Row> {
        queries
            .par_iter()
            .map(|&(x, eye)| self.row_of(x, eye, node_positions, tree, settings, visible))
            .collect()
    }

    fn row_of(
        &self,
        x: DVec3,
        eye: DVec3,
        node_positions: &[DVec3],
        tree: &NodeTree,
        settings: &BindSettings,
        visible: &(dyn Fn(DVec3, DVec3) -> bool + Sync),
    ) -> Row {
        let mut found: Vec<(f64, u32)> = Vec::with_capacity(self.stride);
        let mut nearest = None;
        for (looked, node) in tree.nearest_neighbor_iter(x.to_array()).enumerate() {
            let at = node_positions[index(node.data)];
            let entry = (at.distance_squared(x), node.data);
            nearest.get_or_insert(entry);
            // With nothing in sight the search goes on: better a far node of the own piece than a
            // near one of another.
            if found.len() == self.stride || (looked >= settings.pool && !found.is_empty()) {
                break;
            }
            if visible(eye, at) {
                found.push(entry);
            }
        }
        // Nothing visible at all (a crumb of tissue without a node): the nearest node carries it.
        if found.is_empty() {
            found.extend(nearest);
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let reach = found.last().map_or(0.0, |f| f.0.sqrt());
        let mut weights: Vec<f64> = found
            .iter()
            .map(|&(squared, _)| weight(settings.law, squared, reach))
            .collect();
        let sum: f64 = weights.iter().sum();
        for w in &mut weights {
            *w /= sum;
        }
        Row {
            nodes: found.into_iter().map(|f| f.1).collect(),
            weights,
            reach,
        }
    }
}

fn weight(law: WeightLaw, squared: f64, reach: f64) -> f64 {
    if reach <= 0.0 {
        return 1.0;
    }
    match law {
        WeightLaw::Compact => {
            let q = 1.0 - squared / (1.1 * reach).powi(2);
            q * q
        }
        WeightLaw::Gaussian => (-squared / (reach * reach)).exp(),
    }
}
