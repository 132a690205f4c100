//! Rigid tools: shape, way through the world, and how they touch.

use glam::{DQuat, DVec3};
use phyxel_discretize::Bounds;
use phyxel_integrate::{Pose, RigidShape};
use phyxel_splat::DrawnMesh;
use serde::{Deserialize, Serialize};

use super::path::{Key, pose_at};
use super::rigid::RigidMesh;
use super::validate::Checks;

/// A rigid tool that touches the bodies.
///
/// It is in the world from the first step on: while the bodies settle it stands at its first key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Tool {
    /// Name in reports; unique among the tools.
    #[serde(default = "Tool::default_name")]
    pub name: String,
    /// Name of the body that it touches; every body where not given.
    #[serde(default)]
    pub body: Option<String>,
    /// What the tool occupies in its own frame.
    pub shape: ToolShape,
    /// Translation (m) of the tool with its whole path.
    #[serde(default)]
    #[cfg_attr(feature = "cli", schemars(with = "[f64; 3]"))]
    pub position: DVec3,
    /// Size of the tool over that which its shape says; its path stays.
    #[serde(default = "Tool::default_scale")]
    pub scale: f64,
    /// What pictures show in place of its shape, in its own frame and at its scale; contact is with the shape.
    #[serde(default)]
    pub looks: Option<RigidMesh>,
    /// How the tool moves through the world; one key for a tool that stands still or is released.
    pub path: Vec<Key>,
    /// Lets the tool go at scene time 0 from its only key: forces move it from then on.
    #[serde(default)]
    pub release: Option<Release>,
    /// Coulomb's coefficient of friction.
    #[serde(default)]
    pub friction: f64,
    /// Pressure over penetration (N/m^3); 40 E over the distance of nodes where not given.
    #[serde(default)]
    pub penalty: Option<f64>,
}

impl Tool {
    /// A tool on a path, without friction, that touches every body.
    #[must_use]
    pub fn new(shape: ToolShape, path: Vec<Key>) -> Self {
        Self {
            name: Self::default_name(),
            body: None,
            shape,
            position: DVec3::ZERO,
            scale: 1.0,
            looks: None,
            path,
            release: None,
            friction: 0.0,
            penalty: None,
        }
    }

    /// Its shape at its scale.
    #[must_use]
    pub fn solid(&self) -> ToolShape {
        self.shape.scaled(self.scale)
    }

    /// Where its path has it at a scene time (s).
    #[must_use]
    pub fn pose_at(&self, time: f64) -> Pose {
        let mut pose = pose_at(&self.path, time);
        pose.position += self.position;
        pose
    }

    const fn default_scale() -> f64 {
        1.0
    }

    fn default_name() -> String {
        "tool".to_owned()
    }
}

/// What moves a tool that no path moves, beside the contact; it does not turn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Release {
    /// Mass (kg); the scene's gravity acts on it.
    pub mass: f64,
    /// Constant force (N), as of a hand.
    #[serde(default)]
    #[cfg_attr(feature = "cli", schemars(with = "[f64; 3]"))]
    pub force: DVec3,
    /// Mass-proportional damping (1/s).
    #[serde(default)]
    pub damping: f64,
}

/// What a tool occupies in its own frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub enum ToolShape {
    /// A ball centred at the tool's origin.
    Sphere {
        /// Radius (m).
        radius: f64,
    },
    /// A half-space through the tool's origin; its normal points away from the solid side.
    Plane {
        /// Outward normal, of any length above zero.
        #[cfg_attr(feature = "cli", schemars(with = "[f64; 3]"))]
        normal: DVec3,
    },
    /// A cylinder with round ends.
    Capsule {
        /// First end of the axis (m).
        #[cfg_attr(feature = "cli", schemars(with = "[f64; 3]"))]
        from: DVec3,
        /// Second end of the axis (m).
        #[cfg_attr(feature = "cli", schemars(with = "[f64; 3]"))]
        to: DVec3,
        /// Radius (m).
        radius: f64,
    },
    /// A box centred at the tool's origin, its edges along the tool's axes.
    Box {
        /// Full edge lengths (m).
        #[cfg_attr(feature = "cli", schemars(with = "[f64; 3]"))]
        size: DVec3,
    },
}

