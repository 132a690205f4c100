//! What a body occupies, as settings say it: a shape or a mesh file, and where it lies.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};

use crate::mesh::{Bounds, MeshReport, ReadError, RepairError, RepairSettings, read_mesh, repair};
use crate::sampling::{Primitive, Solid};

/// What a body occupies at rest, before `scale`, `rotation` and `position` place it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Shape {
    /// The built-in liver-like organ of someone who stands: right lobe at -x, left lobe at +x, front
    /// at -y, head end up; 1.2 litres at a width of 0.166 m.
    Liver {
        /// Extent from the right to the left lobe (m).
        width: f64,
    },
    /// An axis-aligned box centred at the origin.
    Box {
        /// Full edge lengths (m).
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        size: DVec3,
    },
    /// An axis-aligned ellipsoid centred at the origin.
    Ellipsoid {
        /// Half axes (m).
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        radii: DVec3,
    },
    /// A cylinder with round ends.
    Capsule {
        /// First end of the axis (m).
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        from: DVec3,
        /// Second end of the axis (m).
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        to: DVec3,
        /// Radius (m).
        radius: f64,
    },
    /// A hollow cylinder with flat ends.
    Tube {
        /// First end of the axis (m).
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        from: DVec3,
        /// Second end of the axis (m).
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        to: DVec3,
        /// Radius of the hollow (m).
        inner_radius: f64,
        /// Radius of the outside (m).
        outer_radius: f64,
    },
    /// A closed surface from a mesh file.
    Mesh {
        /// Mesh file; a relative path starts at the scene file's folder.
        #[cfg_attr(feature = "serde", serde(with = "crate::sampling::path_text"))]
        #[cfg_attr(feature = "schemars", schemars(with = "String"))]
        file: PathBuf,
        /// Metres per unit of the file.
        #[cfg_attr(feature = "serde", serde(default = "Shape::default_scale"))]
        scale: f64,
        /// Direction in the file that becomes up (+z) in the scene.
        #[cfg_attr(feature = "serde", serde(default))]
        up: Axis,
        /// Holes up to this perimeter, as a fraction of the diagonal of the mesh's box, are closed.
        #[cfg_attr(feature = "serde", serde(default = "Shape::default_largest_hole"))]
        largest_hole: f64,
    },
}

impl Shape {
    #[cfg(feature = "serde")]
    const fn default_scale() -> f64 {
        1.0
    }

    #[cfg(feature = "serde")]
    fn default_largest_hole() -> f64 {
        RepairSettings::default().largest_hole
    }

