//! The dissertation's enrichment grid (Aras 2014, chapter 3 and section 5.6): one per cut.

mod factors;
mod frame;
mod sheets;

use glam::DVec3;
use rayon::prelude::*;

pub use factors::{GridForm, grid_pair_factors};
pub use frame::GridError;
pub(super) use frame::piece_between;
pub(crate) use sheets::GridSheets;

use crate::bounds::Bounds;
use frame::Frame;

/// How fine the lattice is and how far it reaches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridSettings {
    /// Distance of the lattice points (m).
    pub spacing: f64,
    /// Margin of the lattice around the cut (m); at least the support radius, or nodes that the cut
    /// weakens are not reached.
    pub inflate: f64,
    /// Most lattice points that are taken.
    pub most_points: usize,
}

impl GridSettings {
    /// Half the node spacing, and a margin of three spacings.
    #[must_use]
    pub fn for_spacing(spacing: f64) -> Self {
        Self {
            spacing: 0.5 * spacing,
            inflate: 3.0 * spacing,
            most_points: 20_000_000,
        }
    }
}

/// Enrichment of one point.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Enrichment {
    /// Piece of the cut that the point belongs to: segment, or pair of triangles between two captures.
    pub region: u32,
    /// Signed distance along the normal of that piece (m), eq. (44).
    pub s: f64,
    /// Distance to the end of the cut in the common frame (m): `d1⁺` of eq. (43) of upright blades, `d2⁺`
    /// of eq. (47) of any; 0 beside the cut.
    pub d_plus: f64,
    /// Distance (m): d2 of eq. (34), d3 of eqs. (47) and (64).
    pub distance: f64,
    /// `φ = s / d`, eqs. (37) and (48), in −1..=1. On the cut itself, where Aras (2014) has 0/0, it is 1.
    pub phi: f64,
}

/// The enrichment grid of one cut; one in the plane is that of upright blades.
///
/// Right for a nearly flat strip. It is refused where its construction cannot be right, see
/// [`GridError`]; where it is not refused it still weakens pairs ahead of the tip and lets cut pairs
/// know each other again as the cut grows and the common frame turns. [`PairFactors`](crate::PairFactors)
/// has neither fault; this is here to compare with, and for pictures of the level sets.
///
/// # Examples
/// ```
/// use phyxel_enrich::glam::DVec3;
/// use phyxel_enrich::{EnrichmentGrid, GridSettings};
///
/// let cut = [DVec3::ZERO, DVec3::X].map(|p| [p - DVec3::Z, p + DVec3::Z]);
/// let grid = EnrichmentGrid::from_blades(&cut, &GridSettings::for_spacing(0.1))?;
/// let ahead = grid.evaluate(DVec3::new(1.3, 0.4, 0.0));
/// assert!((ahead.phi - 0.8).abs() < 1e-15 && (ahead.distance - 0.5).abs() < 1e-15);
/// # Ok::<(), phyxel_enrich::GridError>(())
/// ```
#[derive(Debug, Clone)]
pub struct EnrichmentGrid {
    frame: Frame,
    origin: DVec3,
    /// Distance (m) of lattice points along x, y, z.
    spacing: DVec3,
    size: [usize; 3],
    values: Vec<Enrichment>,
}

impl EnrichmentGrid {
    /// The grid of a cut: end points of the blade's edge at each capture (m).
    ///
    /// # Errors
    /// See [`GridError`].
    pub fn from_blades(blades: &[[DVec3; 2]], settings: &GridSettings) -> Result<Self, GridError> {
        Self::within(Frame::new(blades)?, settings, None)
    }

    /// With `cells`, a lattice as in Aras (2014)'s appendix: so many cells along x, y and z over the box (m) of the
    /// whole body, grown by `settings.inflate`, instead of a spacing.
    fn within(
        frame: Frame,
        settings: &GridSettings,
        cells: Option<(Bounds, [u32; 3])>,
    ) -> Result<Self, GridError> {
        let around = cells.map_or_else(|| frame.bounds(), |(body, _)| body);
        let bounds = around.grown(settings.inflate.max(0.0));
        Self::build(frame, bounds, settings, cells.map(|(_, cells)| cells))
    }

