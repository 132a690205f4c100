//! One grid of the cycle: its matrix as stencils, smoothing, and the transfer to the next grid.

use pulp::{Arch, Simd, WithSimd};

use super::grid::{Grid, Lanes, add};
use crate::parallel::share_out;

/// Entries of a stencil: splines up to two apart along every axis.
pub(super) const STENCIL: usize = 125;

/// Splines given to one task.
const SPLINES_PER_TASK: usize = 128;

/// Smoothing step in units of the inverse largest eigenvalue: below 2, where it would diverge, and
/// above 1, because the short waves are what it is for.
const STEP: f64 = 1.5;

/// Steps of the power iteration for the largest eigenvalue, which it meets from below within 10 %.
const POWER_STEPS: usize = 12;

/// Allowance for what the power iteration misses.
const POWER_MARGIN: f64 = 1.15;

/// Fraction of a coarse spline in the fine ones `2S − 2 .. 2S + 2`.
pub(super) const SHARES: [f64; 4] = [0.25, 0.75, 0.75, 0.25];

/// Matrix and fields on one grid.
pub(super) struct Level {
    pub(super) grid: Grid,
    /// Places of the splines that take part, ascending.
    pub(super) places: Vec<u32>,
    /// Per spline its row of the matrix, entry `(dx + 2) + 5 (dy + 2) + 25 (dz + 2)`.
    pub(super) stencils: Vec<[f64; STENCIL]>,
    /// Smoothing step: a fraction of the inverse diagonal, 0 where there is none.
    steps: Vec<f64>,
    /// Right-hand side, by spline.
    pub(super) right: Vec<Lanes>,
    /// Solution, on the whole grid.
    pub(super) solution: Vec<Lanes>,
    /// Residual, by spline.
    residual: Vec<Lanes>,
    /// Residual, on the whole grid.
    spread: Vec<Lanes>,
}

impl Level {
    /// Level of a matrix given by the stencils at some positions.
    pub(super) fn new(grid: Grid, places: Vec<u32>, stencils: Vec<[f64; STENCIL]>) -> Self {
        let inverse = |row: &[f64; STENCIL]| {
            let diagonal = row[STENCIL / 2];
            if diagonal > 0.0 && diagonal.recip().is_finite() {
                diagonal.recip()
            } else {
                0.0
            }
        };
        let mut level = Self {
            grid,
            steps: stencils.iter().map(inverse).collect(),
            right: vec![[0.0; 4]; places.len()],
            solution: vec![[0.0; 4]; grid.len()],
            residual: vec![[0.0; 4]; places.len()],
            spread: vec![[0.0; 4]; grid.len()],
            places,
            stencils,
        };
        let step = STEP / level.largest_eigenvalue();
        for share in &mut level.steps {
            *share *= step;
        }
        level
    }

    /// Largest eigenvalue of the matrix scaled by its diagonal, with a margin.
    fn largest_eigenvalue(&mut self) -> f64 {
        for (k, &place) in (0_u32..).zip(&self.places) {
            // Any rough field will do; this one is the same every time.
            let part = |lane: u32| f64::from((k % 11 * 7 + lane * 5) % 11) - 5.3;
            self.solution[place as usize] = [part(0), part(1), part(2), 0.0];
        }
        let size = |field: &[Lanes]| field.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
        let mut largest = 1.0;
        let mut before = size(&self.solution);
        for _ in 0..POWER_STEPS {
            // The right-hand side is zero here.
            self.take_residual();
            for (residual, inverse) in self.residual.iter_mut().zip(&self.steps) {
                *residual = residual.map(|r| r * inverse);
            }
            let after = size(&self.residual);
            if before == 0.0 || after == 0.0 {
                break;
            }
            largest = after / before;
            for (&place, value) in self.places.iter().zip(&self.residual) {
                self.solution[place as usize] = value.map(|x| x / after);
            }
            before = 1.0;
        }
        largest * POWER_MARGIN
    }

    /// `residual = right − A solution`.
    fn take_residual(&mut self) {
        let arch = Arch::new();
        let [_, y, z] = self.grid.steps();
        let runs = std::array::from_fn(|run| run % 5 * y + run / 5 * z);
        let (solution, right) = (&self.solution, &self.right);
        let (places, stencils) = (&self.places, &self.stencils);
        share_out(self.residual.chunks_mut(SPLINES_PER_TASK), |chunk, out| {
            arch.dispatch(Residual {
                runs,
                field: solution,
                first: chunk * SPLINES_PER_TASK,
                places,
                stencils,
                right,
                out,
            });
        });
    }