    /// The shape without a file that it is, and where that lies in the body's frame; `None` for a mesh.
    #[must_use]
    pub fn primitive(&self) -> Option<(Primitive, Placement)> {
        let along = |from: DVec3, to: DVec3| {
            // Takes +z to the axis of a capsule or tube.
            let z = (to - from).normalize_or(DVec3::Z);
            let (x, y) = z.any_orthonormal_pair();
            Placement {
                turn: DMat3::from_cols(x, y, z),
                scale: 1.0,
                position: from.midpoint(to),
            }
        };
        Some(match *self {
            Self::Liver { width } => {
                let placed = Placement {
                    // The organ of an upright person: its head end up, its front to -y.
                    turn: DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y),
                    scale: width / Primitive::LIVER_WIDTH,
                    position: DVec3::ZERO,
                };
                (Primitive::Liver, placed)
            }
            Self::Box { size } => {
                let half_extents = size * 0.5;
                (Primitive::Box { half_extents }, Placement::IDENTITY)
            }
            Self::Ellipsoid { radii } => {
                let ellipsoid = Primitive::Ellipsoid { semi_axes: radii };
                (ellipsoid, Placement::IDENTITY)
            }
            Self::Capsule { from, to, radius } => {
                let half_length = 0.5 * from.distance(to);
                let capsule = Primitive::Capsule {
                    half_length,
                    radius,
                };
                (capsule, along(from, to))
            }
            Self::Tube {
                from,
                to,
                inner_radius,
                outer_radius,
            } => {
                let tube = Primitive::Tube {
                    half_length: 0.5 * from.distance(to),
                    outer_radius,
                    inner_radius,
                };
                (tube, along(from, to))
            }
            Self::Mesh { .. } => return None,
        })
    }

    /// The solid where it is placed, sampled in its own frame ([`Solid::turned`]), and what was found and repaired in its mesh file, if it has one.
    ///
    /// # Errors
    /// [`SolidError`] if a mesh cannot be read or is no solid.
    pub fn solid(&self, placed: &Placement) -> Result<(Solid, Option<MeshReport>), SolidError> {
        if placed.turn != DMat3::IDENTITY {
            let upright = Placement {
                scale: placed.scale,
                ..Placement::IDENTITY
            };
            let (solid, report) = self.solid(&upright)?;
            return Ok((solid.turned(placed.turn, placed.position), report));
        }
        let Some((primitive, own)) = self.primitive() else {
            return self.repaired(placed);
        };
        if let Self::Box { size } = *self {
            // Cells that fit it are for boxes along the axes.
            let half_extents = size * placed.scale * 0.5;
            let bounds = Bounds::new(
                placed.position - half_extents,
                placed.position + half_extents,
            );
            return Ok((bounds.into(), None));
        }
        let shift = placed.scale * own.position + placed.position;
        let scale = placed.scale * own.scale;
        Ok((Solid::placed(primitive, own.turn, scale, shift), None))
    }

    fn repaired(&self, placed: &Placement) -> Result<(Solid, Option<MeshReport>), SolidError> {
        let Self::Mesh {
            file,
            scale,
            up,
            largest_hole,
        } = self
        else {
            unreachable!("all but a mesh are primitives");
        };
        let mut mesh = read_mesh(file)?.mesh;
        placed.of_file(*scale, *up).place(&mut mesh.vertices);
        let settings = RepairSettings {
            largest_hole: *largest_hole,
            ..RepairSettings::default()
        };
        let repaired = repair(&mesh, &settings);
        let (mesh, report) = repaired.map_err(|problem| SolidError::Repair {
            file: file.clone(),
            problem: Box::new(problem),
        })?;
        Ok((Solid::from_mesh(mesh), Some(report)))
    }
}

/// Why a [`Shape`] is no solid.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolidError {
    /// Its mesh file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// Its mesh is not a solid.
    #[error("{}: {problem}", file.display())]
    Repair {
        /// The mesh file.
        file: PathBuf,
        /// What is wrong, and where.
        problem: Box<RepairError>,
    },
}

/// Where something lies: scaled, then turned, then moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Size over that which it has by itself.
    pub scale: f64,
    /// Rotation.
    pub turn: DMat3,
    /// Translation (m).
    pub position: DVec3,
}

impl Placement {
    /// Where things lie by themselves.
    pub const IDENTITY: Self = Self {
        scale: 1.0,
        turn: DMat3::IDENTITY,
        position: DVec3::ZERO,
    };

    /// The same for what is read from a file with a unit (m) and an upward direction of its own.
    #[must_use]
    pub fn of_file(&self, unit: f64, up: Axis) -> Self {
        Self {
            scale: self.scale * unit,
            turn: self.turn * up.rotation(),
            position: self.position,
        }
    }

    /// Moves points (m) to where they lie.
    pub fn place(&self, points: &mut [DVec3]) {
        for point in points {
            *point = self.turn * (*point * self.scale) + self.position;
        }
    }
}

/// A signed coordinate direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Axis {
    /// +x
    X,
    /// +y
    Y,
    /// +z
    #[default]
    Z,
    /// -x
    MinusX,
    /// -y
    MinusY,
    /// -z
    MinusZ,
}

