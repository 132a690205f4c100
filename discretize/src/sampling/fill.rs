//! Filling a body with tetrahedra at a cell size, and the search for the cell size that gives a
//! wanted number of nodes.

use glam::DVec3;

use crate::mesh::{Bounds, tetrahedra_edges};
use crate::sampling::slimness;
use crate::sampling::{
    BackgroundMesh, Graded, Lattice, MEAN_EDGE, Measures, Octree, SHIFT, SURFACE_NODES,
    SampleError, SampleSettings, Slimness, Solid, Stuffed, improve, model, solve_cell, stuff,
    too_fine,
};

/// Rounds of the search for a spacing that gives the wanted number of nodes.
const COUNT_ROUNDS: usize = 16;
/// Rounds in which only a promising filling is improved.
const CHEAP_ROUNDS: usize = 3;
/// Rounds after which the lattice leaves the symmetry of the body.
const SYMMETRIC_ROUNDS: usize = 5;
/// Tolerances in which a count is met once the lattice has left the symmetry: a body a few cells thick has no
/// sampling between one number of layers and the next.
pub(crate) const JUMPS: f64 = 2.0;

/// The same where all rounds are over: a layer more or less is `n^(-1/3)` of `n` nodes.
pub(crate) fn last_jumps(wanted: f64) -> f64 {
    JUMPS.max(14.0 / wanted.cbrt())
}

/// Longest side of a box over a cell that is too large for it.
const LEAST_FIT: f64 = 0.5;
/// Relative tolerance of a wanted spacing, and rounds of the search for its cell size.
const SPACING_TOLERANCE: f64 = 0.04;
const SPACING_ROUNDS: usize = 4;
/// Smallest cell that is tried over the first guess: it gives 6 to 15 times the nodes.
const SMALLEST_STEP: f64 = 0.4;
/// Fraction of the surface nodes that improving removes, from the same samplings; a first guess too.
const REMOVED: f64 = 0.66;

/// Fills one body as the settings say.
pub(crate) struct Filler<'a> {
    solid: &'a Solid,
    settings: &'a SampleSettings,
}

impl<'a> Filler<'a> {
    /// The grading of the settings was checked before.
    pub(crate) fn new(solid: &'a Solid, settings: &'a SampleSettings) -> Self {
        Self { solid, settings }
    }

    /// Tetrahedra at a cell size.
    pub(crate) fn fill(&self, cell: f64) -> Result<Stuffed, SampleError> {
        let mut stuffed = self.raw(cell, DVec3::ZERO)?;
        self.improve(&mut stuffed);
        Ok(stuffed)
    }

    /// Finds the cell size whose tetrahedra have edges as long as wanted where one spacing is.
    ///
    /// Cut tetrahedra have shorter edges than those of the lattice, and improved ones longer: by a
    /// tenth where most nodes are at the surface. A box keeps the cells that fit it.
    pub(crate) fn search_spacing(&self, spacing: f64) -> Result<(Stuffed, f64), SampleError> {
        let mut cell = spacing / MEAN_EDGE;
        let mut nearest: Option<(f64, Stuffed, f64)> = None;
        for _ in 0..SPACING_ROUNDS {
            let stuffed = match self.fill(cell) {
                // Nearer to the limit than was asked for: what a round before it gave stands.
                Err(SampleError::TooFine { .. } | SampleError::Vanished { .. })
                    if nearest.is_some() =>
                {
                    break;
                }
                other => other?,
            };
            if self.solid.is_box {
                // One cell along each side, and these are no longer what was asked for.
                let widest = self.solid.bounds().size().max_element();
                if widest < LEAST_FIT * cell {
                    let largest = self.settings.largest_lattice;
                    return Err(self.body(largest).vanished(cell));
                }
                return Ok((stuffed, cell));
            }
            let ratio = edge_ratio(&stuffed);
            let miss = (cell * MEAN_EDGE * ratio / spacing - 1.0).abs();
            if nearest.as_ref().is_none_or(|(best, ..)| miss < *best) {
                nearest = Some((miss, stuffed, cell));
            }
            if miss <= SPACING_TOLERANCE || !miss.is_finite() {
                break;
            }
            cell = spacing / (MEAN_EDGE * ratio);
        }
        let (_, stuffed, cell) = nearest.expect("the first round leaves one");
        Ok((stuffed, cell))
    }

    fn improve(&self, stuffed: &mut Stuffed) {
        if !self.solid.is_box {
            improve(stuffed, self.solid, self.settings.smoothing_sweeps);
        }
    }

