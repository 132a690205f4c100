//! Matrix of the operator on the finest grid.
//!
//! Over one row a spline field is taken for its quadratic Taylor polynomial at the node, with the six
//! second derivatives Q: then `e_ij = t_ij · Q − H(Q) X_ij` with the second-order monomials t of `X_ij`,
//! and the row's energy is `V² Qᵀ M Q`, `M = Σ w t tᵀ − (Σ w t Xᵀ) A⁻¹ (Σ w X tᵀ)`. That is what the row
//! sees of fields smooth over its neighbourhood, and it couples only the 27 splines at the node.

use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};

use super::grid::{Grid, SPLINE_CURVATURES, spline_slopes, spline_values};
use super::level::STENCIL;
use super::placement::{CellNodes, GridPlacement};
use crate::conservative::operator::Operator;
use crate::parallel::{map, share_out, to_u32};

/// Splines at a node.
const LOCAL: usize = 27;

/// The same, rounded up to whole registers.
const PADDED: usize = 32;

/// Fraction of `tr Σ w t tᵀ` added to the diagonal of M. A row with few neighbours, as at edges and
/// corners, leaves some of Q without energy; where it is alone in its cell, splines would be free that
/// the rows of other cells do hold. A jittered block whose faces lie 0.27 cells beyond the last cell
/// takes 164 iterations at 0, 66 at 0.03, 54 at 0.1; elsewhere the fraction makes no difference.
const STIFFENING: f64 = 0.1;

/// Local matrix of a cell.
type CellMatrix = [[f64; PADDED]; LOCAL];

/// Cells whose local matrices are held at a time, at least.
const BATCH: usize = 512;

/// Places with an entry on the diagonal, ascending, and their rows of the matrix.
pub(super) fn bending_stencils(
    operator: &Operator<'_>,
    placement: &GridPlacement,
) -> (Vec<u32>, Vec<[f64; STENCIL]>) {
    let grid = placement.grid;
    let cells: Vec<CellNodes<'_>> = placement.cells().collect();
    let local = local_places(&grid);
    let mut taken = vec![false; grid.len()];
    for cell in &cells {
        for offset in local {
            taken[cell.place + offset] = true;
        }
    }
    let places: Vec<u32> = (0..grid.len())
        .filter(|&place| taken[place])
        .map(to_u32)
        .collect();
    let mut stencils = vec![[0.0; STENCIL]; places.len()];
    for batch in cells.chunks(BATCH.max(places.len() / 16)) {
        let blocks: Vec<CellMatrix> =
            map(batch.len(), 8, |at| block(operator, placement, &batch[at]));
        // A spline's own index in the cell that starts at its position less `local[index]`.
        let low = places.partition_point(|&place| (place as usize) < batch[0].place);
        let last = batch[batch.len() - 1].place + local[LOCAL - 1];
        let high = places.partition_point(|&place| place as usize <= last);
        let within = places[low..high].chunks(64);
        share_out(
            within.zip(stencils[low..high].chunks_mut(64)),
            |_, (places, stencils)| {
                for (&place, stencil) in places.iter().zip(stencils) {
                    for (own, &offset) in local.iter().enumerate() {
                        let Some(start) = (place as usize).checked_sub(offset) else {
                            continue;
                        };
                        let Ok(cell) = batch.binary_search_by_key(&start, |cell| cell.place) else {
                            continue;
                        };
                        add_row(stencil, own, &blocks[cell][own]);
                    }
                }
            },
        );
    }
    (places, stencils)
}

/// Distances in memory from the first to each of the 27 splines of a cell.
fn local_places(grid: &Grid) -> [usize; LOCAL] {
    let [x, y, z] = grid.steps();
    std::array::from_fn(|k| k % 3 * x + k / 3 % 3 * y + k / 9 * z)
}

/// Adds one row of a local matrix to the stencil of its spline.
fn add_row(stencil: &mut [f64; STENCIL], own: usize, row: &[f64; PADDED]) {
    let [x, y, z] = [own % 3, own / 3 % 3, own / 9];
    for (k, plane) in row[..LOCAL].as_chunks::<9>().0.iter().enumerate() {
        for (j, run) in plane.as_chunks::<3>().0.iter().enumerate() {
            let start = (2 - x) + 5 * (2 + j - y) + 25 * (2 + k - z);
            for (sum, value) in stencil[start..start + 3].iter_mut().zip(run) {
                *sum += value;
            }
        }
    }
}

