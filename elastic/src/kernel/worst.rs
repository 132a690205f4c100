//! The worst that an evaluation saw.

/// What the last evaluation saw, over a chunk of nodes or all of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Watch {
    /// Smallest `det F` of nodes that carry strain energy.
    pub(crate) ratio: f64,
    /// Largest `r_i` (1/s²); 0 where nobody asked for it.
    pub(crate) stiffness: f64,
}

impl Watch {
    pub(crate) const NOTHING: Self = Self {
        ratio: f64::INFINITY,
        stiffness: 0.0,
    };

    /// The worse of two.
    #[inline(always)]
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            ratio: self.ratio.min(other.ratio),
            stiffness: self.stiffness.max(other.stiffness),
        }
    }
}
