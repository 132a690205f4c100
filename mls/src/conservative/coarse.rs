//! Coarse space of the solve for μ.
//!
//! The operator acts like a fourth derivative: its null space is affine, and the smooth fields next
//! to it are what makes plain conjugate gradients need a number of iterations proportional to the
//! square of the nodes per side. Those fields are well expressed by quadratic B-splines on a regular
//! grid a few spacings wide. Their Galerkin matrix is factored once; adding its solution to the
//! Jacobi step leaves only the short waves to the iteration.

#![allow(
    clippy::needless_range_loop,
    reason = "lanes are walked in step over several arrays"
)]

use std::ops::Range;

use glam::{DMat3, DVec3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::solve::Operator;
use crate::parallel::{ROWS_PER_TASK, to_u32};
use crate::symmetric::{SymmetricEigen, outer};

/// Width of a grid cell in mean node spacings, at the least.
const SMALLEST_CELL: f64 = 3.0;

/// Most splines: the factor is dense, so its cost grows with the third power.
const LARGEST_SPACE: usize = 1600;

/// Nodes per spline, at the least: below this the coarse solve costs more than it saves.
const NODES_PER_SPLINE: usize = 12;

/// Pivots of the scaled coarse matrix below this belong to splines that the ones before them express
/// on the nodes; they are left to the iteration.
const SMALLEST_PIVOT: f64 = 1e-10;

/// Nodes whose local matrices are held at a time.
const BATCH: usize = 512;

/// Number of partial sums of the restriction, fixed so that the bits do not depend on threads.
const PARTS: usize = 16;

/// Marks a spline that no node touches.
const NONE: u32 = u32::MAX;

/// Splines at a node: the first of three per axis, and their values.
#[derive(Debug, Clone, Copy)]
struct Splines {
    first: [u32; 3],
    values: [[f64; 3]; 3],
}

/// Factored Galerkin matrix on a grid of splines.
pub(super) struct CoarseSpace {
    sizes: [usize; 3],
    numbers: Vec<u32>,
    splines: Vec<Splines>,
    count: usize,
    /// Rows of the lower factor of the scaled matrix, row k with k entries, then `1/pivot` apart.
    factor: Vec<f64>,
    pivots: Vec<f64>,
    scale: Vec<f64>,
}

impl CoarseSpace {
    /// Builds the space for the rows that take part; `None` if the cloud is too small to profit.
    ///
    /// The matrix has the affine fields of every piece as its null space; `σ u uᵀ` with
    /// `u = Pᵀ q` for orthonormal affine q makes it definite and leaves the answers to right-hand
    /// sides without affine part as they are, without affine part themselves.
    pub(super) fn new(operator: &Operator<'_>, pieces: &[Vec<u32>]) -> Option<Self> {
        let mut space = grid(operator)?;
        let mut matrix = space.galerkin(operator);
        for piece in pieces {
            space.fix_affine_fields(operator.positions, piece, &mut matrix);
        }
        space.factorize(matrix);
        Some(space)
    }

    fn number(&self, at: [usize; 3]) -> u32 {
        self.numbers[at[0] + self.sizes[0] * (at[1] + self.sizes[1] * at[2])]
    }

    /// Calls `visit(number of the first, values)` for the nine runs of three splines at a node; splines
    /// next to each other along x that a node touches have consecutive numbers.
    #[inline(always)]
    fn for_runs(&self, node: usize, mut visit: impl FnMut(usize, [f64; 3])) {
        let Splines { first, values } = self.splines[node];
        let first = first.map(|f| f as usize);
        for (k, vz) in values[2].iter().enumerate() {
            for (j, vy) in values[1].iter().enumerate() {
                let row = self.sizes[0] * (first[1] + j + self.sizes[1] * (first[2] + k));
                let yz = vy * vz;
                let number = self.numbers[row + first[0]];
                visit(number as usize, values[0].map(|vx| vx * yz));
            }
        }
    }

    /// Calls `visit(spline number, value)` for the 27 splines at a node.
    fn for_splines(&self, node: usize, mut visit: impl FnMut(usize, f64)) {
        self.for_runs(node, |first, values| {
            for (number, value) in (first..).zip(values) {
                visit(number, value);
            }
        });
    }

    /// Adds `P A_c⁻¹ Pᵀ r` to `z`.
    pub(super) fn add_correction(&self, r: &[DVec3], z: &mut [DVec3]) {
        let length = r.len().div_ceil(PARTS);
        let arch = Arch::new();
        let parts: Vec<Vec<[f64; 4]>> = (0..PARTS)
            .into_par_iter()
            .map(|part| {
                let mut sums = vec![[0.0; 4]; self.count];
                arch.dispatch(Restriction {
                    space: self,
                    nodes: (part * length).min(r.len())..((part + 1) * length).min(r.len()),
                    r,
                    sums: &mut sums,
                });
                sums
            })
            .collect();
        let mut coarse = vec![DVec3::ZERO; self.count];
        for part in &parts {
            for (sum, value) in coarse.iter_mut().zip(part) {
                *sum += DVec3::new(value[0], value[1], value[2]);
            }
        }
        self.solve(&mut coarse);
        let coarse: Vec<[f64; 4]> = coarse.iter().map(|c| [c.x, c.y, c.z, 0.0]).collect();
        z.par_chunks_mut(ROWS_PER_TASK)
            .enumerate()
            .for_each(|(chunk, z)| {
                arch.dispatch(Prolongation {
                    space: self,
                    first: chunk * ROWS_PER_TASK,
                    coarse: &coarse,
                    z,
                });
            });
    }

    /// Galerkin matrix `Σ_i Σ_j D_ij e_ij e_ijᵀ` over the splines, lower triangle by rows.
    fn galerkin(&self, operator: &Operator<'_>) -> Vec<f64> {
        let mut matrix = vec![0.0; self.count * (self.count + 1) / 2];
        let nodes: Vec<usize> = (0..self.splines.len())
            .filter(|&i| operator.scale[i] > 0.0)
            .collect();
        for batch in nodes.chunks(BATCH) {
            let locals: Vec<Local> = batch
                .par_iter()
                .with_min_len(64)
                .map_init(Vec::new, |scratch, &node| {
                    self.local(operator, node, scratch)
                })
                .collect();
            for local in locals {
                let m = local.numbers.len();
                for (i, &row) in local.numbers.iter().enumerate() {
                    for (j, &column) in local.numbers.iter().enumerate().take(i + 1) {
                        // Numbers rise with the local index, so (row, column) is below the diagonal.
                        let place = row as usize * (row as usize + 1) / 2 + column as usize;
                        matrix[place] += local.matrix[i * m + j];
                    }
                }
            }
        }
        matrix
    }

    /// Adds `σ u uᵀ` for the affine fields of one piece.
    #[allow(clippy::cast_precision_loss, reason = "node counts are far below 2^53")]
    fn fix_affine_fields(&self, positions: &[DVec3], piece: &[u32], matrix: &mut [f64]) {
        let start = |row: usize| row * (row + 1) / 2;
        let share = (piece.len() as f64).recip();
        let at = |node: u32| positions[node as usize];
        let centre = piece.iter().fold(DVec3::ZERO, |sum, &node| sum + at(node)) * share;
        let mut inertia = DMat3::ZERO;
        for &node in piece {
            inertia += outer(at(node) - centre, at(node) - centre);
        }
        let eigen = SymmetricEigen::new(&inertia);
        let axes = [0, 1, 2].map(|k| {
            if eigen.values[k] > eigen.values[0] * 1e-6 {
                eigen.vectors[k] / eigen.values[k].sqrt()
            } else {
                DVec3::ZERO
            }
        });
        let mut fields = vec![[0.0; 4]; self.count];
        let mut touched = vec![false; self.count];
        for &node in piece {
            let x = at(node) - centre;
            let q = [share.sqrt(), axes[0].dot(x), axes[1].dot(x), axes[2].dot(x)];
            self.for_splines(node as usize, |number, spline| {
                touched[number] = true;
                for (sum, q) in fields[number].iter_mut().zip(q) {
                    *sum += spline * q;
                }
            });
        }
        let numbers: Vec<usize> = (0..self.count).filter(|&k| touched[k]).collect();
        let stiffness: f64 = numbers.iter().map(|&k| matrix[start(k) + k]).sum();
        let sigma = stiffness * share;
        for (place, &row) in numbers.iter().enumerate() {
            for &column in &numbers[..=place] {
                let product: f64 = fields[row]
                    .iter()
                    .zip(&fields[column])
                    .map(|(a, b)| a * b)
                    .sum();
                matrix[start(row) + column] += sigma * product;
            }
        }
    }

    /// Contribution of one row of the operator.
    fn local(&self, operator: &Operator<'_>, node: usize, scratch: &mut Vec<f64>) -> Local {
        let row = operator.neighborhoods.row(node);
        let mut low = self.splines[node].first;
        let mut high = low;
        for &j in row {
            for axis in 0..3 {
                low[axis] = low[axis].min(self.splines[j as usize].first[axis]);
                high[axis] = high[axis].max(self.splines[j as usize].first[axis]);
            }
        }
        let sizes = [0, 1, 2].map(|axis| (high[axis] - low[axis]) as usize + 3);
        let low = low.map(|l| l as usize);
        let box_size = sizes[0] * sizes[1] * sizes[2];
        // Values of all splines of the box at the node, then at each neighbour.
        scratch.clear();
        scratch.resize(box_size * (row.len() + 1), 0.0);
        let nodes = std::iter::once(node).chain(row.iter().map(|&j| j as usize));
        for (out, other) in scratch.chunks_mut(box_size).zip(nodes) {
            let Splines { first, values } = self.splines[other];
            for (k, vz) in values[2].iter().enumerate() {
                for (j, vy) in values[1].iter().enumerate() {
                    for (i, vx) in values[0].iter().enumerate() {
                        let at = [i, j, k];
                        let at = [0, 1, 2].map(|a| first[a] as usize + at[a] - low[a]);
                        out[at[0] + sizes[0] * (at[1] + sizes[1] * at[2])] = vx * vy * vz;
                    }
                }
            }
        }
        let (own, others) = scratch.split_at_mut(box_size);
        let weights = &operator.weights[operator.neighborhoods.pairs(node)];
        let mut slopes = vec![DVec3::ZERO; box_size];
        let offset = |j: u32| operator.positions[j as usize] - operator.positions[node];
        for ((&j, &w), values) in row.iter().zip(weights).zip(others.chunks_mut(box_size)) {
            let g = operator.moment_inverses[node] * (offset(j) * w);
            for ((value, own), slope) in values.iter_mut().zip(&*own).zip(&mut slopes) {
                *value -= own;
                *slope += g * *value;
            }
        }
        for (&j, values) in row.iter().zip(others.chunks_mut(box_size)) {
            let x = offset(j);
            for (value, slope) in values.iter_mut().zip(&slopes) {
                *value -= slope.dot(x);
            }
        }
        let mut places = Vec::with_capacity(box_size);
        let mut numbers = Vec::with_capacity(box_size);
        for place in 0..box_size {
            let at = [
                place % sizes[0],
                place / sizes[0] % sizes[1],
                place / (sizes[0] * sizes[1]),
            ];
            let number = self.number([0, 1, 2].map(|a| low[a] + at[a]));
            if number != NONE {
                places.push(place);
                numbers.push(number);
            }
        }
        let m = places.len();
        let mut matrix = vec![0.0; m * m];
        for (&w, values) in weights.iter().zip(others.chunks_mut(box_size)) {
            // The places rise, so closing the gaps in place overwrites nothing still needed.
            for (to, &from) in places.iter().enumerate() {
                values[to] = values[from];
            }
            let weight = w * operator.scale[node];
            for (i, row) in matrix.chunks_exact_mut(m).enumerate() {
                let e = values[i] * weight;
                for (slot, value) in row[..=i].iter_mut().zip(&values[..=i]) {
                    *slot += e * value;
                }
            }
        }
        Local { numbers, matrix }
    }

    /// Cholesky factor of the matrix scaled to unit diagonal; weak pivots are dropped.
    fn factorize(&mut self, mut matrix: Vec<f64>) {
        let n = self.count;
        let start = |row: usize| row * (row + 1) / 2;
        self.scale = (0..n)
            .map(|k| {
                let diagonal = matrix[start(k) + k];
                if diagonal > 0.0 {
                    diagonal.sqrt().recip()
                } else {
                    0.0
                }
            })
            .collect();
        self.pivots = vec![0.0; n];
        let arch = Arch::new();
        for i in 0..n {
            let (above, rest) = matrix.split_at_mut(start(i));
            let row = &mut rest[..=i];
            for (entry, scale) in row.iter_mut().zip(&self.scale) {
                *entry *= scale * self.scale[i];
            }
            arch.dispatch(Elimination {
                above,
                pivots: &self.pivots,
                row: &mut row[..i],
            });
            let square: f64 = row[..i].iter().map(|a| a * a).sum();
            let pivot = row[i] - square;
            self.pivots[i] = if pivot > SMALLEST_PIVOT {
                pivot.sqrt().recip()
            } else {
                0.0
            };
        }
        self.factor = matrix;
    }

    /// `A_c⁻¹` on the splines that kept their pivot.
    fn solve(&self, b: &mut [DVec3]) {
        let start = |row: usize| row * (row + 1) / 2;
        for i in 0..self.count {
            let row = &self.factor[start(i)..start(i) + i];
            let mut sum = b[i] * self.scale[i];
            for (l, value) in row.iter().zip(&*b) {
                sum -= *value * *l;
            }
            b[i] = sum * self.pivots[i];
        }
        for i in (0..self.count).rev() {
            let row = &self.factor[start(i)..start(i) + i];
            let value = b[i] * self.pivots[i];
            for (l, other) in row.iter().zip(b.iter_mut()) {
                *other -= value * *l;
            }
            b[i] = value * self.scale[i];
        }
    }
}

/// One row of the factor, but its pivot, from the rows above.
struct Elimination<'a> {
    above: &'a [f64],
    pivots: &'a [f64],
    row: &'a mut [f64],
}

