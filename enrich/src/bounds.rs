//! Axis-aligned boxes.

use glam::DVec3;

/// Closed axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    /// Smallest coordinates (m).
    pub(crate) low: DVec3,
    /// Largest coordinates (m).
    pub(crate) high: DVec3,
}

impl Bounds {
    /// The box that contains nothing.
    pub(crate) const EMPTY: Self = Self {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
    };

    /// Smallest box around some points.
    pub(crate) fn of(points: &[DVec3]) -> Self {
        points.iter().fold(Self::EMPTY, |b, &p| Self {
            low: b.low.min(p),
            high: b.high.max(p),
        })
    }

    /// This box with every face moved outward by `margin`.
    pub(crate) fn grown(self, margin: f64) -> Self {
        Self {
            low: self.low - DVec3::splat(margin),
            high: self.high + DVec3::splat(margin),
        }
    }

    /// Smallest box around both.
    pub(crate) fn union(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Whether the boxes have a point in common.
    pub(crate) fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }

    /// Whether a point lies in the box.
    pub(crate) fn contains(&self, p: DVec3) -> bool {
        self.low.cmple(p).all() && p.cmple(self.high).all()
    }

    /// Distance of a point to the box, 0 inside.
    pub(crate) fn distance(&self, p: DVec3) -> f64 {
        (self.low - p).max(p - self.high).max(DVec3::ZERO).length()
    }
}
