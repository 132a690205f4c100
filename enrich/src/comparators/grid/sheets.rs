//! A lattice for each sheet of a cut that turns.

use glam::DVec3;

use super::frame::Frame;
use super::{EnrichmentGrid, GridError, GridSettings};
use crate::bounds::Bounds;

/// Cosine of the largest angle between a piece and the common plane of its sheet, 45 degrees: Aras (2014)
/// measures `d2⁺` in that plane, where it is shorter than along the piece by this.
const LEAST_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The same where a sheet begins, 22.5 degrees: half of that turn, so that the sheet can grow.
const LEAST_COSINE_AT_START: f64 = 0.923_879_532_511_286_7;

/// The lattices of one cut, in the order of the blade's motion.
///
/// Aras (2014) has one lattice for a cut and builds it again with every piece. A cut that turns, folds or
/// comes back has no common plane; here a lattice ends where the next piece does not suit it, and stays
/// as it was. The next one goes as far back as the pieces turn by half of what is allowed: beside the
/// last piece of a sheet `d2⁺` is above 0 where that is tilted, so that its lattice does not sever there.
/// Between the lattices of a cut factors are multiplied, as between cuts (eq. (38)).
#[derive(Debug, Clone)]
pub(crate) struct GridSheets {
    settings: GridSettings,
    /// Box of the body (m) and cells along x, y and z, for lattices as in the appendix.
    cells: Option<(Bounds, [u32; 3])>,
    /// Ends of the blade's edge (m) in the sheet that grows.
    ends: Vec<[DVec3; 2]>,
    /// The last is that of the sheet that grows, if that has one yet.
    grids: Vec<EnrichmentGrid>,
}

impl GridSheets {
    /// A cut that starts at an edge (m); `cells` as in [`EnrichmentGrid::within`].
    pub(crate) fn new(
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
    pub(crate) fn append(&mut self, edge: [DVec3; 2]) -> Result<(), GridError> {
        self.ends.push(edge);
        let count = self.ends.len();
        if let Ok(frame) = frame_within(&self.ends, LEAST_COSINE)
            && let Ok(grid) = self.lattice(frame)
        {
            if count > 2 {
                self.grids.pop();
            }
            self.grids.push(grid);
            return Ok(());
        }
        // The longest run of pieces up to this one that the next sheet can begin with.
        let mut first = count - 2;
        let mut frame = frame_within(&self.ends[first..], LEAST_COSINE);
        while first > 0
            && frame.is_ok()
            && let Ok(longer) = frame_within(&self.ends[first - 1..], LEAST_COSINE_AT_START)
        {
            first -= 1;
            frame = Ok(longer);
        }
        let grid = frame.and_then(|frame| self.lattice(frame));
        let keep = if grid.is_ok() { first } else { count - 1 };
        self.ends.drain(..keep);
        self.grids.push(grid?);
        Ok(())
    }

    /// Continues from another edge (m), without a piece between the last one and that.
    pub(crate) fn continue_from(&mut self, edge: [DVec3; 2]) {
        self.ends = vec![edge];
    }

    /// The last edge (m).
    pub(crate) fn last_edge(&self) -> [DVec3; 2] {
        self.ends[self.ends.len() - 1]
    }

    /// The lattices.
    pub(crate) fn grids(&self) -> &[EnrichmentGrid] {
        &self.grids
    }

    /// Bytes held on the heap, about.
    pub(crate) fn bytes(&self) -> usize {
        let lattices: usize = self.grids.iter().map(EnrichmentGrid::bytes).sum();
        lattices + self.ends.capacity() * size_of::<[DVec3; 2]>()
    }

    fn lattice(&self, frame: Frame) -> Result<EnrichmentGrid, GridError> {
        EnrichmentGrid::within(frame, &self.settings, self.cells)
    }
}

/// The common frame of the pieces between edges (m), none of which may turn from it by more than
/// `least_cosine` says.
fn frame_within(ends: &[[DVec3; 2]], least_cosine: f64) -> Result<Frame, GridError> {
    let frame = Frame::new(ends)?;
    match frame.least_cosine() {
        least if least < least_cosine => Err(GridError::NoCommonFrame { length: least }),
        _ => Ok(frame),
    }
}