impl WithSimd for Elimination<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for j in 0..self.row.len() {
            let start = j * (j + 1) / 2;
            let (done, rest) = self.row.split_at_mut(j);
            rest[0] = (rest[0] - dot(done, &self.above[start..start + j])) * self.pivots[j];
        }
    }
}

/// Sum of products in eight lanes, whatever the width of a register.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    let (a, a_rest) = a.as_chunks::<8>();
    let (b, b_rest) = b.as_chunks::<8>();
    for (a, b) in a.iter().zip(b) {
        for k in 0..8 {
            lanes[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    lanes.iter().sum::<f64>() + rest
}

/// `sums += Pᵀ r` over some nodes.
struct Restriction<'a> {
    space: &'a CoarseSpace,
    nodes: Range<usize>,
    r: &'a [DVec3],
    sums: &'a mut [[f64; 4]],
}

impl WithSimd for Restriction<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for node in self.nodes {
            let r = self.r[node];
            let r = [r.x, r.y, r.z, 0.0];
            self.space.for_runs(node, |first, values| {
                let run = &mut self.sums[first..first + 3];
                for (sum, value) in run.iter_mut().zip(values) {
                    for k in 0..4 {
                        sum[k] += r[k] * value;
                    }
                }
            });
        }
    }
}

/// `z += P coarse` for some nodes.
struct Prolongation<'a> {
    space: &'a CoarseSpace,
    first: usize,
    coarse: &'a [[f64; 4]],
    z: &'a mut [DVec3],
}