impl Axis {
    /// The rotation that turns this direction of a file into +z.
    #[must_use]
    pub fn rotation(self) -> DMat3 {
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        // Columns: where the file's x, y and z go.
        match self {
            Self::X => DMat3::from_cols(z, x, y),
            Self::Y => DMat3::from_cols(x, z, -y),
            Self::Z => DMat3::IDENTITY,
            Self::MinusX => DMat3::from_cols(-z, -x, y),
            Self::MinusY => DMat3::from_cols(x, -z, y),
            Self::MinusZ => DMat3::from_cols(x, -y, -z),
        }
    }

    /// The direction that is usually up in files of this name: +y in OBJ and PLY, as their tools have it, +z in all
    /// others.
    #[must_use]
    pub fn usually_up(file: impl AsRef<Path>) -> Self {
        let extension = file
            .as_ref()
            .extension()
            .map(|text| text.to_ascii_lowercase());
        match extension.as_deref().and_then(|text| text.to_str()) {
            Some("obj" | "ply") => Self::Y,
            _ => Self::Z,
        }
    }
}

/// How the unit of a mesh file was understood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum UnitGuess {
    /// The size is that of a body in metres.
    Metres,
    /// The size is that of a body in millimetres, as scanners and their tools write it.
    Millimetres,
    /// The size fits neither: scaled so that the longest side is as long as an organ.
    Scaled {
        /// Metres per unit of the file.
        scale: f64,
        /// Longest side (m) after scaling.
        longest: f64,
    },
}

impl UnitGuess {
    /// Metres per unit of the file.
    #[must_use]
    pub const fn scale(&self) -> f64 {
        match *self {
            Self::Metres => 1.0,
            Self::Millimetres => 1e-3,
            Self::Scaled { scale, .. } => scale,
        }
    }
}

/// Longest side (m) that a mesh without a stated unit is given.
const ORGAN_LENGTH: f64 = 0.15;
/// Longest sides (m) that a body may have: from a gallstone to a trunk. Modelling tools scale to 1.
const PLAUSIBLE_LENGTH: std::ops::RangeInclusive<f64> = 0.01..=0.7;

/// Guesses the unit of a mesh of a body from the box of its vertices, by the longest side.
#[must_use]
pub fn guess_unit(extent: &Bounds) -> UnitGuess {
    let longest = extent.size().max_element();
    if PLAUSIBLE_LENGTH.contains(&longest) {
        UnitGuess::Metres
    } else if PLAUSIBLE_LENGTH.contains(&(longest * UnitGuess::Millimetres.scale())) {
        UnitGuess::Millimetres
    } else {
        UnitGuess::Scaled {
            scale: ORGAN_LENGTH / longest,
            longest: ORGAN_LENGTH,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_direction_of_a_file_becomes_up() {
        let all = [
            (Axis::X, DVec3::X),
            (Axis::Y, DVec3::Y),
            (Axis::Z, DVec3::Z),
            (Axis::MinusX, DVec3::NEG_X),
            (Axis::MinusY, DVec3::NEG_Y),
            (Axis::MinusZ, DVec3::NEG_Z),
        ];
        for (axis, direction) in all {
            let turn = axis.rotation();
            assert_eq!(turn * direction, DVec3::Z, "{axis:?}");
            assert!((turn.determinant() - 1.0).abs() < 1e-15, "{axis:?}");
        }
    }

    #[test]
    fn units_are_told_by_the_longest_side() {
        let extent = |longest: f64| {
            Bounds::new(
                DVec3::ZERO,
                DVec3::new(longest, 0.5 * longest, 0.1 * longest),
            )
        };
        assert_eq!(guess_unit(&extent(0.12)), UnitGuess::Metres);
        assert_eq!(guess_unit(&extent(90.0)), UnitGuess::Millimetres);
        for longest in [1e-6, 1.0, 3.0, 5.0e5] {
            let unit = guess_unit(&extent(longest));
            assert!((unit.scale() * longest - ORGAN_LENGTH).abs() < 1e-12);
        }
    }
}
