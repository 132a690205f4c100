//! Quadratic B-splines on a regular grid.
//!
//! Spline s of an axis lives on the cells s − 2, s − 1 and s. Fields on splines are stored on the whole
//! grid with a margin of zeros, so that stencils need no index lists and no ends.

use glam::DVec3;

/// Three components and a spare one: what a register holds.
pub(super) type Lanes = [f64; 4];

/// Zeros before the first spline of an axis.
const BEFORE: usize = 2;

/// Zeros after the last spline of an axis.
const AFTER: usize = 3;

/// A grid of splines.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    low: DVec3,
    cell: f64,
    cells: DVec3,
    /// Splines per axis.
    pub(super) sizes: [usize; 3],
}

impl Grid {
    /// Grid over the box from `low` to `high`.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "callers bound the number of cells first"
    )]
    pub(super) fn new(low: DVec3, high: DVec3, cell: f64) -> Self {
        let cells = ((high - low) / cell).floor();
        // Three splines reach into the last cell.
        let sizes = (cells + 3.0).to_array().map(|s| s as usize);
        Self {
            low,
            cell,
            cells,
            sizes,
        }
    }

    /// The grid of cells twice as wide, whose splines are sums of these.
    pub(super) fn coarser(&self) -> Self {
        Self {
            low: self.low,
            cell: 2.0 * self.cell,
            cells: (self.cells / 2.0).floor(),
            sizes: self.sizes.map(|size| size.div_ceil(2) + 1),
        }
    }

    /// Numbers of positions per axis, margins included.
    fn extents(&self) -> [usize; 3] {
        self.sizes.map(|size| BEFORE + size + AFTER)
    }

    /// Steps in memory along the axes.
    pub(super) fn steps(&self) -> [usize; 3] {
        let [x, y, _] = self.extents();
        [1, x, x * y]
    }

    /// Length of a field, margins included.
    pub(super) fn len(&self) -> usize {
        self.extents().iter().product()
    }

    /// Reciprocal of the width of a cell.
    pub(super) fn inverse_cell(&self) -> f64 {
        self.cell.recip()
    }

    /// Place of a spline.
    pub(super) fn place(&self, at: [usize; 3]) -> usize {
        let steps = self.steps();
        (0..3).map(|axis| (at[axis] + BEFORE) * steps[axis]).sum()
    }

    /// Spline at a position.
    pub(super) fn spline(&self, place: usize) -> [usize; 3] {
        let [x, y, _] = self.extents();
        [place % x, place / x % y, place / (x * y)].map(|at| at - BEFORE)
    }

    /// Cell of a point and where in the cell it lies.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "cell indices lie between 0 and the number of cells"
    )]
    pub(super) fn locate(&self, x: DVec3) -> ([usize; 3], [f64; 3]) {
        let at = (x - self.low) / self.cell;
        let cell = at.floor().clamp(DVec3::ZERO, self.cells);
        (cell.to_array().map(|c| c as usize), (at - cell).to_array())
    }

    /// Calls `visit(place, value)` for the 27 splines at a point.
    pub(super) fn for_splines(&self, x: DVec3, mut visit: impl FnMut(usize, f64)) {
        let (cell, within) = self.locate(x);
        let values = within.map(spline_values);
        let steps = self.steps();
        let first = self.place(cell);
        for (k, vz) in values[2].iter().enumerate() {
            for (j, vy) in values[1].iter().enumerate() {
                for (i, vx) in values[0].iter().enumerate() {
                    visit(first + i + j * steps[1] + k * steps[2], vx * vy * vz);
                }
            }
        }
    }
}

/// `sum += value · factor`.
#[inline(always)]
pub(super) fn add(sum: &mut Lanes, value: &Lanes, factor: f64) {
    for (sum, value) in sum.iter_mut().zip(value) {
        *sum += value * factor;
    }
}

/// Values of the three splines of a cell.
#[inline(always)]
pub(super) fn spline_values(t: f64) -> [f64; 3] {
    [
        0.5 * (1.0 - t) * (1.0 - t),
        0.75 - (t - 0.5) * (t - 0.5),
        0.5 * t * t,
    ]
}

/// Slopes of the three splines of a cell, per cell width.
pub(super) fn spline_slopes(t: f64) -> [f64; 3] {
    [t - 1.0, 1.0 - 2.0 * t, t]
}

/// Curvatures of the three splines of a cell, per cell width squared.
pub(super) const SPLINE_CURVATURES: [f64; 3] = [1.0, -2.0, 1.0];
