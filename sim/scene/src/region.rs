//! Parts of space, to say which nodes are meant.

use glam::DVec3;

/// A part of space in rest coordinates.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Region {
    /// The points on the side of a plane that its normal points to.
    HalfSpace {
        /// A point of the plane (m).
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        point: DVec3,
        /// Normal of the plane, of any length above zero.
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        normal: DVec3,
    },
    /// An axis-aligned box.
    Box {
        /// Corner with the smallest coordinates (m).
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        min: DVec3,
        /// Corner with the largest coordinates (m).
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        max: DVec3,
    },
    /// A ball.
    Sphere {
        /// Centre (m).
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        center: DVec3,
        /// Radius (m).
        radius: f64,
    },
}

impl Region {
    /// Whether `point` (m) lies in the region or on its boundary.
    #[must_use]
    pub fn contains(&self, point: DVec3) -> bool {
        match *self {
            Self::HalfSpace {
                point: origin,
                normal,
            } => (point - origin).dot(normal) >= 0.0,
            Self::Box { min, max } => point.cmpge(min).all() && point.cmple(max).all(),
            Self::Sphere { center, radius } => point.distance_squared(center) <= radius * radius,
        }
    }

    /// Those of `places` (m) that lie in it, by number.
    #[must_use]
    pub fn nodes(&self, places: &[DVec3]) -> Vec<u32> {
        let within = (0_u32..).zip(places).filter(|(_, x)| self.contains(**x));
        within.map(|(node, _)| node).collect()
    }

    /// Which of some regions each of `places` (m) is in, by the regions' numbers: of several the last, 0 of none.
    pub fn numbered<'a>(
        regions: impl Iterator<Item = (u32, &'a Self)>,
        places: &[DVec3],
    ) -> Vec<u32> {
        let mut numbers = vec![0; places.len()];
        for (number, region) in regions {
            for node in region.nodes(places) {
                numbers[node as usize] = number;
            }
        }
        numbers
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_border_belongs_to_it() {
        let regions = [
            Region::HalfSpace {
                point: DVec3::X,
                normal: 2.0 * DVec3::X,
            },
            Region::Box {
                min: DVec3::X,
                max: DVec3::new(2.0, 1.0, 1.0),
            },
            Region::Sphere {
                center: 2.0 * DVec3::X,
                radius: 1.0,
            },
        ];
        let places = [DVec3::ZERO, DVec3::X, 1.5 * DVec3::X, 0.999 * DVec3::X];
        for region in regions {
            assert_eq!(region.nodes(&places), [1, 2], "{region:?}");
        }
    }
}