    /// First smoothing step, from zero.
    pub(super) fn smooth_from_zero(&mut self) {
        let steps = self.places.iter().zip(&self.right).zip(&self.steps);
        for ((&place, right), step) in steps {
            self.solution[place as usize] = right.map(|r| r * step);
        }
    }

    /// One more smoothing step.
    pub(super) fn smooth(&mut self) {
        self.take_residual();
        let steps = self.places.iter().zip(&self.residual).zip(&self.steps);
        for ((&place, residual), step) in steps {
            add(&mut self.solution[place as usize], residual, *step);
        }
    }

    /// Puts the residual of this level on the right of the coarser one.
    pub(super) fn restrict_to(&mut self, coarse: &mut Self) {
        self.take_residual();
        for (&place, residual) in self.places.iter().zip(&self.residual) {
            self.spread[place as usize] = *residual;
        }
        let (fine, residual) = (self.grid, &self.spread);
        let [_, y, z] = fine.steps();
        let grid = coarse.grid;
        let right = coarse.right.chunks_mut(SPLINES_PER_TASK);
        let parts = right.zip(coarse.places.chunks(SPLINES_PER_TASK));
        share_out(parts, |_, (right, places)| {
            for (right, &place) in right.iter_mut().zip(places) {
                let start = first_child(&fine, grid.spline(place as usize));
                let mut sum = [0.0; 4];
                for k in 0..4 {
                    for j in 0..4 {
                        let across = SHARES[j] * SHARES[k];
                        let run = &residual[start + j * y + k * z..][..4];
                        for (share, value) in SHARES.iter().zip(run) {
                            add(&mut sum, value, share * across);
                        }
                    }
                }
                *right = sum;
            }
        });
    }

    /// Adds the solution of the coarser level to this one.
    pub(super) fn add_from(&mut self, coarse: &Self) {
        let (fine, grid) = (self.grid, coarse.grid);
        for &place in &self.places {
            let parents = fine.spline(place as usize).map(parents);
            let value = &mut self.solution[place as usize];
            for (z, vz) in parents[2] {
                for (y, vy) in parents[1] {
                    for (x, vx) in parents[0] {
                        add(value, &coarse.solution[grid.place([x, y, z])], vx * vy * vz);
                    }
                }
            }
        }
    }
}

/// Coarse splines that hold a fine one, with its fraction in them.
pub(super) fn parents(s: usize) -> [(usize, f64); 2] {
    if s.is_multiple_of(2) {
        [(s / 2, 0.75), (s / 2 + 1, 0.25)]
    } else {
        [(s / 2, 0.25), (s / 2 + 1, 0.75)]
    }
}

/// Place of the fine spline `2S − 2` of a coarse one along every axis; it may lie in the margin.
pub(super) fn first_child(fine: &Grid, at: [usize; 3]) -> usize {
    let [x, y, z] = fine.steps();
    fine.place(at.map(|s| 2 * s)) - 2 * (x + y + z)
}

/// `out = right − A field` for some splines.
struct Residual<'a> {
    /// Starts of the 25 runs of five neighbours after that of the first.
    runs: [usize; 25],
    field: &'a [Lanes],
    first: usize,
    places: &'a [u32],
    stencils: &'a [[f64; STENCIL]],
    right: &'a [Lanes],
    out: &'a mut [Lanes],
}

impl WithSimd for Residual<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        // From a spline to the first of its 125 neighbours.
        let back = self.runs[12] + 2;
        for (k, out) in (self.first..).zip(self.out) {
            let start = self.places[k] as usize - back;
            let mut sums = [[0.0; 4]; 5];
            for (run, values) in self.runs.iter().zip(self.stencils[k].as_chunks::<5>().0) {
                let field = &self.field[start + run..start + run + 5];
                for ((sum, value), field) in sums.iter_mut().zip(values).zip(field) {
                    add(sum, field, *value);
                }
            }
            *out = self.right[k];
            for sum in &sums {
                add(out, sum, -1.0);
            }
        }
    }
}
