//! How the spacing varies over a body.

use glam::DVec3;

use crate::sampling::SampleError;

/// A region with smaller distances between nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Refinement {
    /// One end of the axis (m), at rest.
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub from: DVec3,
    /// The other end (m); the same point for a ball.
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub to: DVec3,
    /// Distance (m) from the axis up to which the factor holds.
    pub radius: f64,
    /// Distance of nodes there over that at the surface, 1/32 to 1. Cells are halved until they are small enough, so
    /// what comes out is the next power of one half.
    pub factor: f64,
}

impl Refinement {
    fn is_valid(&self) -> bool {
        self.from.is_finite()
            && self.to.is_finite()
            && self.radius.is_finite()
            && self.radius >= 0.0
            && (1.0 / LARGEST_RATIO..=1.0).contains(&self.factor)
    }

    /// Distance from the refined region (m), 0 in it.
    #[must_use]
    pub fn distance(&self, p: DVec3) -> f64 {
        let axis = self.to - self.from;
        let length_squared = axis.length_squared();
        let t = if length_squared > 0.0 {
            ((p - self.from).dot(axis) / length_squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (p.distance(self.from + t * axis) - self.radius).max(0.0)
    }
}

/// Where the spacing differs from that at the surface.
///
/// The cells' edge wanted at a point is the smallest of `(1 + growth d / h) h` with the depth d
/// below the surface and the surface's edge h, `(factor + growth d / h) h` with the distance d from
/// a refined region, and `coarsest h`.
#[derive(Debug, Clone, PartialEq)]
pub struct Grading {
    /// Largest spacing inside over that at the surface: 1 to 32; 1 for the same everywhere.
    pub coarsest: f64,
    /// Growth of the spacing per distance from the surface or a refined region.
    pub growth: f64,
    /// Positions with smaller cells, such as where a tool will touch or a blade will pass.
    pub refinements: Vec<Refinement>,
}

impl Default for Grading {
    fn default() -> Self {
        Self {
            coarsest: 1.0,
            growth: 1.0,
            refinements: Vec::new(),
        }
    }
}

/// Largest ratio of spacings either way.
const LARGEST_RATIO: f64 = 32.0;

impl Grading {
    /// Whether one spacing is wanted everywhere.
    #[must_use]
    pub fn is_uniform(&self) -> bool {
        self.coarsest < 2.0 && self.refinements.iter().all(|r| r.factor >= 1.0)
    }

    pub(crate) fn check(&self) -> Result<(), SampleError> {
        let finite = self.growth.is_finite()
            && self.growth >= 0.0
            && (1.0..=LARGEST_RATIO).contains(&self.coarsest);
        if !finite {
            return Err(SampleError::Grading {
                coarsest: self.coarsest,
                growth: self.growth,
            });
        }
        for (refinement, r) in self.refinements.iter().enumerate() {
            if !r.is_valid() {
                return Err(SampleError::Refinement {
                    refinement,
                    factor: r.factor,
                    radius: r.radius,
                });
            }
        }
        Ok(())
    }

    pub(crate) fn smallest_factor(&self) -> f64 {
        self.refinements
            .iter()
            .fold(1.0, |least, r| least.min(r.factor))
    }

    /// Halvings of the surface's cell that the smallest factor asks for.
    pub(crate) fn finest_level(&self) -> u32 {
        levels(1.0 / self.smallest_factor(), f64::ceil)
    }

    /// Doublings of the surface's cell that are wanted inside.
    pub(crate) fn coarsest_level(&self) -> u32 {
        levels(self.coarsest, f64::floor)
    }

    /// Smallest edge wanted within `reach` of a point at `depth` under the surface.
    pub(crate) fn size_at(&self, p: DVec3, reach: f64, cell: f64, depth: f64) -> f64 {
        let mut wanted = (cell + self.growth * depth).min(self.coarsest * cell);
        for r in &self.refinements {
            let distance = (r.distance(p) - reach).max(0.0);
            wanted = wanted.min(r.factor * cell + self.growth * distance);
        }
        wanted
    }
}

/// Base-two logarithm of a ratio from 1 to 32 with a little slack.
#[allow(
    clippy::cast_possible_truncation,
    reason = "0 to 5 by the check before"
)]
fn levels(ratio: f64, round: fn(f64) -> f64) -> u32 {
    let exact = ratio.log2();
    let nearest = exact.round();
    if (exact - nearest).abs() < 1e-9 {
        nearest as u32
    } else {
        round(exact) as u32
    }
}
