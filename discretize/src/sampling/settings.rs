//! What is asked of a sampling.

use crate::sampling::Grading;

/// How fine to sample.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SampleTarget {
    /// Mean distance between neighbouring nodes at and under the surface (length unit of the body),
    /// met within 5 %; a box gets the cells nearest to it that fit.
    Spacing(f64),
    /// Number of nodes, met within [`SampleSettings::count_tolerance`].
    NodeCount(usize),
}

/// Settings of [`crate::sample_tetrahedra`].
#[derive(Debug, Clone, PartialEq)]
pub struct SampleSettings {
    /// Spacing or number of nodes.
    pub target: SampleTarget,
    /// Relative tolerance of [`SampleTarget::NodeCount`]; twice that, and below 340 nodes `14 n^(-1/3)` times, where no round
    /// of the search meets it, because the number jumps from one count of layers to the next (and where cells
    /// of one size have left the body's symmetry, as soon as one does).
    pub count_tolerance: f64,
    /// Sweeps that collapse short edges and move nodes near the surface, to lengthen the explicit
    /// time step and round the tetrahedra; 0 leaves the stuffing as it is. A box needs none.
    pub smoothing_sweeps: usize,
    /// Where the spacing differs from the one at the surface; the default is one spacing.
    pub grading: Grading,
    /// Most cells of the lattice before [`crate::SampleError::TooFine`], and 20 times those of an octree: an
    /// empty cell takes about 20 bytes in a lattice, 400 in an octree. A search for a number of nodes
    /// takes a tenth of that and as much again for every 2,000 nodes.
    pub largest_lattice: usize,
}

impl Default for SampleSettings {
    /// About 6,000 nodes, within 5 %, four sweeps of smoothing.
    fn default() -> Self {
        Self {
            target: SampleTarget::NodeCount(6000),
            count_tolerance: 0.05,
            smoothing_sweeps: 4,
            grading: Grading::default(),
            largest_lattice: 10_000_000,
        }
    }
}

impl SampleSettings {
    /// About this many nodes.
    #[must_use]
    pub fn nodes(count: usize) -> Self {
        Self {
            target: SampleTarget::NodeCount(count),
            ..Self::default()
        }
    }

    /// Nodes about this far (m) from each other.
    #[must_use]
    pub fn spacing(spacing: f64) -> Self {
        Self {
            target: SampleTarget::Spacing(spacing),
            ..Self::default()
        }
    }

    /// Most cells of an octree.
    pub(crate) fn largest_octree(&self) -> usize {
        self.largest_lattice / 20
    }
}
