//! Coarse space of the solve for μ.
//!
//! The operator acts like a fourth derivative: its null space is affine, and the smooth fields next
//! to it are what makes plain conjugate gradients need a number of iterations proportional to the
//! square of the nodes per side. Those fields are well expressed by quadratic B-splines on a regular
//! grid somewhat wider than the spacing. One multigrid cycle over grids of cells twice as wide each,
//! down to one that is factored, solves for them well enough; added to the Jacobi step it leaves only
//! the short waves to the iteration, whose count then does not grow with the cloud.

mod bending;
mod coarsen;
mod dense;
mod grid;
mod level;
mod placement;

use glam::DVec3;

use self::bending::bending_stencils;
use self::dense::{Factor, Triangle};
use self::grid::Grid;
use self::level::Level;
use self::placement::GridPlacement;
use super::operator::Operator;

/// Width of a cell of the finest grid in mean node spacings, at the least. Narrower cells save
/// iterations and cost more each.
const SMALLEST_CELL: f64 = 2.0;

/// Nodes per spline, at the least: below this the coarse solve costs more than it saves.
const NODES_PER_SPLINE: usize = 2;

/// Positions of the finest grid per node, at most: bodies that fill little of their box get wider cells.
const PLACES_PER_NODE: usize = 8;

/// Splines of a grid that is factored, at most.
const LARGEST_FACTOR: usize = 400;

/// Grids of splines over a cloud and the factored matrix of the coarsest.
pub(super) struct CoarseSpace {
    placement: GridPlacement,
    /// From the finest on.
    levels: Vec<Level>,
    factor: Factor,
}

impl CoarseSpace {
    /// Builds the space for the nodes that take part; `None` if the cloud is too small to profit.
    pub(super) fn new(
        operator: &Operator<'_>,
        takes_part: &[bool],
        pieces: &[Vec<u32>],
    ) -> Option<Self> {
        let placement = finest(operator, takes_part)?;
        let (places, stencils) = bending_stencils(operator, &placement);
        if places.len() * NODES_PER_SPLINE > operator.positions.len() {
            return None;
        }
        let mut levels = vec![Level::new(placement.grid, places, stencils)];
        let mut last = &levels[0];
        while last.places.len() > LARGEST_FACTOR {
            let coarser = last.coarser();
            if coarser.places.len() >= last.places.len() {
                break;
            }
            levels.push(coarser);
            last = &levels[levels.len() - 1];
        }
        let mut matrix = Triangle::new(last);
        for piece in pieces {
            if takes_part[piece[0] as usize] {
                matrix.fix_affine_fields(&last.grid, operator.positions, piece);
            }
        }
        let factor = matrix.factorize();
        Some(Self {
            placement,
            levels,
            factor,
        })
    }

    /// Adds the cycle's answer to `r` to `z`.
    pub(super) fn add_correction(&mut self, r: &[DVec3], z: &mut [DVec3]) {
        let finest = &mut self.levels[0];
        self.placement
            .restrict(r, &finest.places, &mut finest.right);
        let last = self.levels.len() - 1;
        for k in 0..last {
            let (fine, coarse) = self.levels.split_at_mut(k + 1);
            fine[k].smooth_from_zero();
            fine[k].restrict_to(&mut coarse[0]);
        }
        let coarsest = &mut self.levels[last];
        let solved = self.factor.solve(&coarsest.right);
        for (&place, value) in coarsest.places.iter().zip(solved) {
            coarsest.solution[place as usize] = *value;
        }
        for k in (0..last).rev() {
            let (fine, coarse) = self.levels.split_at_mut(k + 1);
            fine[k].add_from(&coarse[0]);
            fine[k].smooth();
        }
        self.placement.prolong(&self.levels[0].solution, z);
    }
}

/// The finest grid, with the nodes in it.
fn finest(operator: &Operator<'_>, takes_part: &[bool]) -> Option<GridPlacement> {
    let positions = operator.positions;
    let low = positions.iter().copied().reduce(DVec3::min)?;
    let high = positions.iter().copied().reduce(DVec3::max)?;
    let mut cell = mean_spacing(operator)? * SMALLEST_CELL;
    let most = (positions.len() * PLACES_PER_NODE) as f64;
    loop {
        let cells = ((high - low) / cell).floor();
        if cells.max_element() < 1.0 {
            return None;
        }
        if cells.x.max(1.0) * cells.y.max(1.0) * cells.z.max(1.0) <= most {
            let grid = Grid::new(low, high, cell);
            return Some(GridPlacement::new(grid, positions, |node| takes_part[node]));
        }
        cell *= 1.2;
    }
}

/// Mean distance between neighbours.
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
