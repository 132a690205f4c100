//! A lattice for each sheet of a cut that turns.

use glam::DVec3;

use super::{EnrichmentGrid, GridError, GridSettings};
use crate::index::Bounds;

/// Cosine of the largest angle between a piece and the common plane of its sheet, 45 degrees: the text
/// measures `d2⁺` in that plane, where it is shorter than along the piece by this.
const LEAST_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The lattices of one cut, in the order of the blade's motion.
///
/// The text has one lattice for a cut and builds it anew with every piece. A cut that turns, folds or
/// comes back has no common plane; here a lattice ends where the next piece does not suit it, and stays
/// as it was, and the next one begins there. Between the lattices of a cut factors are multiplied, as
/// between cuts (eq. (38)).
#[derive(Debug, Clone)]
pub struct GridSheets {
    settings: GridSettings,
    /// Box of the body (m) and cells along x, y and z, for lattices as in the appendix.
    cells: Option<(Bounds, [u32; 3])>,
    /// Ends of the blade's edge (m) in the sheet that grows.
    ends: Vec<[DVec3; 2]>,
    /// The last is that of the sheet that grows, if that has one yet.
    grids: Vec<EnrichmentGrid>,
}

impl GridSheets {
    /// A cut that starts at an edge (m); `cells` as in [`EnrichmentGrid::from_blades_in`].
    #[must_use]
    pub fn new(
        edge: [DVec3; 2],
        settings: &GridSettings,
        cells: Option<(Bounds, [u32; 3])>,
    ) -> Self {
        Self {
            settings: *settings,
            cells,
            ends: vec![edge],
            grids: Vec::new(),
        }
    }

    /// Takes up the next edge (m): into the lattice of the sheet that grows, or into a new one.
    ///
    /// # Errors
    /// [`GridError`] if not even the piece between the last edge and this one alone has a lattice. The
    /// lattices that there are stay, the next sheet begins at this edge, and pairs that the piece
    /// crosses are to be weakened by another rule.
    pub fn append(&mut self, edge: [DVec3; 2]) -> Result<(), GridError> {
        let last = self.ends[self.ends.len() - 1];
        let grows = self.ends.len() > 1;
        self.ends.push(edge);
        match self.lattice() {
            Ok(grid) => {
                if grows {
                    self.grids.pop();
                }
                self.grids.push(grid);
                return Ok(());
            }
            Err(error) if !grows => {
                self.ends = vec![edge];
                return Err(error);
            }
            Err(_) => {}
        }
        self.ends = vec![last, edge];
        match self.lattice() {
            Ok(grid) => {
                self.grids.push(grid);
                Ok(())
            }
            Err(error) => {
                self.ends = vec![edge];
                Err(error)
            }
        }
    }

    /// The lattices.
    #[must_use]
    pub fn grids(&self) -> &[EnrichmentGrid] {
        &self.grids
    }

    /// Bytes held on the heap, about.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let lattices: usize = self.grids.iter().map(EnrichmentGrid::bytes).sum();
        lattices + self.ends.capacity() * size_of::<[DVec3; 2]>()
    }

    fn lattice(&self) -> Result<EnrichmentGrid, GridError> {
        let grid = match self.cells {
            Some((body, cells)) => {
                EnrichmentGrid::from_blades_in(&self.ends, body, cells, &self.settings)?
            }
            None => EnrichmentGrid::from_blades(&self.ends, &self.settings)?,
        };
        let least = grid.least_cosine();
        if least < LEAST_COSINE {
            return Err(GridError::NoCommonFrame { length: least });
        }
        Ok(grid)
    }
}
