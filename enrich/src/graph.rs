//! Who is coupled with whom, and how far.

use std::ops::Range;

use glam::DVec3;

use crate::error::GraphError;
use crate::index32;
use crate::rule::Rule;

/// Nodes and pairs of a body, borrowed from their owner and checked.
///
/// Every row is sorted, names other nodes once and each of them names it back.
#[derive(Debug, Clone, Copy)]
pub struct Graph<'a> {
    pub(crate) positions: &'a [DVec3],
    pub(crate) offsets: &'a [u32],
    pub(crate) indices: &'a [u32],
}

impl<'a> Graph<'a> {
    /// Takes a graph in compressed rows and checks all of it.
    ///
    /// # Arguments
    /// * `positions` -- rest positions (m), shape `(n)`, finite.
    /// * `offsets` -- start of each row, shape `(n + 1)`, from 0 to the number of pairs.
    /// * `indices` -- neighbours, shape `(pairs)`; rows sorted, symmetric, without self.
    ///
    /// # Errors
    /// [`GraphError`] naming the first position that is not as stated. [`Rows`] makes rows that are.
    pub fn new(
        positions: &'a [DVec3],
        offsets: &'a [u32],
        indices: &'a [u32],
    ) -> Result<Self, GraphError> {
        let graph = Self::new_unchecked(positions, offsets, indices);
        graph.check()?;
        Ok(graph)
    }

    /// A graph without the check: for owners of a valid one who build it again at each update. With other data
    /// results are wrong or a later call panics.
    #[must_use]
    pub fn new_unchecked(positions: &'a [DVec3], offsets: &'a [u32], indices: &'a [u32]) -> Self {
        Self {
            positions,
            offsets,
            indices,
        }
    }

    /// Rest positions (m), shape `(n)`.
    #[must_use]
    pub fn positions(&self) -> &'a [DVec3] {
        self.positions
    }

    /// Start of each row, shape `(n + 1)`.
    #[must_use]
    pub fn offsets(&self) -> &'a [u32] {
        self.offsets
    }

    /// Neighbours, shape `(pairs)`.
    #[must_use]
    pub fn indices(&self) -> &'a [u32] {
        self.indices
    }
}

impl Graph<'_> {
    /// Positions of a node's pairs in the indices.
    pub(crate) fn pairs(&self, node: usize) -> Range<usize> {
        self.offsets[node] as usize..self.offsets[node + 1] as usize
    }

    /// Neighbours of a node.
    pub(crate) fn row(&self, node: usize) -> &[u32] {
        &self.indices[self.pairs(node)]
    }

    /// The pair from one node to another.
    pub(crate) fn pair(&self, node: u32, neighbor: u32) -> usize {
        let place = self.row(node as usize).binary_search(&neighbor);
        self.offsets[node as usize] as usize + place.expect("checked to be symmetric when built")
    }

    fn check(&self) -> Result<(), GraphError> {
        let (nodes, offsets) = (self.positions.len(), self.offsets);
        if offsets.len() != nodes + 1 {
            return Err(GraphError::OffsetCount {
                found: offsets.len(),
                nodes,
            });
        }
        for (position, &value) in offsets.iter().enumerate() {
            let before = position.checked_sub(1).map_or(0, |last| offsets[last]);
            let end = position == nodes && value as usize != self.indices.len();
            if value < before || (position == 0 && value != 0) || end {
                return Err(GraphError::Offset { position, value });
            }
        }
        if let Some(node) = self.positions.iter().position(|x| !x.is_finite()) {
            return Err(GraphError::NotFinite { node });
        }
        for node in 0..nodes {
            let mut last = None;
            for &neighbor in self.row(node) {
                let in_place = last.is_none_or(|last| last < neighbor);
                if !in_place || neighbor as usize >= nodes || neighbor as usize == node {
                    return Err(GraphError::Row { node, neighbor });
                }
                last = Some(neighbor);
            }
        }
        for node in 0..nodes {
            for &neighbor in self.row(node) {
                let back = self.row(neighbor as usize).binary_search(&index32(node));
                if back.is_err() {
                    return Err(GraphError::OneWay { node, neighbor });
                }
            }
        }
        Ok(())
    }
}