    /// Tetrahedra before they are improved, with the background moved by fractions of a cell; a box, whose faces have to stay
    /// on the background's planes, is rounded differently instead.
    fn raw(&self, cell: f64, shift: DVec3) -> Result<Stuffed, SampleError> {
        if !(cell.is_finite() && cell > 0.0) {
            let spacing = cell * MEAN_EDGE;
            return Err(SampleError::Spacing { spacing });
        }
        let solid = self.solid;
        let bounds = solid.bounds();
        let (cells, start) = if solid.is_box {
            let count = (bounds.size() / cell + 0.5 + shift - shift.round()).floor();
            (bounds.size() / count.max(DVec3::ONE), bounds.min)
        } else {
            let shift = shift + self.solid.offset();
            (DVec3::splat(cell), bounds.min - shift.fract() * cell)
        };
        if self.settings.grading.is_uniform() {
            let lattice = lattice_from(&bounds, cells, start, self.settings.largest_lattice)?;
            self.stuff(&lattice, cell)
        } else {
            let grading = &self.settings.grading;
            let largest = self.settings.largest_octree();
            let octree = Octree::build(solid, cells, start, grading, largest)?;
            self.stuff(&Graded::new(&octree), cell)
        }
    }

    fn body(&self, largest: usize) -> Slimness<'a> {
        Slimness::new(self.solid, largest, usize::MAX, model)
    }

    fn stuff(&self, background: &dyn BackgroundMesh, cell: f64) -> Result<Stuffed, SampleError> {
        let stuffed = stuff(background, self.solid)?;
        if stuffed.tetrahedra.is_empty() || slimness::is_mostly_lost(self.solid, &stuffed) {
            return Err(self.body(self.settings.largest_lattice).vanished(cell));
        }
        Ok(stuffed)
    }

    /// Finds a cell size that gives the wanted number of nodes. The number that an error advises is tried first; where
    /// it has no sampling either, the error is that of the advice.
    pub(crate) fn search(&self, wanted: usize) -> Result<(Stuffed, f64), SampleError> {
        match self.search_once(wanted) {
            Err(SampleError::NodeCount { wanted, reached }) => {
                self.search_once(reached)?;
                Err(SampleError::NodeCount { wanted, reached })
            }
            found => found,
        }
    }

    /// Finds a cell size that gives the wanted number of nodes.
    ///
    /// Model: `n = r (2 V / a^3 + s A / a^2)`, solved for a; r from the last round, then bisection
    /// between the nearest samplings above and below. No round takes cells much smaller than the model
    /// with r = 1 asks for, so that the work is bounded by the number of nodes and the box.
    #[allow(clippy::cast_possible_truncation, reason = "counts")]
    fn search_once(&self, wanted: usize) -> Result<(Stuffed, f64), SampleError> {
        let target = wanted as f64;
        let tolerance = self.settings.count_tolerance * target;
        // Share of the surface nodes that improving removes.
        let mut removed = if self.settings.smoothing_sweeps == 0 || self.solid.is_box {
            0.0
        } else {
            REMOVED
        };
        let solid = self.solid;
        let size = solid.bounds().size();
        let Measures {
            mut volume,
            mut area,
        } = solid.measures();
        let body = Slimness::new(solid, self.settings.largest_lattice, wanted, model);
        body.check_count(wanted)?;
        if solid.is_box && self.settings.grading.is_uniform() {
            return self.fill_box(wanted, &body);
        }
        let first = body.cell_of(target);
        // Grown cells inside leave nodes to the surface.
        let least = if self.settings.grading.is_uniform() {
            SMALLEST_STEP * first
        } else {
            SMALLEST_STEP * first.min((SURFACE_NODES * area / target).sqrt())
        };
        let mut ratio = 1.0;
        let (mut coarse, mut fine) = (f64::INFINITY, 0.0_f64);
        let (mut nearest, mut accepted) = (0.0_f64, None);
        let (mut vanished, mut spent) = (false, 0.0);
        for round in 0..COUNT_ROUNDS {
            let mut cell = solve_cell(
                target / ratio,
                |a| model(a, volume, area),
                size.max_element(),
            );
            if round < SYMMETRIC_ROUNDS && !(cell < coarse && cell > fine) {
                cell = if coarse.is_finite() {
                    0.5 * (coarse + fine)
                } else {
                    2.0 * fine
                };
            }
            if cell < least || body.is_spent(&mut spent, cell) {
                break;
            }
            // A body as symmetric as the lattice jumps in count: leave the symmetry.
            let shift = SHIFT * round.saturating_sub(SYMMETRIC_ROUNDS - 1) as f64;
            let mut stuffed = match self.raw(cell, shift) {
                Err(SampleError::Vanished { .. } | SampleError::Slender { .. }) => {
                    if body.is_thin_for(cell) {
                        return Err(body.vanished(cell));
                    }
                    vanished = true;
                    coarse = coarse.min(cell);
                    continue;
                }
                // Refined regions may take more cells than the model knows of.
                Err(SampleError::TooFine { .. }) if round + 1 < COUNT_ROUNDS => {
                    fine = fine.max(cell);
                    ratio *= 8.0;
                    continue;
                }
                other => other?,
            };
            let raw = stuffed.positions.len() as f64;
            let on_surface = stuffed.on_surface.iter().filter(|s| **s).count() as f64;
            let mut nodes = raw - removed * on_surface;
            if round >= CHEAP_ROUNDS || (nodes - target).abs() <= 0.7 * tolerance {
                self.improve(&mut stuffed);
                nodes = stuffed.positions.len() as f64;
                removed = (raw - nodes) / on_surface;
                let miss = (nodes - target).abs();
                let leaves = round > SYMMETRIC_ROUNDS && self.settings.grading.is_uniform();
                let jumps = if leaves { JUMPS } else { 1.0 };
                if miss <= jumps * tolerance {
                    return Ok((stuffed, cell));
                }
                if miss < (nearest - target).abs() {
                    nearest = nodes;
                    // Graded cells jump as well, where a tree halves them; later rounds may still meet
                    // the count.
                    accepted =
                        (miss <= last_jumps(target) * tolerance).then(|| (stuffed.clone(), cell));
                }
            }
            if nodes < target {
                coarse = coarse.min(cell);
            } else {
                fine = fine.max(cell);
            }
            if solid.mesh().is_none() {
                let mesh = stuffed.into_surface();
                (volume, area) = (mesh.volume(), mesh.area());
            }
            ratio = nodes / model(cell, volume, area);
        }
        accepted.ok_or_else(|| body.missed(wanted, nearest as usize, vanished, first))
    }

    /// Fits a lattice to a box: of the cell counts that give the wanted number of nodes, the one
    /// whose cells are nearest to cubes.
    ///
    /// A fitted lattice of `a b c` cells has `(a+1)(b+1)(c+1)` corners, `a b c` centres and
    /// `2 (a b + b c + c a)` nodes in the middles of the outer squares.
    fn fill_box(&self, wanted: usize, body: &Slimness<'_>) -> Result<(Stuffed, f64), SampleError> {
        let size = self.solid.bounds().size();
        let target = wanted as f64;
        let nodes = |n: DVec3| {
            (n + 1.0).element_product()
                + n.element_product()
                + 2.0 * n.dot(DVec3::new(n.y, n.z, n.x))
        };
        let scale = (2.0 * size.element_product() / target).cbrt();
        let mut best = (f64::INFINITY, f64::INFINITY, DVec3::ONE);
        for step in 0..200 {
            let count = size / (scale * 1.02_f64.powi(step - 60));
            for rounding in 0..27 {
                let step = [rounding % 3, rounding / 3 % 3, rounding / 9].map(|s| s - 1);
                let n = (count.round() + DVec3::from_array(step.map(f64::from))).max(DVec3::ONE);
                let miss = (nodes(n) / target - 1.0).abs();
                let cell = size / n;
                let stretch = cell.max_element() / cell.min_element();
                // Counts within the tolerance compete by shape, others by count alone.
                let rank = if miss <= self.settings.count_tolerance {
                    (0.0, stretch)
                } else {
                    (miss, stretch)
                };
                if rank < (best.0, best.1) {
                    best = (rank.0, rank.1, n);
                }
            }
        }
        let n = best.2;
        // Few cells jump in count from layer to layer, as in other bodies.
        if best.0 > last_jumps(target) * self.settings.count_tolerance {
            #[allow(clippy::cast_possible_truncation, reason = "a small count")]
            let reached = nodes(n) as usize;
            if nodes(n) > target && n.min_element() <= 1.0 {
                return Err(body.vanished(scale));
            }
            return Err(SampleError::NodeCount { wanted, reached });
        }
        let bounds = self.solid.bounds();
        let lattice = lattice_from(&bounds, size / n, bounds.min, self.settings.largest_lattice)?;
        let cell = (size / n).element_sum() / 3.0;
        Ok((self.stuff(&lattice, cell)?, cell))
    }
}

