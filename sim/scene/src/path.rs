//! Paths in time: how tools, blades and driven regions move.

use glam::{DQuat, DVec3};
use phyxel_integrate::Pose;
use serde::{Deserialize, Serialize};

/// One key of a path: where something is at a time.
///
/// Between two keys the position is interpolated linearly and the rotation along the shorter arc;
/// before the first and after the last key the pose stays at that key.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// Scene time (s), counted from the end of settling; keys are in increasing order.
    pub time: f64,
    /// Translation (m) of the thing that moves.
    #[serde(default)]
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub position: DVec3,
    /// Rotation vector (degrees): direction is the axis, length the angle; applied before the translation.
    #[serde(default)]
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub rotation: DVec3,
}

impl Key {
    /// A position (m) at a scene time (s), not turned.
    #[must_use]
    pub fn new(time: f64, position: DVec3) -> Self {
        Self {
            time,
            position,
            rotation: DVec3::ZERO,
        }
    }

    /// Its position and rotation.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose {
            rotation: turn(self.rotation),
            position: self.position,
        }
    }
}

/// The scale of what is as large as it says, where a scene gives none.
pub(super) const fn one() -> f64 {
    1.0
}

/// Rotation that a rotation vector in degrees describes.
pub(super) fn turn(degrees: DVec3) -> DQuat {
    DQuat::from_scaled_axis(degrees * (std::f64::consts::PI / 180.0))
}

/// Pose of a path at `time` (s); the identity for a path without keys.
#[must_use]
pub fn pose_at(path: &[Key], time: f64) -> Pose {
    let after = path.partition_point(|key| key.time <= time);
    let (Some(first), Some(last)) = (path.first(), path.last()) else {
        return Pose::IDENTITY;
    };
    if after == 0 {
        return first.pose();
    }
    if after == path.len() {
        return last.pose();
    }
    let (from, to) = (&path[after - 1], &path[after]);
    let fraction = (time - from.time) / (to.time - from.time);
    from.pose().toward(&to.pose(), fraction)
}
