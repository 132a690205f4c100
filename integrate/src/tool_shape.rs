//! What a tool occupies, as settings say it.

use glam::{DQuat, DVec3};

use crate::checks::{BadSetting, Checks};
use crate::shape::{Pose, RigidShape};

/// What a tool occupies in its own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum ToolShape {
    /// A ball centred at the tool's origin.
    Sphere {
        /// Radius (m).
        radius: f64,
    },
    /// A half-space through the tool's origin; its normal points away from the solid side.
    Plane {
        /// Outward normal, of any length above zero.
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        normal: DVec3,
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
    /// A box centred at the tool's origin, its edges along the tool's axes.
    Box {
        /// Full edge lengths (m).
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        size: DVec3,
    },
}

impl ToolShape {
    /// The fields that are out of their bounds; none in sound settings.
    #[must_use]
    pub fn check(&self) -> Vec<BadSetting> {
        let mut checks = Checks::default();
        match *self {
            Self::Sphere { radius } => checks.positive("radius", radius, " (m)"),
            Self::Plane { normal } => checks.direction("normal", normal),
            Self::Capsule { from, to, radius } => {
                checks.finite("from", from);
                checks.finite("to", to);
                checks.positive("radius", radius, " (m)");
            }
            Self::Box { size } => checks.lengths("size", size),
        }
        checks.0
    }

    /// The same `scale` times as large.
    #[must_use]
    pub fn scaled(&self, scale: f64) -> Self {
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
    #[must_use]
    pub fn contact(&self) -> (RigidShape, Pose) {
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

    /// Opposite corners of the box round it (m) in its frame; `None` for a plane, which has no end.
    #[must_use]
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        Some(match *self {
            Self::Plane { .. } => return None,
            Self::Sphere { radius } => [DVec3::splat(-radius), DVec3::splat(radius)],
            Self::Capsule { from, to, radius } => [from.min(to) - radius, from.max(to) + radius],
            Self::Box { size } => [-0.5 * size, 0.5 * size],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points lie as far from what contact has as the settings' words say.
    #[test]
    fn contact_has_the_shape_that_is_described() {
        let at = DVec3::new;
        let cases = [
            (ToolShape::Sphere { radius: 0.5 }, at(1.0, 0.0, 0.0), 0.5),
            (
                ToolShape::Plane {
                    normal: at(0.0, 2.0, 0.0),
                },
                at(7.0, 0.25, -3.0),
                0.25,
            ),
            (
                ToolShape::Capsule {
                    from: at(1.0, 0.0, 0.0),
                    to: at(1.0, 2.0, 0.0),
                    radius: 0.5,
                },
                at(3.0, 1.5, 0.0),
                1.5,
            ),
            (
                ToolShape::Box {
                    size: at(2.0, 4.0, 6.0),
                },
                at(0.0, 3.0, 0.0),
                1.0,
            ),
        ];
        for (shape, point, distance) in cases {
            let (contact, local) = shape.contact();
            let found = contact.distance_value(&local, point);
            assert!((found - distance).abs() < 1e-12, "{shape:?}: {found} m");
            let (twice, local) = shape.scaled(2.0).contact();
            let found = twice.distance_value(&local, 2.0 * point);
            assert!((found - 2.0 * distance).abs() < 1e-12, "{shape:?} doubled");
            if let Some([min, max]) = shape.bounds() {
                let (contact, local) = shape.contact();
                let corner = contact.distance_value(&local, max + 1e-9);
                assert!(corner > 0.0 && min.cmplt(max).all(), "{shape:?}");
            }
        }
    }
}
