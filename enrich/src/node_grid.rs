//! Nodes sorted into the cells of a grid.

use glam::DVec3;

use crate::index::Bounds;
use crate::obstacle::index32;

/// Nodes by cell of a regular grid over their bounding box; at most about two cells per node.
#[derive(Debug, Clone)]
pub(crate) struct NodeGrid {
    origin: DVec3,
    cell: f64,
    size: [usize; 3],
    offsets: Vec<u32>,
    nodes: Vec<u32>,
}

impl NodeGrid {
    pub(crate) fn new(positions: &[DVec3], wanted_cell: f64) -> Self {
        let bounds = Bounds::of(positions);
        let extent = (bounds.high - bounds.low).max(DVec3::ZERO);
        let mut cell = wanted_cell;
        let counts = |cell: f64| (extent / cell).to_array().map(|e| e.floor() + 1.0);
        #[allow(
            clippy::cast_precision_loss,
            reason = "a node count fits 32 bits, and this is only a limit"
        )]
        let limit = 2.0 * positions.len() as f64 + 8.0;
        while counts(cell).iter().product::<f64>() > limit {
            cell *= 1.25;
        }
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "bounded by the limit above"
        )]
        let size = counts(cell).map(|c| c as usize);
        let mut grid = Self {
            origin: bounds.low,
            cell,
            size,
            offsets: vec![0; size.iter().product::<usize>() + 1],
            nodes: vec![0; positions.len()],
        };
        let cells: Vec<usize> = positions
            .iter()
            .map(|&p| grid.linear(grid.cell_of(p)))
            .collect();
        for &cell in &cells {
            grid.offsets[cell + 1] += 1;
        }
        for k in 1..grid.offsets.len() {
            grid.offsets[k] += grid.offsets[k - 1];
        }
        let mut next = grid.offsets.clone();
        for (node, &cell) in cells.iter().enumerate() {
            grid.nodes[next[cell] as usize] = index32(node);
            next[cell] += 1;
        }
        grid
    }

    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the grid before the cast"
    )]
    fn cell_of(&self, p: DVec3) -> [usize; 3] {
        let at = ((p - self.origin) / self.cell).floor().to_array();
        [0, 1, 2].map(|k| (at[k].max(0.0) as usize).min(self.size[k] - 1))
    }

    fn linear(&self, cell: [usize; 3]) -> usize {
        (cell[2] * self.size[1] + cell[1]) * self.size[0] + cell[0]
    }

    /// Calls `f` for every node of every cell that meets the box.
    pub(crate) fn for_nodes(&self, near: &Bounds, mut f: impl FnMut(u32)) {
        if self.nodes.is_empty() {
            return;
        }
        let (low, high) = (self.cell_of(near.low), self.cell_of(near.high));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                let row = self.linear([low[0], y, z]);
                let end = self.linear([high[0], y, z]) + 1;
                let range = self.offsets[row] as usize..self.offsets[end] as usize;
                for &node in &self.nodes[range] {
                    f(node);
                }
            }
        }
    }
}