impl ToolShape {
    /// Checks its values at a key path.
    pub(super) fn check(&self, checks: &mut Checks, path: &str) {
        match *self {
            Self::Sphere { radius } => {
                checks.positive(format_args!("{path}.radius"), radius, " (m)");
            }
            Self::Plane { normal } => checks.direction(format_args!("{path}.normal"), normal),
            Self::Capsule { from, to, radius } => {
                checks.finite(format_args!("{path}.from"), from);
                checks.finite(format_args!("{path}.to"), to);
                checks.positive(format_args!("{path}.radius"), radius, " (m)");
            }
            Self::Box { size } => checks.positive_components(&format!("{path}.size"), size),
        }
    }

    /// The same `scale` times as large.
    fn scaled(&self, scale: f64) -> Self {
        match *self {
            Self::Sphere { radius } => Self::Sphere {
                radius: scale * radius,
            },
            Self::Plane { normal } => Self::Plane { normal },
            Self::Capsule { from, to, radius } => Self::Capsule {
                from: scale * from,
                to: scale * to,
                radius: scale * radius,
            },
            Self::Box { size } => Self::Box { size: scale * size },
        }
    }

    /// The shape as contact has it, and where that lies in the tool's frame.
    pub(crate) fn contact(&self) -> (RigidShape, Pose) {
        let along = |axis: DVec3| DQuat::from_rotation_arc(DVec3::Z, axis.normalize_or(DVec3::Z));
        match *self {
            Self::Sphere { radius } => (RigidShape::Sphere { radius }, Pose::IDENTITY),
            Self::Plane { normal } => {
                let rotation = along(normal);
                let position = DVec3::ZERO;
                (RigidShape::Plane, Pose { position, rotation })
            }
            Self::Capsule { from, to, radius } => {
                let capsule = RigidShape::Capsule {
                    half_length: 0.5 * from.distance(to),
                    radius,
                };
                let (position, rotation) = (from.midpoint(to), along(to - from));
                (capsule, Pose { position, rotation })
            }
            Self::Box { size } => (RigidShape::Box { half: size * 0.5 }, Pose::IDENTITY),
        }
    }

    /// The box round it (m) in its frame; `None` for a plane, which has no end.
    pub(crate) fn bounds(&self) -> Option<Bounds> {
        let (min, max) = match *self {
            Self::Plane { .. } => return None,
            Self::Sphere { radius } => (DVec3::splat(-radius), DVec3::splat(radius)),
            Self::Capsule { from, to, radius } => (from.min(to) - radius, from.max(to) + radius),
            Self::Box { size } => (-0.5 * size, 0.5 * size),
        };
        Some(Bounds { min, max })
    }

    /// What is drawn of it at a pose; of a plane a square piece of edge length `extent` (m).
    pub(crate) fn drawn(&self, pose: &Pose, extent: f64) -> DrawnMesh {
        match *self {
            Self::Sphere { radius } => DrawnMesh::capsule(pose.position, pose.position, radius),
            Self::Capsule { from, to, radius } => {
                DrawnMesh::capsule(pose.apply(from), pose.apply(to), radius)
            }
            Self::Box { size } => DrawnMesh::cuboid(pose.position, pose.rotation, size * 0.5),
            Self::Plane { normal } => {
                let turn = DQuat::from_rotation_arc(DVec3::Z, normal.normalize_or(DVec3::Z));
                let rotation = pose.rotation * turn;
                let half = DVec3::new(0.5, 0.5, 0.01) * extent;
                DrawnMesh::cuboid(pose.position - rotation * DVec3::Z * half.z, rotation, half)
            }
        }
    }

    /// Its name, up to two points or directions (m) and a radius (m), as the live page is told.
    #[cfg(feature = "live")]
    pub(crate) fn told(&self) -> (&'static str, [[f64; 3]; 2], f64) {
        let zero = [0.0; 3];
        match *self {
            Self::Sphere { radius } => ("sphere", [zero, zero], radius),
            Self::Capsule { from, to, radius } => {
                ("capsule", [from.to_array(), to.to_array()], radius)
            }
            Self::Box { size } => ("box", [size.to_array(), zero], 0.0),
            Self::Plane { normal } => ("plane", [normal.to_array(), zero], 0.0),
        }
    }
}
