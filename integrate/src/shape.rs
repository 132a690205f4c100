//! Rigid shapes by signed distance, with normal and curvature.

use glam::{DMat3, DQuat, DVec3};

/// What a tool occupies in its own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(
    feature = "schemars",
    derive(schemars::JsonSchema),
    schemars(rename = "ToolShape")
)]
pub enum RigidShape {
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

/// A shape about its own axis.
#[derive(Debug, Clone, Copy)]
enum AxisShape {
    Sphere {
        radius: f64,
    },
    /// `z < 0`.
    Plane,
    /// All points within `radius` of the segment from `-half_length` to `half_length` along z.
    Capsule {
        half_length: f64,
        radius: f64,
    },
    /// From `-half` to `half`.
    Box {
        half: DVec3,
    },
}

/// Where a rigid thing is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pose {
    /// Position of the shape's origin (m).
    pub position: DVec3,
    /// Turns the shape's frame into the world's; of unit length.
    pub rotation: DQuat,
}

impl Pose {
    /// The pose that moves nothing.
    pub const IDENTITY: Self = Self {
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
    };

    /// A pose without rotation.
    #[must_use]
    pub fn at(position: DVec3) -> Self {
        Self {
            position,
            ..Self::IDENTITY
        }
    }

    /// World position (m) of a point (m) of its frame: `R x + position`.
    #[must_use]
    pub fn apply(&self, local: DVec3) -> DVec3 {
        self.rotation * local + self.position
    }

    /// Pose in the world of what has the pose `local` in its frame.
    #[must_use]
    pub(crate) fn compose(&self, local: &Self) -> Self {
        Self {
            position: self.apply(local.position),
            rotation: (self.rotation * local.rotation).normalize(),
        }
    }

    /// The pose that fraction of the path to another, along a straight line and the shorter arc.
    #[must_use]
    pub fn toward(&self, other: &Self, share: f64) -> Self {
        Self {
            rotation: self.rotation.slerp(other.rotation, share),
            position: self.position + (other.position - self.position) * share,
        }
    }
}

/// Signed distance with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Distance {
    /// Distance (m), negative inside.
    pub value: f64,
    /// Its gradient: the outward normal of the shape, of unit length.
    pub normal: DVec3,
    /// Its second derivatives (1/m).
    pub curvature: DMat3,
}

impl RigidShape {
    /// Signed distance of a world point (m) from the shape at a pose.
    ///
    /// On the centre of a sphere, the axis of a capsule or the middle planes of a box the normal is
    /// not unique; a fixed one is given.
    #[must_use]
    pub fn distance(&self, pose: &Pose, point: DVec3) -> Distance {
        self.placed(pose).distance(point)
    }

    /// The shape at a pose, for many points.
    pub(crate) fn placed(&self, pose: &Pose) -> Placed {
        let (solid, local) = self.solid();
        let pose = local.map_or(*pose, |local| pose.compose(&local));
        Placed {
            solid,
            position: pose.position,
            turn: DMat3::from_quat(pose.rotation),
        }
    }

    /// The shape about its own axis, and where that lies in the shape's frame if not in its own position.
    fn solid(&self) -> (AxisShape, Option<Pose>) {
        let along = |axis: DVec3| DQuat::from_rotation_arc(DVec3::Z, axis.normalize_or(DVec3::Z));
        match *self {
            Self::Sphere { radius } => (AxisShape::Sphere { radius }, None),
            Self::Plane { normal } => {
                let rotation = along(normal);
                let position = DVec3::ZERO;
                (AxisShape::Plane, Some(Pose { position, rotation }))
            }
            Self::Capsule { from, to, radius } => {
                let half_length = 0.5 * from.distance(to);
                let (position, rotation) = (from.midpoint(to), along(to - from));
                let capsule = AxisShape::Capsule {
                    half_length,
                    radius,
                };
                (capsule, Some(Pose { position, rotation }))
            }
            Self::Box { size } => (AxisShape::Box { half: size * 0.5 }, None),
        }
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

    /// Opposite corners of the box around it (m) in its frame; `None` for a plane, which has no end.
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

impl AxisShape {
    #[inline]
    fn value_at(&self, x: DVec3) -> f64 {
        match *self {
            Self::Sphere { radius } => x.length() - radius,
            Self::Plane => x.z,
            Self::Capsule {
                half_length,
                radius,
            } => {
                let along = x.z.clamp(-half_length, half_length);
                (x - DVec3::Z * along).length() - radius
            }
            Self::Box { half } => {
                let q = x.abs() - half;
                let inside = q.max_element();
                if inside <= 0.0 {
                    inside
                } else {
                    q.max(DVec3::ZERO).length()
                }
            }
        }
    }

    fn distance_at(&self, x: DVec3) -> Distance {
        match *self {
            Self::Sphere { radius } => round(x, radius, DMat3::IDENTITY),
            Self::Plane => flat(x.z, DVec3::Z),
            Self::Capsule {
                half_length,
                radius,
            } => {
                let along = x.z.clamp(-half_length, half_length);
                let on_side = along.abs() < half_length;
                // On the side the surface is straight along z.
                let across = if on_side {
                    DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0))
                } else {
                    DMat3::IDENTITY
                };
                round(x - DVec3::Z * along, radius, across)
            }
            Self::Box { half } => {
                let q = x.abs() - half;
                let sign = DVec3::new(1.0, 1.0, 1.0).copysign(x);
                if q.max_element() <= 0.0 {
                    let face = if q.x >= q.y && q.x >= q.z {
                        DVec3::X
                    } else if q.y >= q.z {
                        DVec3::Y
                    } else {
                        DVec3::Z
                    };
                    return flat(q.max_element(), face * sign);
                }
                let outside = q.max(DVec3::ZERO);
                let value = outside.length();
                let normal = outside / value * sign;
                // Curved about an edge or corner, along the axes that lie outside.
                let axes = DVec3::select(q.cmpgt(DVec3::ZERO), DVec3::ONE, DVec3::ZERO);
                let curvature = (DMat3::from_diagonal(axes) - outer(normal)) * value.recip();
                Distance {
                    value,
                    normal,
                    curvature,
                }
            }
        }
    }
}