impl WithSimd for Prolongation<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (node, z) in (self.first..).zip(self.z) {
            let mut sum = [0.0; 4];
            self.space.for_runs(node, |first, values| {
                let run = &self.coarse[first..first + 3];
                for (coarse, value) in run.iter().zip(values) {
                    for k in 0..4 {
                        sum[k] += coarse[k] * value;
                    }
                }
            });
            *z += DVec3::new(sum[0], sum[1], sum[2]);
        }
    }
}

/// Part of the Galerkin matrix that one row adds; numbers rise.
struct Local {
    numbers: Vec<u32>,
    matrix: Vec<f64>,
}

/// Chooses the cell width and numbers the splines that nodes touch.
#[allow(clippy::cast_precision_loss, reason = "node counts are far below 2^53")]
fn grid(operator: &Operator<'_>) -> Option<CoarseSpace> {
    let positions = operator.positions;
    let limit = LARGEST_SPACE.min(positions.len() / NODES_PER_SPLINE);
    if limit < 27 {
        return None;
    }
    let low = positions.iter().copied().reduce(DVec3::min)?;
    let high = positions.iter().copied().reduce(DVec3::max)?;
    let spacing = mean_spacing(operator)?;
    let mut cell = spacing * SMALLEST_CELL;
    loop {
        let cells = ((high - low) / cell).floor();
        if cells.max_element() < 1.0 {
            return None;
        }
        // Three splines reach into the last cell.
        let dense = (cells + 3.0).element_product();
        if dense <= 64.0 * limit as f64 {
            let space = number_splines(positions, low, cells, cell);
            if space.count <= limit {
                return Some(space);
            }
        }
        cell *= 1.2;
    }
}