    #[allow(
        clippy::cast_possible_truncation,
        reason = "the number of lattice points is limited before the cast"
    )]
    fn build(
        frame: Frame,
        bounds: Bounds,
        settings: &GridSettings,
        cells: Option<[u32; 3]>,
    ) -> Result<Self, GridError> {
        let extent = bounds.high - bounds.low;
        let (spacing, counts) = match cells {
            Some(cells) => {
                let cells = DVec3::from_array(cells.map(f64::from));
                (extent / cells, cells + DVec3::ONE)
            }
            None => (
                DVec3::splat(settings.spacing),
                (extent / settings.spacing).ceil() + DVec3::ONE,
            ),
        };
        let points = counts.x * counts.y * counts.z;
        // A spacing of zero or NaN gives a count that is not finite.
        let limit = settings.most_points;
        if !points.is_finite() || points > limit as f64 {
            return Err(GridError::TooLarge { points, limit });
        }
        let size = counts.to_array().map(|c| c as usize);
        let mut grid = Self {
            frame,
            origin: bounds.low,
            spacing,
            size,
            values: Vec::new(),
        };
        grid.values = (0..size[0] * size[1] * size[2])
            .into_par_iter()
            .with_min_len(1024)
            .map(|k| grid.frame.evaluate(grid.lattice_point(k)))
            .collect();
        Ok(grid)
    }

    /// Enrichment at any point by the formulas themselves, without the lattice.
    #[must_use]
    pub fn evaluate(&self, point: DVec3) -> Enrichment {
        self.frame.evaluate(point)
    }

    /// Enrichment of the lattice point nearest to `point`, as the dissertation looks it up; none
    /// outside of the lattice.
    #[must_use]
    pub fn look_up(&self, point: DVec3) -> Option<Enrichment> {
        self.index_of(point).map(|k| self.values[k])
    }

    /// As [`EnrichmentGrid::look_up`], but by the formulas themselves where the nearest lattice point is so near to
    /// the cut that it may lie on the other side. Aras (2014) takes its side then, and a layer of nodes beside a
    /// cut, half a cell from it, comes to the wrong piece.
    pub(super) fn on_its_side(&self, point: DVec3) -> Option<Enrichment> {
        let found = self.look_up(point)?;
        // No point is farther from its nearest lattice point, and s changes by no more than the way.
        let farthest = 0.5 * self.spacing.length();
        let is_near = found.s.abs() <= farthest;
        Some(if is_near { self.evaluate(point) } else { found })
    }

    /// The common frame: its origin (m), eqs. (39) and (45), and the unit normal of the common plane, eq. (46); of
    /// upright blades that is the t axis of eq. (40) turned to the left.
    #[must_use]
    pub fn frame(&self) -> (DVec3, DVec3) {
        (self.frame.origin, self.frame.normal)
    }

    /// Number of lattice points along x, y, z.
    #[must_use]
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Values on the lattice, x fastest.
    #[must_use]
    pub fn values(&self) -> &[Enrichment] {
        &self.values
    }

    /// Position of a lattice point (m).
    #[must_use]
    pub fn lattice_point(&self, k: usize) -> DVec3 {
        let (x, rest) = (k % self.size[0], k / self.size[0]);
        let (y, z) = (rest % self.size[1], rest / self.size[1]);
        self.origin + self.spacing * DVec3::new(x as f64, y as f64, z as f64)
    }

    /// Bytes held on the heap, about.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.values.capacity() * size_of::<Enrichment>()
    }

    #[allow(
        clippy::cast_possible_truncation,
        reason = "checked to lie in the lattice before the cast"
    )]
    fn index_of(&self, point: DVec3) -> Option<usize> {
        let at = ((point - self.origin) / self.spacing).round();
        let mut index = 0;
        for (k, c) in at.to_array().into_iter().enumerate().rev() {
            if !(c >= 0.0 && c < self.size[k] as f64) {
                return None;
            }
            index = index * self.size[k] + c as usize;
        }
        Some(index)
    }
}
