//! How many nodes a body has at a spacing, and what cell gives a number of them.

use glam::DVec3;

use crate::sampling::{Measures, SampleError};

/// Mean edge of the lattice's tetrahedra over the cell: six long edges of 1 and eight short ones
/// of `sqrt(3)/2` meet in every point.
pub(crate) const MEAN_EDGE: f64 = 0.923_433_008_258_963_5;
/// Direction of the shifts that break symmetry: the R3 sequence (Roberts 2018).
pub(crate) const SHIFT: DVec3 = DVec3::new(
    0.819_172_513_396_164_4,
    0.671_043_606_703_789_2,
    0.549_700_477_901_970_2,
);
/// Nodes on a surface patch of one squared cell, from the samplings of `examples/quality.rs`;
/// only the first guess of the search uses it.
pub(crate) const SURFACE_NODES: f64 = 0.09;

/// The error of a spacing that needs too many cells, with one that fits: the rim of the lattice shrinks
/// more slowly than the rest of it.
pub(crate) fn too_fine(spacing: f64, cells: f64, limit: f64) -> SampleError {
    SampleError::TooFine {
        spacing,
        cells,
        limit,
        advice: 1.1 * spacing * (cells / limit).cbrt(),
    }
}

/// Nodes of a filling at a cell size, by volume and area.
pub(crate) fn model(a: f64, volume: f64, area: f64) -> f64 {
    (2.0 * volume / a + SURFACE_NODES * area) / (a * a)
}

/// About how many nodes a body has at a spacing.
pub(crate) fn nodes_at(spacing: f64, Measures { volume, area }: Measures) -> f64 {
    model(spacing / MEAN_EDGE, volume, area)
}

/// Root of a falling function by bisection of the logarithm.
pub(crate) fn solve_cell(target: f64, model: impl Fn(f64) -> f64, largest: f64) -> f64 {
    // 100 halvings of 16 decades leave nothing but round-off.
    let (mut low, mut high) = (1e-15 * largest, 10.0 * largest);
    for _ in 0..100 {
        let middle = (low * high).sqrt();
        if model(middle) > target {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low * high).sqrt()
}
