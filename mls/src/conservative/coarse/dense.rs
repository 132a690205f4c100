//! The coarsest matrix, factored.

use glam::DVec3;

use super::grid::{Grid, Lanes, add};
use super::level::{Level, STENCIL};
use crate::conservative::pieces::centred;

/// Pivots of the scaled matrix below this belong to splines that the ones before them express on the
/// nodes; they are left to the iteration.
const SMALLEST_PIVOT: f64 = 1e-10;

/// Marks a spline that does not take part.
const NONE: u32 = u32::MAX;

/// Lower triangle of a symmetric matrix on the splines of a level, by rows.
pub(super) struct Triangle {
    entries: Vec<f64>,
    count: usize,
    /// Number of the spline at a position.
    numbers: Vec<u32>,
}

/// Where a row of a lower triangle starts.
fn start(row: usize) -> usize {
    row * (row + 1) / 2
}

impl Triangle {
    /// The matrix of a level.
    pub(super) fn new(level: &Level) -> Self {
        let mut numbers = vec![NONE; level.grid.len()];
        for (number, &place) in (0..).zip(&level.places) {
            numbers[place as usize] = number;
        }
        let count = level.places.len();
        let mut entries = vec![0.0; start(count)];
        let [_, y, z] = level.grid.steps();
        for (row, (&place, stencil)) in level.places.iter().zip(&level.stencils).enumerate() {
            // Places rise with the numbers: the first half of a stencil is left of the diagonal.
            for (k, value) in stencil[..=STENCIL / 2].iter().enumerate() {
                let other = place as usize + k % 5 + k / 5 % 5 * y + k / 25 * z;
                let column = numbers[other - 2 - 2 * y - 2 * z];
                if column != NONE {
                    entries[start(row) + column as usize] = *value;
                }
            }
        }
        Self {
            entries,
            count,
            numbers,
        }
    }

    /// Adds `σ u uᵀ` with `u = Pᵀ q` for orthonormal affine fields q of one piece: its null space.
    ///
    /// That makes the matrix definite and leaves the answers to right-hand sides without affine part as
    /// they are, without affine part themselves.
    pub(super) fn fix_affine_fields(&mut self, grid: &Grid, positions: &[DVec3], piece: &[u32]) {
        let at = |node: u32| positions[node as usize];
        let (share, centre, eigen) = centred(positions, piece);
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
            grid.for_splines(at(node), |place, spline| {
                let number = self.numbers[place] as usize;
                touched[number] = true;
                for (sum, q) in fields[number].iter_mut().zip(q) {
                    *sum += spline * q;
                }
            });
        }
        let numbers: Vec<usize> = (0..self.count).filter(|&k| touched[k]).collect();
        let diagonal = |k: usize| self.entries[start(k) + k];
        let stiffness: f64 = numbers.iter().map(|&k| diagonal(k)).sum();
        let sigma = stiffness * share;
        for (place, &row) in numbers.iter().enumerate() {
            for &column in &numbers[..=place] {
                let both = fields[row].iter().zip(&fields[column]);
                let product: f64 = both.map(|(a, b)| a * b).sum();
                self.entries[start(row) + column] += sigma * product;
            }
        }
    }

    /// Cholesky factor of the matrix scaled to unit diagonal; weak pivots are dropped.
    pub(super) fn factorize(self) -> Factor {
        let n = self.count;
        let mut matrix = self.entries;
        let diagonal = |k: usize| matrix[start(k) + k];
        let scale: Vec<f64> = (0..n)
            .map(|k| {
                if diagonal(k) > 0.0 {
                    diagonal(k).sqrt().recip()
                } else {
                    0.0
                }
            })
            .collect();
        let mut pivots = vec![0.0; n];
        for i in 0..n {
            let (above, rest) = matrix.split_at_mut(start(i));
            let row = &mut rest[..=i];
            for (entry, other) in row.iter_mut().zip(&scale) {
                *entry *= other * scale[i];
            }
            for j in 0..i {
                let (done, rest) = row.split_at_mut(j);
                rest[0] = (rest[0] - dot(done, &above[start(j)..start(j) + j])) * pivots[j];
            }
            let square: f64 = row[..i].iter().map(|a| a * a).sum();
            let pivot = row[i] - square;
            pivots[i] = if pivot > SMALLEST_PIVOT {
                pivot.sqrt().recip()
            } else {
                0.0
            };
        }
        Factor {
            rows: matrix,
            pivots,
            scale,
            work: vec![[0.0; 4]; n],
        }
    }
}

/// Cholesky factor of a scaled matrix.
pub(super) struct Factor {
    /// Row k with k + 1 entries; the last one of each is not used.
    rows: Vec<f64>,
    /// Reciprocals of the diagonal, 0 for dropped ones.
    pivots: Vec<f64>,
    scale: Vec<f64>,
    work: Vec<Lanes>,
}

impl Factor {
    /// Solution for a right-hand side, on the splines that kept their pivot.
    pub(super) fn solve(&mut self, right: &[Lanes]) -> &[Lanes] {
        let Self {
            rows,
            pivots,
            scale,
            work,
        } = self;
        for i in 0..work.len() {
            let mut sum = right[i].map(|x| x * scale[i]);
            for (l, value) in rows[start(i)..start(i) + i].iter().zip(&*work) {
                add(&mut sum, value, -l);
            }
            work[i] = sum.map(|x| x * pivots[i]);
        }
        for i in (0..work.len()).rev() {
            let value = work[i].map(|x| x * pivots[i]);
            for (l, other) in rows[start(i)..start(i) + i].iter().zip(work.iter_mut()) {
                add(other, &value, -l);
            }
            work[i] = value.map(|x| x * scale[i]);
        }
        work
    }
}

/// Sum of products in eight lanes.
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