/// Rows of a symmetric graph that are owned.
///
/// ```
/// use phyxel_enrich::glam::DVec3;
/// use phyxel_enrich::Rows;
///
/// let rows = Rows::from_edges(3, [[0, 2], [1, 0], [2, 1]])?;
/// assert_eq!(rows.offsets(), [0, 2, 4, 6]);
/// assert_eq!(rows.indices(), [1, 2, 0, 2, 0, 1]);
/// let graph = rows.graph(&[DVec3::ZERO, DVec3::X, DVec3::Y])?;
/// # Ok::<(), phyxel_enrich::GraphError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rows {
    offsets: Vec<u32>,
    indices: Vec<u32>,
}

impl Rows {
    /// Joins nodes along undirected edges, each given once, twice or more often.
    ///
    /// # Errors
    /// [`GraphError::Row`] for an edge that names a node that is not there or the same node twice,
    /// [`GraphError::TooManyPairs`] beyond 32-bit offsets.
    pub fn from_edges(
        node_count: usize,
        edges: impl IntoIterator<Item = [u32; 2]>,
    ) -> Result<Self, GraphError> {
        let mut pairs = Vec::new();
        for [a, b] in edges {
            for (node, neighbor) in [(a, b), (b, a)] {
                if neighbor as usize >= node_count || node == neighbor {
                    let node = node as usize;
                    return Err(GraphError::Row { node, neighbor });
                }
            }
            pairs.extend([[a, b], [b, a]]);
        }
        pairs.sort_unstable();
        pairs.dedup();
        let count = pairs.len();
        if u32::try_from(count).is_err() {
            return Err(GraphError::TooManyPairs { count });
        }
        let mut offsets = vec![0; node_count + 1];
        for [node, _] in &pairs {
            offsets[*node as usize + 1] += 1;
        }
        for node in 0..node_count {
            offsets[node + 1] += offsets[node];
        }
        let indices = pairs.into_iter().map(|[_, neighbor]| neighbor).collect();
        Ok(Self { offsets, indices })
    }

    /// Start of each row, shape `(n + 1)`.
    #[must_use]
    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// Neighbours, shape `(pairs)`.
    #[must_use]
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// The graph over rest positions (m), shape `(n)`.
    ///
    /// # Errors
    /// [`GraphError`] if there is not one finite position per row.
    pub fn graph<'a>(&'a self, positions: &'a [DVec3]) -> Result<Graph<'a>, GraphError> {
        Graph::new(positions, &self.offsets, &self.indices)
    }
}

/// Influence radius of a node; that of a pair is the mean of its two nodes'.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum InfluenceRadius {
    /// This multiple of the mean length of the node's pairs.
    Neighbors(f64),
    /// The same length (m) for all nodes.
    Length(f64),
}

impl InfluenceRadius {
    /// Influence radius (m) of one node.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn of(self, graph: &Graph<'_>, node: usize) -> f64 {
        let scale = match self {
            Self::Neighbors(scale) => scale,
            Self::Length(length) => return length,
        };
        let (x, row) = (graph.positions[node], graph.row(node));
        let lengths = row.iter().map(|&j| x.distance(graph.positions[j as usize]));
        scale * lengths.sum::<f64>() / row.len().max(1) as f64
    }

    /// Distance (m) from any node beyond which a triangle changes none of its pairs.
    pub(crate) fn span(self, graph: &Graph<'_>) -> f64 {
        let nodes = 0..graph.positions.len();
        let radii: Vec<f64> = nodes.map(|node| self.of(graph, node)).collect();
        let mut span = 0.0_f64;
        for (i, x) in graph.positions.iter().enumerate() {
            for &j in graph.row(i) {
                let j = j as usize;
                let length = x.distance(graph.positions[j]);
                let around = 0.5 * length + Rule::MARGIN * 0.5 * (radii[i] + radii[j]);
                span = span.max(around).max(length);
            }
        }
        span
    }

    /// Influence radius (m) of the pair between two nodes.
    pub(crate) fn of_pair(self, graph: &Graph<'_>, i: usize, j: usize) -> f64 {
        0.5 * (self.of(graph, i) + self.of(graph, j))
    }
}

#[cfg(test)]
mod tests;
