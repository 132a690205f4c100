//! Where the nodes lie in a grid, and the transfer between nodes and splines.

#![allow(
    clippy::needless_range_loop,
    reason = "lanes are walked in step over several arrays"
)]

use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};

use super::grid::{Grid, Lanes, add, spline_values};
use crate::parallel::{ROWS_PER_TASK, share_out, to_u32};

/// A node in the grid.
#[derive(Debug, Clone, Copy)]
struct PlacedNode {
    /// Place of the first of its 27 splines; [`OUTSIDE`] for nodes that take no part.
    place: u32,
    within: [f64; 3],
}

/// Marks a node that takes no part.
const OUTSIDE: u32 = u32::MAX;

/// Nodes of one row of cells along x.
#[derive(Debug)]
struct CellRow {
    /// Place of the first spline of the row's first cell.
    place: usize,
    nodes: Vec<u32>,
}

/// Where the nodes of a cloud lie in a grid.
pub(super) struct GridPlacement {
    pub(super) grid: Grid,
    placed: Vec<PlacedNode>,
    rows: Vec<CellRow>,
    /// Per row of cells 3 × 3 rows of splines, `grid.sizes[0]` each.
    sums: Vec<Vec<Lanes>>,
    /// Row of cells at the position of its first spline, [`OUTSIDE`] for none; by y and z.
    row_at: Vec<u32>,
}

/// Nodes of one cell.
pub(super) struct CellNodes<'a> {
    /// Place of the first of its 27 splines.
    pub(super) place: usize,
    pub(super) nodes: &'a [u32],
}

impl GridPlacement {
    /// Sorts the nodes for which `takes_part` into the cells of a grid.
    pub(super) fn new(grid: Grid, positions: &[DVec3], takes_part: impl Fn(usize) -> bool) -> Self {
        let [_, height, depth] = grid.sizes;
        let mut placed = Vec::with_capacity(positions.len());
        let mut keys: Vec<(usize, u32)> = Vec::with_capacity(positions.len());
        for (node, &x) in positions.iter().enumerate() {
            let (cell, within) = grid.locate(x);
            let place = if takes_part(node) {
                keys.push((grid.place(cell), to_u32(node)));
                to_u32(grid.place(cell))
            } else {
                OUTSIDE
            };
            placed.push(PlacedNode { place, within });
        }
        keys.sort_unstable();
        let row_of = |place: usize| {
            let [_, y, z] = grid.spline(place);
            y + height * z
        };
        let mut row_at = vec![OUTSIDE; height * depth];
        let mut rows = Vec::new();
        for run in keys.chunk_by(|a, b| row_of(a.0) == row_of(b.0)) {
            let [_, y, z] = grid.spline(run[0].0);
            row_at[y + height * z] = to_u32(rows.len());
            rows.push(CellRow {
                place: grid.place([0, y, z]),
                nodes: run.iter().map(|key| key.1).collect(),
            });
        }
        let sums = vec![vec![[0.0; 4]; 9 * grid.sizes[0]]; rows.len()];
        Self {
            grid,
            placed,
            rows,
            sums,
            row_at,
        }
    }

    /// Occupied cells in order of z, y, x.
    pub(super) fn cells(&self) -> impl Iterator<Item = CellNodes<'_>> {
        let place = |node: u32| self.placed[node as usize].place;
        self.rows.iter().flat_map(move |row| {
            row.nodes
                .chunk_by(move |&a, &b| place(a) == place(b))
                .map(move |nodes| CellNodes {
                    place: place(nodes[0]) as usize,
                    nodes,
                })
        })
    }

    /// Where in its cell a node lies.
    pub(super) fn within(&self, node: u32) -> [f64; 3] {
        self.placed[node as usize].within
    }

    /// `Pᵀ r` at the given positions.
    pub(super) fn restrict(&mut self, r: &[DVec3], places: &[u32], out: &mut [Lanes]) {
        let arch = Arch::new();
        let (placed, width) = (&self.placed, self.grid.sizes[0]);
        share_out(self.sums.iter_mut().zip(&self.rows), |_, (sums, row)| {
            arch.dispatch(Restriction {
                placed,
                row,
                width,
                r,
                sums,
            });
        });
        let [_, height, _] = self.grid.sizes;
        let parts = out
            .chunks_mut(ROWS_PER_TASK)
            .zip(places.chunks(ROWS_PER_TASK));
        share_out(parts, |_, (out, places)| {
            for (out, &place) in out.iter_mut().zip(places) {
                let [x, y, z] = self.grid.spline(place as usize);
                let mut sum = [0.0; 4];
                for k in 0..=z.min(2) {
                    for j in 0..=y.min(2) {
                        let row = self.row_at[y - j + height * (z - k)];
                        if row != OUTSIDE {
                            let part = &self.sums[row as usize][width * (j + 3 * k) + x];
                            add(&mut sum, part, 1.0);
                        }
                    }
                }
                *out = sum;
            }
        });
    }

    /// `z += P field`.
    pub(super) fn prolong(&self, field: &[Lanes], z: &mut [DVec3]) {
        let arch = Arch::new();
        let parts = z
            .chunks_mut(ROWS_PER_TASK)
            .zip(self.placed.chunks(ROWS_PER_TASK));
        share_out(parts, |_, (z, placed)| {
            arch.dispatch(Prolongation {
                placed,
                steps: self.grid.steps(),
                field,
                z,
            });
        });
    }
}

/// `sums += Pᵀ r` over the nodes of one row of cells.
struct Restriction<'a> {
    placed: &'a [PlacedNode],
    row: &'a CellRow,
    width: usize,
    r: &'a [DVec3],
    sums: &'a mut [Lanes],
}

impl WithSimd for Restriction<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.sums.fill([0.0; 4]);
        for &node in &self.row.nodes {
            let PlacedNode { place, within } = self.placed[node as usize];
            let first = place as usize - self.row.place;
            let [vx, vy, vz] = within.map(spline_values);
            let r = self.r[node as usize];
            let r = [r.x, r.y, r.z, 0.0];
            let along = vx.map(|v| r.map(|r| r * v));
            for k in 0..3 {
                for j in 0..3 {
                    let across = vy[j] * vz[k];
                    let start = self.width * (j + 3 * k) + first;
                    let run = &mut self.sums[start..start + 3];
                    for (sum, value) in run.iter_mut().zip(&along) {
                        add(sum, value, across);
                    }
                }
            }
        }
    }
}

/// `z += P field` for some nodes.
struct Prolongation<'a> {
    placed: &'a [PlacedNode],
    steps: [usize; 3],
    field: &'a [Lanes],
    z: &'a mut [DVec3],
}

impl WithSimd for Prolongation<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (placed, z) in self.placed.iter().zip(self.z) {
            if placed.place == OUTSIDE {
                continue;
            }
            let [vx, vy, vz] = placed.within.map(spline_values);
            let mut sums = [[0.0; 4]; 3];
            for k in 0..3 {
                for j in 0..3 {
                    let across = vy[j] * vz[k];
                    let start = placed.place as usize + j * self.steps[1] + k * self.steps[2];
                    let run = &self.field[start..start + 3];
                    for (sum, value) in sums.iter_mut().zip(run) {
                        add(sum, value, across);
                    }
                }
            }
            let part =
                |lane: usize| vx[0] * sums[0][lane] + vx[1] * sums[1][lane] + vx[2] * sums[2][lane];
            *z += DVec3::new(part(0), part(1), part(2));
        }
    }
}
