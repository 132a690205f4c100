//! Rigid surfaces that are only drawn.

use std::path::PathBuf;

use glam::{DMat3, DVec3};
use phyxel_discretize::{Axis, Placement, path_text};
use serde::{Deserialize, Serialize};

use super::path::{one, turn};

/// A rigid surface from a mesh file, such as bones or the looks of an instrument: it is drawn among the bodies and
/// touches nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct RigidMesh {
    /// Mesh file; a relative path starts at the scene file's folder. Holes do not matter.
    #[serde(with = "path_text")]
    #[cfg_attr(feature = "schemars", schemars(with = "String"))]
    pub file: PathBuf,
    /// Metres per unit of the file.
    #[serde(default = "one")]
    pub scale: f64,
    /// Direction in the file that becomes up (+z).
    #[serde(default)]
    pub up: Axis,
    /// Translation (m).
    #[serde(default)]
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub position: DVec3,
    /// Rotation vector (degrees), applied before the translation.
    #[serde(default)]
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub rotation: DVec3,
    /// Colour (sRGB, 0 to 1).
    #[serde(default = "RigidMesh::default_color")]
    pub color: [f64; 3],
}

impl RigidMesh {
    /// Where what the file holds lies.
    #[must_use]
    pub fn placement(&self) -> Placement {
        let placed = Placement {
            scale: 1.0,
            turn: DMat3::from_quat(turn(self.rotation)),
            position: self.position,
        };
        placed.of_file(self.scale, self.up)
    }

    /// Dry bone.
    const fn default_color() -> [f64; 3] {
        [0.86, 0.81, 0.70]
    }
}