/// Mean length of the edges between nodes of cells of one size, over what the lattice of such cells
/// has; NaN where there are none.
fn edge_ratio(stuffed: &Stuffed) -> f64 {
    let (offsets, indices) = tetrahedra_edges(stuffed.positions.len(), &stuffed.tetrahedra);
    let (mut sum, mut count) = (0.0, 0.0);
    for (i, ends) in offsets.windows(2).enumerate() {
        let size = stuffed.size[i];
        for &j in &indices[ends[0] as usize..ends[1] as usize] {
            let j = j as usize;
            if (stuffed.size[j] / size - 1.0).abs() < 1e-9 {
                sum += stuffed.positions[i].distance(stuffed.positions[j]) / size;
                count += 1.0;
            }
        }
    }
    sum / (count * MEAN_EDGE)
}

/// The lattice of `cell` that contains a box with a rim of one cell, with planes at `start`.
#[allow(
    clippy::cast_possible_truncation,
    reason = "limited by `largest` before"
)]
fn lattice_from(
    bounds: &Bounds,
    cell: DVec3,
    start: DVec3,
    largest: usize,
) -> Result<Lattice, SampleError> {
    let count = ((bounds.max - start) / cell - 1e-9).ceil().max(DVec3::ONE) + 2.0;
    let cells = count.element_product();
    let limit = largest as f64;
    if cells > limit.min(1e9) || cells.is_nan() {
        return Err(too_fine(cell.max_element() * MEAN_EDGE, cells, limit));
    }
    Ok(Lattice {
        origin: start - cell,
        cell,
        cells: count.to_array().map(|n| n as usize),
    })
}
