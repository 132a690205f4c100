//! Which nodes see which: neighbourhoods in compressed sparse rows.

use std::ops::Range;

use crate::GraphError;
use crate::parallel::to_u32;

/// Neighbours of every node in compressed sparse rows.
///
/// `offsets` has `n + 1` entries, row `i` is `indices[offsets[i]..offsets[i + 1]]`. Every row is
/// sorted, without repetition and without the node itself. A *pair* is a position in `indices`;
/// data on pairs are plain slices of that length. A symmetric graph holds `(i, j)` and `(j, i)`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Neighborhoods {
    offsets: Vec<u32>,
    indices: Vec<u32>,
}

impl Neighborhoods {
    /// Takes a graph, for example the edges of tetrahedra, as it is; rows are sorted if needed.
    ///
    /// # Arguments
    /// * `offsets` -- shape `(n + 1)`, first 0, never falling, last the number of indices.
    /// * `indices` -- neighbours, each below `n`, repeated entries are merged.
    ///
    /// # Errors
    /// [`GraphError`] naming the position: offsets that break the rule, an index out of range, a self
    /// entry.
    pub fn from_graph(offsets: Vec<u32>, indices: Vec<u32>) -> Result<Self, GraphError> {
        let count = offsets.len().checked_sub(1).ok_or(GraphError::Empty)?;
        let mut last = 0;
        for (position, &value) in offsets.iter().enumerate() {
            let bad_end = position == count && value as usize != indices.len();
            if value < last || (position == 0 && value != 0) || bad_end {
                return Err(GraphError::Offsets { position, value });
            }
            last = value;
        }
        let graph = Self { offsets, indices };
        for node in 0..count {
            for &neighbor in graph.row(node) {
                if neighbor as usize >= count {
                    return Err(GraphError::OutOfRange {
                        node,
                        neighbor,
                        count,
                    });
                }
                if neighbor as usize == node {
                    return Err(GraphError::SelfLoop { node });
                }
            }
        }
        Self::from_unsorted(graph.rows())
    }

    /// Joins nodes along undirected edges, each given once, twice or more often; symmetric.
    ///
    /// # Errors
    /// [`GraphError`] for a node that is not there, an edge from a node to itself and too many pairs.
    pub fn from_edges(
        node_count: usize,
        edges: impl IntoIterator<Item = [u32; 2]>,
    ) -> Result<Self, GraphError> {
        let mut lists = vec![Vec::new(); node_count];
        for [a, b] in edges {
            for (node, neighbor) in [(a, b), (b, a)] {
                let node = node as usize;
                if neighbor as usize == node {
                    return Err(GraphError::SelfLoop { node });
                }
                let out_of_range = GraphError::OutOfRange {
                    node,
                    neighbor,
                    count: node_count,
                };
                if neighbor as usize >= node_count {
                    return Err(out_of_range);
                }
                lists.get_mut(node).ok_or(out_of_range)?.push(neighbor);
            }
        }
        Self::from_unsorted(lists)
    }

    /// The rows, each a list of its own.
    fn rows(&self) -> Vec<Vec<u32>> {
        (0..self.node_count())
            .map(|node| self.row(node).to_vec())
            .collect()
    }

    /// Joins rows once they are sorted, without what they have twice.
    fn from_unsorted(mut rows: Vec<Vec<u32>>) -> Result<Self, GraphError> {
        for row in &mut rows {
            row.sort_unstable();
            row.dedup();
        }
        Self::from_rows(rows)
    }

    /// Joins rows that are already sorted and unique.
    pub(crate) fn from_rows(rows: Vec<Vec<u32>>) -> Result<Self, GraphError> {
        let count = rows.iter().map(Vec::len).sum::<usize>();
        if u32::try_from(count).is_err() {
            return Err(GraphError::TooManyPairs { count });
        }
        let mut offsets = Vec::with_capacity(rows.len() + 1);
        let mut indices = Vec::with_capacity(count);
        offsets.push(0);
        for row in rows {
            indices.extend_from_slice(&row);
            offsets.push(to_u32(indices.len()));
        }
        Ok(Self { offsets, indices })
    }

    /// Number of nodes.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Number of directed pairs.
    #[must_use]
    pub fn pair_count(&self) -> usize {
        self.indices.len()
    }

