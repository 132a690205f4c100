//! A body in a frame of its own, so that its nodes do not depend on how it is turned, nor a mesh's on its unit or position.

use glam::{DMat3, DVec3};

use crate::mesh::Mesh;
use crate::sampling::{Grading, Refinement, SampleError, SampleSettings, SampleTarget, Solid};

/// Coordinates are rounded to this fraction of the longest side: far above the round-off by which two
/// copies of a mesh in different units differ, far below what a mesh resolves (2^-24 in single precision).
const GRAIN: f64 = 1.0 / (1_u64 << 36) as f64;

/// Where a body's frame begins, how it is turned, and the length of its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    origin: DVec3,
    turn: DMat3,
    /// Length of the frame's unit.
    pub length: f64,
}

impl Frame {
    /// The frame in which a mesh's box begins at the origin and its longest side is 1, and the body
    /// there; `None` for an implicit body, whose function knows its own scale.
    pub(crate) fn of(solid: &Solid) -> Option<(Self, Solid)> {
        let mesh = solid.mesh()?;
        let bounds = solid.bounds();
        let frame = Self {
            origin: bounds.min,
            turn: DMat3::IDENTITY,
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

    /// The frame that a body was turned from, and the body there.
    pub(crate) fn upright(solid: &Solid) -> Option<(Self, &Solid)> {
        let upright = solid.upright.as_deref()?;
        let frame = Self {
            origin: upright.translation,
            turn: upright.rotation,
            length: 1.0,
        };
        Some((frame, &upright.solid))
    }

    fn into(self, p: DVec3) -> DVec3 {
        self.turn.transpose() * (p - self.origin) / self.length
    }

    /// A position of the frame in the user's coordinates.
    pub(crate) fn place(self, p: DVec3) -> DVec3 {
        self.origin + self.turn * (p * self.length)
    }

    /// The same for all positions and area vectors.
    pub(crate) fn place_all(self, positions: &mut [DVec3], areas: &mut [DVec3]) {
        for p in positions {
            *p = self.place(*p);
        }
        for area in areas {
            *area = self.turn * (*area * (self.length * self.length));
        }
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
    pub(crate) fn error(self, mut error: SampleError) -> SampleError {
        use SampleError::{
            LostParts, NotANumber, OutsideBounds, Slender, Spacing, TooFine, Vanished,
        };
        match &mut error {
            TooFine {
                spacing, advice, ..
            }
            | Vanished {
                spacing, advice, ..
            }
            | LostParts {
                spacing, advice, ..
            } => {
                *spacing *= self.length;
                *advice *= self.length;
            }
            Slender {
                size, thickness, ..
            } => {
                *size *= self.length;
                *thickness *= self.length;
            }
            Spacing { spacing } => *spacing *= self.length,
            _ => {}
        }
        if let Slender { far: at, .. }
        | LostParts { near: at, .. }
        | NotANumber { at }
        | OutsideBounds { at } = &mut error
        {
            *at = self.place(*at);
        }
        error
    }
}
