//! Nodes of a graded octree with hanging nodes, as a body without tetrahedra.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::block::Block;

/// Smallest cells per side of the unit cube.
const FINE: u32 = 16;

/// A leaf: lowest corner and size, in smallest cells.
type Cell = ([u32; 3], u32);

impl Block {
    /// Corners of the leaves of an octree on the unit cube, three sizes from 1/4 to 1/16, smallest
    /// near the corner at the origin; neighbours share a leaf. Nodes hang on faces and edges of
    /// larger leaves.
    ///
    /// A leaf gives an eighth of its volume to each corner, a face of the cube a quarter of its area;
    /// both sum to the cube's, whatever hangs.
    #[must_use]
    pub fn octree() -> Self {
        let cells = leaves();
        let mut numbers = BTreeMap::new();
        for &cell in &cells {
            for corner in corners(cell) {
                // z slowest, as in a lattice.
                numbers.insert([corner[2], corner[1], corner[0]], 0);
            }
        }
        for (number, place) in (0_u32..).zip(numbers.values_mut()) {
            *place = number;
        }
        let number = |[x, y, z]: [u32; 3]| numbers[&[z, y, x]];
        let unit = f64::from(FINE).recip();
        let position = |&[z, y, x]: &[u32; 3]| DVec3::new(x.into(), y.into(), z.into()) * unit;
        let positions: Vec<DVec3> = numbers.keys().map(position).collect();
        let count = positions.len();
        let mut volumes = vec![0.0; count];
        let mut boundary_vectors = vec![DVec3::ZERO; count];
        let mut rows = vec![Vec::new(); count];
        for &cell in &cells {
            let size = f64::from(cell.1) * unit;
            let at = corners(cell).map(number);
            for (corner, place) in at.iter().zip(corners(cell)) {
                let node = *corner as usize;
                volumes[node] += size.powi(3) / 8.0;
                rows[node].extend(at.iter().filter(|other| *other != corner));
                for axis in 0..3 {
                    // The cell's own face lies on the cube's: at 0 if the cell starts there.
                    let low = cell.0[axis] == 0 && place[axis] == 0;
                    let high = place[axis] == FINE;
                    let sign = f64::from(i8::from(high) - i8::from(low));
                    boundary_vectors[node][axis] += sign * size * size / 4.0;
                }
            }
        }
        Self::from_graph(positions, volumes, boundary_vectors, rows)
    }
}

/// Lowest corner first, x fastest.
fn corners((low, size): Cell) -> [[u32; 3]; 8] {
    let bits = [0, 1, 2, 3, 4, 5, 6, 7_u32];
    bits.map(|bit| [0, 1, 2].map(|axis| low[axis] + size * (bit >> axis & 1)))
}

fn leaves() -> Vec<Cell> {
    let mut cells: Vec<Cell> = Vec::new();
    let mut open: Vec<Cell> = vec![([0; 3], FINE)];
    while let Some((low, size)) = open.pop() {
        let middle = |k: usize| f64::from(2 * low[k] + size) / f64::from(2 * FINE);
        let distance = DVec3::new(middle(0), middle(1), middle(2)).length();
        let split = match size {
            8.. => true,
            4 => distance < 0.75,
            2 => distance < 0.4,
            _ => false,
        };
        if !split {
            cells.push((low, size));
            continue;
        }
        let half = size / 2;
        open.extend(corners((low, half)).map(|corner| (corner, half)));
    }
    cells
}
