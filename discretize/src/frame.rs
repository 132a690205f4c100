//! A mesh in a frame of its own, so that its nodes do not depend on its unit or place.

use glam::DVec3;

use crate::error::SampleError;
use crate::grading::{Grading, Refinement};
use crate::mesh::Mesh;
use crate::settings::{SampleSettings, SampleTarget};
use crate::solid::Solid;

/// Coordinates are rounded to this share of the longest side: far above the round-off by which two
/// copies of a mesh in different units differ, far below what a mesh tells (2^-24 in single precision).
const GRAIN: f64 = 1.0 / (1_u64 << 36) as f64;

/// Where a body's frame begins and the length of its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    origin: DVec3,
    length: f64,
}

impl Frame {
    /// The frame in which a mesh's box begins at the origin and its longest side is 1, and the body
    /// there; `None` for an implicit body, whose function knows its own scale.
    pub(crate) fn of(solid: &Solid) -> Option<(Self, Solid)> {
        let mesh = solid.mesh()?;
        let bounds = solid.bounds();
        let frame = Self {
            origin: bounds.min,
            length: bounds.size().max_element(),
        };
        let round = |p: DVec3| (p / GRAIN).round() * GRAIN;
        let vertices = mesh.vertices.iter().map(|p| round(frame.into(*p)));
        let inside = Solid::from_mesh(Mesh {
            vertices: vertices.collect(),
            triangles: mesh.triangles.clone(),
        });
        Some((frame, inside))
    }

    fn into(self, p: DVec3) -> DVec3 {
        (p - self.origin) / self.length
    }

    /// A place of the frame in the body's own coordinates.
    pub(crate) fn place(self, p: DVec3) -> DVec3 {
        self.origin + p * self.length
    }

    /// Length of the frame's unit.
    pub(crate) fn length(self) -> f64 {
        self.length
    }

    /// What is asked for, in the frame.
    pub(crate) fn settings(self, settings: &SampleSettings) -> SampleSettings {
        let refinements = settings.grading.refinements.iter().map(|r| Refinement {
            from: self.into(r.from),
            to: self.into(r.to),
            radius: r.radius / self.length,
            factor: r.factor,
        });
        SampleSettings {
            target: match settings.target {
                SampleTarget::Spacing(spacing) => SampleTarget::Spacing(spacing / self.length),
                count @ SampleTarget::NodeCount(_) => count,
            },
            grading: Grading {
                refinements: refinements.collect(),
                ..settings.grading
            },
            ..settings.clone()
        }
    }

    /// A failure in the frame as the user's coordinates have it.
    pub(crate) fn error(self, error: SampleError) -> SampleError {
        let length = self.length;
        match error {
            SampleError::Spacing { spacing } => SampleError::Spacing {
                spacing: spacing * length,
            },
            SampleError::TooFine {
                spacing,
                cells,
                limit,
                advice,
            } => SampleError::TooFine {
                spacing: spacing * length,
                cells,
                limit,
                advice: advice * length,
            },
            SampleError::Thin {
                wanted,
                spacing,
                thickness,
                advice,
            } => SampleError::Thin {
                wanted,
                spacing: spacing * length,
                thickness: thickness * length,
                advice,
            },
            SampleError::Slender {
                share,
                size,
                thickness,
                cells,
                limit,
                far,
            } => SampleError::Slender {
                share,
                size: size * length,
                thickness: thickness * length,
                cells,
                limit,
                far: self.place(far),
            },
            SampleError::Vanished {
                spacing,
                advice,
                nodes,
            } => SampleError::Vanished {
                spacing: spacing * length,
                advice: advice * length,
                nodes,
            },
            SampleError::LostParts {
                parts,
                of,
                spacing,
                near,
                advice,
                nodes,
            } => SampleError::LostParts {
                parts,
                of,
                spacing: spacing * length,
                near: self.place(near),
                advice: advice * length,
                nodes,
            },
            SampleError::NotANumber { at } => SampleError::NotANumber { at: self.place(at) },
            SampleError::OutsideBounds { at } => SampleError::OutsideBounds { at: self.place(at) },
            same @ (SampleError::Grading { .. }
            | SampleError::Refinement { .. }
            | SampleError::TooFewNodes { .. }
            | SampleError::TooManyNodes { .. }
            | SampleError::NodeCount { .. }
            | SampleError::Lattice { .. }) => same,
        }
    }
}
