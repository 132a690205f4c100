//! Which nodes' motion changes the force on which.

/// Symmetric graph of a tangent's blocks: row `i` lists the nodes whose motion changes the force on
/// node `i`, itself among them, rising.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Coupling {
    offsets: Vec<u32>,
    indices: Vec<u32>,
}

impl Coupling {
    /// Two rings of a symmetric neighbour graph (CSR, as of gradient stencils): a node's force depends
    /// on its neighbours' stresses, and those on their neighbours' positions.
    ///
    /// # Panics
    /// If the CSR arrays do not fit each other.
    #[must_use]
    pub fn two_rings(offsets: &[u32], indices: &[u32]) -> Self {
        let count = offsets.len().saturating_sub(1);
        let row = |i: usize| &indices[offsets[i] as usize..offsets[i + 1] as usize];
        let mut all = vec![0];
        let mut coupled = Vec::new();
        let mut near = Vec::new();
        for i in 0..count {
            near.clear();
            near.extend(u32::try_from(i));
            for &j in row(i) {
                near.push(j);
                near.extend_from_slice(row(j as usize));
            }
            near.sort_unstable();
            near.dedup();
            coupled.extend_from_slice(&near);
            all.push(u32::try_from(coupled.len()).expect("fewer than 2^32 pairs"));
        }
        Self {
            offsets: all,
            indices: coupled,
        }
    }

    /// The rows of a stiffness matrix (CSR) as they are: symmetric, rising, each with its own node.
    ///
    /// # Panics
    /// If the CSR arrays do not fit each other, or a row does not rise or lacks its own node.
    #[must_use]
    pub fn of_rows(offsets: Vec<u32>, indices: Vec<u32>) -> Self {
        assert_eq!(
            offsets.last().map_or(0, |end| *end as usize),
            indices.len(),
            "the last offset is the number of entries"
        );
        let found = Self { offsets, indices };
        for node in 0..found.node_count() {
            let row = found.row(node);
            assert!(row.is_sorted_by(|a, b| a < b), "row {node} rises");
            let own = |i: &u32| *i as usize == node;
            assert!(row.iter().any(own), "row {node} has its own node");
        }
        found
    }

    /// Number of nodes.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// Nodes coupled to a node, itself among them, rising.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn row(&self, node: usize) -> &[u32] {
        &self.indices[self.offsets[node] as usize..self.offsets[node + 1] as usize]
    }

    /// Place of the first entry of a row.
    #[cfg(feature = "faer")]
    pub(crate) fn begin(&self, node: usize) -> usize {
        self.offsets[node] as usize
    }

    /// Colours of nodes such that no row holds two nodes of one colour: greedy, in order.
    #[cfg(feature = "faer")]
    pub(crate) fn colors(&self) -> (Vec<u32>, u32) {
        let n = self.node_count();
        let mut colors = vec![u32::MAX; n];
        let mut taken: Vec<usize> = Vec::new();
        let mut count = 0;
        for node in 0..n {
            for &row in self.row(node) {
                for &other in self.row(row as usize) {
                    let color = colors[other as usize];
                    if color != u32::MAX {
                        taken[color as usize] = node + 1;
                    }
                }
            }
            let free = taken.iter().position(|mark| *mark != node + 1);
            let color = free.unwrap_or(taken.len());
            if color == taken.len() {
                taken.push(0);
            }
            colors[node] = u32::try_from(color).expect("no more colours than nodes");
            count = count.max(colors[node] + 1);
        }
        (colors, count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_couples_two_links_away() {
        let coupling = Coupling::two_rings(&[0, 1, 3, 5, 7, 8], &[1, 0, 2, 1, 3, 2, 4, 3]);
        assert_eq!(coupling.node_count(), 5, "nodes");
        assert_eq!(coupling.row(0), [0, 1, 2], "end");
        assert_eq!(coupling.row(2), [0, 1, 2, 3, 4], "middle");
    }

    #[test]
    fn rows_of_a_matrix_are_taken_as_they_are() {
        let coupling = Coupling::of_rows(vec![0, 2, 5, 7], vec![0, 1, 0, 1, 2, 1, 2]);
        assert_eq!(coupling.node_count(), 3, "nodes");
        assert_eq!(coupling.row(1), [0, 1, 2], "middle");
        assert_eq!(coupling.row(2), [1, 2], "end");
    }

    #[test]
    #[should_panic(expected = "row 1 has its own node")]
    fn a_row_without_its_own_node_is_refused() {
        let _ = Coupling::of_rows(vec![0, 2, 3], vec![0, 1, 0]);
    }

    #[test]
    #[cfg(feature = "faer")]
    fn no_row_holds_a_colour_twice() {
        let offsets: Vec<u32> = (0..=30).map(|i| 4 * i).collect();
        let indices: Vec<u32> = (0..30_u32)
            .flat_map(|i| [1, 7, 23, 29].map(|s| (i + s) % 30))
            .collect();
        let coupling = Coupling::two_rings(&offsets, &indices);
        let (colors, count) = coupling.colors();
        for i in 0..30 {
            let mut seen: Vec<u32> = coupling
                .row(i)
                .iter()
                .map(|j| colors[*j as usize])
                .collect();
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen.len(), coupling.row(i).len(), "row {i}");
            assert!(seen.iter().all(|color| *color < count), "count");
        }
    }
}