/// Sum of the nodes' parts of one cell.
fn block(operator: &Operator<'_>, placement: &GridPlacement, cell: &CellNodes<'_>) -> CellMatrix {
    let mut sum = [[0.0; PADDED]; LOCAL];
    let arch = Arch::new();
    for &node in cell.nodes {
        if operator.scale[node as usize] > 0.0 {
            arch.dispatch(NodeBlock {
                bending: bending(operator, node as usize),
                curvatures: curvatures(placement.within(node), placement.grid.inverse_cell()),
                sum: &mut sum,
            });
        }
    }
    sum
}

/// `V² M` of one row.
fn bending(operator: &Operator<'_>, node: usize) -> [[f64; 6]; 6] {
    let mut squares = [[0.0; 6]; 6];
    let mut mixed = [DVec3::ZERO; 6];
    let row = operator.neighborhoods.row(node);
    let weights = &operator.weights[operator.neighborhoods.pairs(node)];
    for (&j, &w) in row.iter().zip(weights) {
        let x = operator.positions[j as usize] - operator.positions[node];
        let half = x * 0.5;
        let t = [
            half.x * x.x,
            half.y * x.y,
            half.z * x.z,
            x.y * x.z,
            x.z * x.x,
            x.x * x.y,
        ];
        for (k, tk) in t.iter().enumerate() {
            mixed[k] += x * (w * tk);
            for (sum, tl) in squares[k].iter_mut().zip(&t) {
                *sum += w * tk * tl;
            }
        }
    }
    let scale = operator.scale[node];
    let slopes = mixed.map(|c| operator.moment_inverses[node] * c);
    // Σ_k M_kk of the sum alone.
    let share = STIFFENING * (0..6).map(|k| squares[k][k]).sum::<f64>();
    for (row, c) in squares.iter_mut().zip(&mixed) {
        for (entry, slope) in row.iter_mut().zip(&slopes) {
            *entry = (*entry - c.dot(*slope)) * scale;
        }
    }
    for (k, row) in squares.iter_mut().enumerate() {
        row[k] += share * scale;
    }
    squares
}

/// Second derivatives xx, yy, zz, yz, zx, xy of the 27 splines at a node.
fn curvatures(within: [f64; 3], inverse_cell: f64) -> [[f64; PADDED]; 6] {
    let value = within.map(spline_values);
    let slope = within.map(spline_slopes);
    let orders = [
        [2, 0, 0],
        [0, 2, 0],
        [0, 0, 2],
        [0, 1, 1],
        [1, 0, 1],
        [1, 1, 0],
    ];
    let scale = inverse_cell * inverse_cell;
    orders.map(|order: [usize; 3]| {
        let part = |axis: usize| match order[axis] {
            0 => value[axis],
            1 => slope[axis],
            _ => SPLINE_CURVATURES,
        };
        let [x, y, z] = [part(0), part(1), part(2)];
        std::array::from_fn(|k| {
            if k < LOCAL {
                x[k % 3] * y[k / 3 % 3] * (z[k / 9] * scale)
            } else {
                0.0
            }
        })
    })
}

/// `sum += Bᵀ M B` for one node.
struct NodeBlock<'a> {
    bending: [[f64; 6]; 6],
    curvatures: [[f64; PADDED]; 6],
    sum: &'a mut CellMatrix,
}

impl WithSimd for NodeBlock<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut products = [[0.0; PADDED]; 6];
        for (product, row) in products.iter_mut().zip(&self.bending) {
            for (m, b) in row.iter().zip(&self.curvatures) {
                for (sum, b) in product.iter_mut().zip(b) {
                    *sum += m * b;
                }
            }
        }
        for (a, row) in self.sum.iter_mut().enumerate() {
            for (b, product) in self.curvatures.iter().zip(&products) {
                let value = b[a];
                for (sum, p) in row.iter_mut().zip(product) {
                    *sum += value * p;
                }
            }
        }
    }
}