/// Mean distance between neighbours.
#[allow(clippy::cast_precision_loss, reason = "pair counts are far below 2^53")]
fn mean_spacing(operator: &Operator<'_>) -> Option<f64> {
    let mut sum = 0.0;
    for (node, &at) in operator.positions.iter().enumerate() {
        for &j in operator.neighborhoods.row(node) {
            sum += (operator.positions[j as usize] - at).length();
        }
    }
    let mean = sum / operator.neighborhoods.pair_count() as f64;
    (mean > 0.0 && mean.is_finite()).then_some(mean)
}

/// Splines at every node of a grid, numbered in the order of the grid.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "cell indices lie between 0 and the number of cells, which is small"
)]
fn number_splines(positions: &[DVec3], low: DVec3, cells: DVec3, cell: f64) -> CoarseSpace {
    let sizes = (cells + 3.0).to_array().map(|s| s as usize);
    let mut numbers = vec![NONE; sizes[0] * sizes[1] * sizes[2]];
    let splines: Vec<Splines> = positions
        .iter()
        .map(|&x| {
            let at = (x - low) / cell;
            let first = at.floor().clamp(DVec3::ZERO, cells);
            let values = (at - first).to_array().map(|t| {
                [
                    0.5 * (1.0 - t) * (1.0 - t),
                    0.75 - (t - 0.5) * (t - 0.5),
                    0.5 * t * t,
                ]
            });
            Splines {
                first: first.to_array().map(|f| f as u32),
                values,
            }
        })
        .collect();
    for at in &splines {
        let [x, y, z] = at.first.map(|f| f as usize);
        for k in z..z + 3 {
            for j in y..y + 3 {
                let row = sizes[0] * (j + sizes[1] * k);
                numbers[row + x..row + x + 3].fill(0);
            }
        }
    }
    let mut count = 0;
    for number in numbers.iter_mut().filter(|number| **number != NONE) {
        *number = to_u32(count);
        count += 1;
    }
    CoarseSpace {
        sizes,
        numbers,
        splines,
        count,
        factor: Vec::new(),
        pivots: Vec::new(),
        scale: Vec::new(),
    }
}