    /// Row starts, shape `(n + 1)`.
    #[must_use]
    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// Neighbours of all rows, shape `(pairs)`.
    #[must_use]
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// Positions of the pairs of one node.
    ///
    /// # Panics
    /// If `node` is out of range.
    #[must_use]
    pub fn pairs(&self, node: usize) -> Range<usize> {
        self.offsets[node] as usize..self.offsets[node + 1] as usize
    }

    /// Neighbours of one node, ascending.
    ///
    /// # Panics
    /// If `node` is out of range.
    #[must_use]
    pub fn row(&self, node: usize) -> &[u32] {
        &self.indices[self.pairs(node)]
    }

    /// Some nodes and their neighbours, in any order and more than once.
    ///
    /// # Panics
    /// If a node is out of range.
    pub fn around<'a>(&'a self, nodes: &'a [u32]) -> impl Iterator<Item = u32> + 'a {
        let rows = nodes.iter().flat_map(|&node| self.row(node as usize));
        rows.chain(nodes).copied()
    }

    /// Position of the pair `(node, neighbor)`, if there is one.
    ///
    /// # Panics
    /// If `node` is out of range.
    #[must_use]
    pub fn find_pair(&self, node: usize, neighbor: u32) -> Option<usize> {
        let position = self.row(node).binary_search(&neighbor).ok()?;
        Some(self.offsets[node] as usize + position)
    }

    /// Neighbours of one node with the positions of their pairs.
    pub(crate) fn entries(&self, node: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let row = self.row(node).iter().map(|&j| j as usize);
        self.pairs(node).zip(row)
    }

    /// Refuses a list that does not have one entry per node.
    pub(crate) fn check_nodes(&self, name: &'static str, found: usize) -> Result<(), GraphError> {
        check_length(name, found, self.node_count())
    }

    /// Refuses a list that does not have one entry per pair.
    pub(crate) fn check_pairs(&self, name: &'static str, found: usize) -> Result<(), GraphError> {
        check_length(name, found, self.pair_count())
    }

    /// For every pair `(i, j)` the position of `(j, i)`, shape `(pairs)`.
    ///
    /// # Errors
    /// [`GraphError::NotSymmetric`] naming the first pair without counterpart.
    pub fn reverse_pairs(&self) -> Result<Vec<u32>, GraphError> {
        let mut reverse = Vec::with_capacity(self.indices.len());
        for node in 0..self.node_count() {
            for &neighbor in self.row(node) {
                let back = self.find_pair(neighbor as usize, to_u32(node));
                let back = back.ok_or(GraphError::NotSymmetric { node, neighbor })?;
                reverse.push(to_u32(back));
            }
        }
        Ok(reverse)
    }

    /// The union with all counterparts: `(i, j)` is in if either direction was.
    ///
    /// # Errors
    /// [`GraphError::TooManyPairs`] if the union does not fit 32-bit offsets.
    pub fn symmetrized(&self) -> Result<Self, GraphError> {
        let mut rows = self.rows();
        for node in 0..self.node_count() {
            for &neighbor in self.row(node) {
                rows[neighbor as usize].push(to_u32(node));
            }
        }
        Self::from_unsorted(rows)
    }

    /// Adds the neighbours' neighbours to the rows of some nodes, both ways, so that a symmetric
    /// graph stays symmetric.
    ///
    /// # Errors
    /// [`GraphError::TooManyPairs`] if the result does not fit 32-bit offsets.
    ///
    /// # Panics
    /// If a node is out of range.
    pub(crate) fn with_second_ring(&self, nodes: &[u32]) -> Result<Self, GraphError> {
        let mut rows = self.rows();
        for &node in nodes {
            for &near in self.row(node as usize) {
                for &far in self.row(near as usize) {
                    if far != node {
                        rows[node as usize].push(far);
                        rows[far as usize].push(node);
                    }
                }
            }
        }
        Self::from_unsorted(rows)
    }
}

fn check_length(name: &'static str, found: usize, wanted: usize) -> Result<(), GraphError> {
    if found == wanted {
        Ok(())
    } else {
        Err(GraphError::Length {
            name,
            found,
            wanted,
        })
    }
}

#[cfg(test)]
mod tests;