/// A shape at a pose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placed {
    solid: AxisShape,
    position: DVec3,
    turn: DMat3,
}

impl Placed {
    #[inline]
    fn local(&self, point: DVec3) -> DVec3 {
        self.turn.transpose() * (point - self.position)
    }

    #[inline]
    pub(crate) fn value(&self, point: DVec3) -> f64 {
        self.solid.value_at(self.local(point))
    }

    pub(crate) fn distance(&self, point: DVec3) -> Distance {
        let mut found = self.solid.distance_at(self.local(point));
        found.normal = self.turn * found.normal;
        // Most points lie on faces.
        if found.curvature != DMat3::ZERO {
            found.curvature = self.turn * found.curvature * self.turn.transpose();
        }
        found
    }
}

fn flat(value: f64, normal: DVec3) -> Distance {
    Distance {
        value,
        normal,
        curvature: DMat3::ZERO,
    }
}

/// Distance from a ball or cylinder whose centre line is at the origin; `across` projects on the
/// curved directions.
fn round(from_centre: DVec3, radius: f64, across: DMat3) -> Distance {
    let length = from_centre.length();
    if length == 0.0 {
        return flat(-radius, DVec3::X);
    }
    let normal = from_centre / length;
    Distance {
        value: length - radius,
        normal,
        curvature: (across - outer(normal)) * length.recip(),
    }
}

pub(crate) fn outer(n: DVec3) -> DMat3 {
    DMat3::from_cols(n * n.x, n * n.y, n * n.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use testkit::strategies::{rotation, vector};

    const SHAPES: [RigidShape; 4] = [
        RigidShape::Sphere { radius: 0.7 },
        RigidShape::Plane { normal: DVec3::Z },
        RigidShape::Capsule {
            from: DVec3::new(0.0, 0.0, -0.6),
            to: DVec3::new(0.0, 0.0, 0.6),
            radius: 0.3,
        },
        RigidShape::Box {
            size: DVec3::new(1.0, 1.6, 0.6),
        },
    ];

    proptest! {
        #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn normal_and_curvature_are_derivatives(
            shape in 0_usize..4,
            position in vector(1.0),
            rotation in rotation(),
            offset in vector(1.5),
            direction in vector(1.0),
        ) {
            let shape = SHAPES[shape];
            let pose = Pose { position, rotation };
            let at = |t: f64| shape.distance(&pose, position + offset + direction * t);
            let here = at(0.0);
            prop_assume!(offset.length() > 0.05);
            let t = 1e-5;
            let (a, b) = (at(-t), at(t));
            // Kinks (edges of the box's inside, ends of the capsule) are left out.
            prop_assume!((a.curvature - b.curvature).abs().to_cols_array().iter().sum::<f64>() < 1e-2);
            prop_assume!((a.normal - b.normal).length() < 1e-2);
            let slope = (b.value - a.value) / (2.0 * t);
            prop_assert!((slope - here.normal.dot(direction)).abs() < 1e-6, "{shape:?} {slope}");
            let turn = (b.normal - a.normal) / (2.0 * t);
            prop_assert!((turn - here.curvature * direction).length() < 1e-3, "{shape:?} {turn}");
            prop_assert!((here.normal.length() - 1.0).abs() < 1e-12);
            let value = shape.placed(&pose).value(position + offset);
            prop_assert!((value - here.value).abs() < 1e-14, "the short way: {value}");
        }
    }

    /// Points lie as far from a shape as its words say.
    #[test]
    fn distances_are_those_of_the_shape_described() {
        let at = DVec3::new;
        let cases = [
            (RigidShape::Sphere { radius: 0.5 }, at(1.0, 0.0, 0.0), 0.5),
            (
                RigidShape::Plane {
                    normal: at(0.0, 2.0, 0.0),
                },
                at(7.0, 0.25, -3.0),
                0.25,
            ),
            (
                RigidShape::Capsule {
                    from: at(1.0, 0.0, 0.0),
                    to: at(1.0, 2.0, 0.0),
                    radius: 0.5,
                },
                at(3.0, 1.5, 0.0),
                1.5,
            ),
            (
                RigidShape::Box {
                    size: at(2.0, 4.0, 6.0),
                },
                at(0.0, 3.0, 0.0),
                1.0,
            ),
            (SHAPES[0], DVec3::ZERO, -0.7),
            (SHAPES[2], at(0.0, 0.0, 1.0), 0.1),
            (SHAPES[3], at(0.0, 0.7, 0.0), -0.1),
            (SHAPES[3], at(1.5, 1.8, 1.3), 3.0_f64.sqrt()),
        ];
        let value = |shape: &RigidShape, point: DVec3| {
            let pose = Pose::at(DVec3::Z);
            shape.placed(&pose).value(point + DVec3::Z)
        };
        for (shape, point, distance) in cases {
            let found = value(&shape, point);
            assert!((found - distance).abs() < 1e-12, "{shape:?}: {found} m");
            let found = value(&shape.scaled(2.0), 2.0 * point);
            assert!((found - 2.0 * distance).abs() < 1e-12, "{shape:?} doubled");
            if let Some([min, max]) = shape.bounds() {
                let corner = value(&shape, max + 1e-9);
                assert!(corner > 0.0 && min.cmplt(max).all(), "{shape:?}");
            }
        }
    }
}
