//! Where a camera stands, as settings say it.

use glam::DVec3;

use crate::render::{Camera, Lens};

/// Where the camera stands.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum View {
    /// Looks at the middle of the bodies, from a direction, so that they fill the frame.
    Around {
        /// Angle (degrees) about +z from -y (the front) towards +x.
        #[cfg_attr(feature = "serde", serde(default = "View::default_azimuth"))]
        azimuth: f64,
        /// Angle (degrees) above the horizontal plane.
        #[cfg_attr(feature = "serde", serde(default = "View::default_elevation"))]
        elevation: f64,
        /// Size in the frame: 1 fits the bodies at rest with a margin, 2 is twice as large.
        #[cfg_attr(feature = "serde", serde(default = "View::default_zoom"))]
        zoom: f64,
        /// Whether what is far is drawn as large as what is near.
        #[cfg_attr(feature = "serde", serde(default))]
        parallel: bool,
    },
    /// Stands at a position.
    Explicit {
        /// Place of the eye (m).
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        eye: DVec3,
        /// Place looked at (m).
        #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
        target: DVec3,
        /// Vertical field of view (degrees).
        #[cfg_attr(feature = "serde", serde(default = "View::default_field_of_view"))]
        field_of_view: f64,
    },
}

impl View {
    const fn default_azimuth() -> f64 {
        20.0
    }
    const fn default_elevation() -> f64 {
        25.0
    }
    const fn default_zoom() -> f64 {
        1.0
    }
    #[cfg(feature = "serde")]
    const fn default_field_of_view() -> f64 {
        30.0
    }

    /// The camera that shows bodies in the box from `low` to `high` (m) in an image of `aspect` = width / height, z
    /// upwards.
    ///
    /// # Panics
    /// As [`Camera::framing`], and if `zoom` is not above zero.
    #[must_use]
    pub fn camera(&self, low: DVec3, high: DVec3, aspect: f64) -> Camera {
        match *self {
            Self::Around {
                azimuth,
                elevation,
                zoom,
                parallel,
            } => {
                assert!(zoom > 0.0, "a zoom must be above zero, not {zoom}");
                let (sin_a, cos_a) = azimuth.to_radians().sin_cos();
                let (sin_e, cos_e) = elevation.to_radians().sin_cos();
                let towards = DVec3::new(sin_a * cos_e, -cos_a * cos_e, sin_e);
                if parallel {
                    let mut camera =
                        Camera::framing_orthographic(low, high, -towards, DVec3::Z, aspect);
                    if let Lens::Orthographic { height } = &mut camera.lens {
                        *height /= zoom;
                    }
                    return camera;
                }
                let mut camera = Camera::framing(low, high, -towards, DVec3::Z, aspect);
                let middle = low.midpoint(high);
                camera.eye = middle + (camera.eye - middle) / zoom;
                camera
            }
            Self::Explicit {
                eye,
                target,
                field_of_view,
            } => Camera::looking_at(eye, target, DVec3::Z, field_of_view.to_radians()),
        }
    }
}

impl Default for View {
    fn default() -> Self {
        Self::Around {
            azimuth: Self::default_azimuth(),
            elevation: Self::default_elevation(),
            zoom: Self::default_zoom(),
            parallel: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(azimuth: f64, elevation: f64, zoom: f64, parallel: bool) -> Camera {
        let view = View::Around {
            azimuth,
            elevation,
            zoom,
            parallel,
        };
        view.camera(DVec3::ZERO, DVec3::new(0.2, 0.1, 0.1), 1.6)
    }

    #[test]
    fn angles_count_from_the_front_and_up() {
        let near = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-12, "{a} for {b}");
        near(around(0.0, 0.0, 1.0, false).forward, DVec3::Y);
        near(around(90.0, 0.0, 1.0, false).forward, -DVec3::X);
        let above = around(20.0, 90.0, 1.0, true).forward;
        assert!(above.z < -1.0 + 1e-12, "{above}");
    }

    /// Twice the zoom halves the way to the middle, or what a parallel view shows.
    #[test]
    fn zoom_is_a_share_of_the_distance() {
        let middle = DVec3::new(0.1, 0.05, 0.05);
        let [one, two] = [1.0, 2.0].map(|zoom| around(20.0, 25.0, zoom, false));
        let ways = [one, two].map(|camera| camera.eye.distance(middle));
        assert!((ways[0] - 2.0 * ways[1]).abs() < 1e-12, "{ways:?}");
        let [one, two] = [1.0, 2.0].map(|zoom| around(20.0, 25.0, zoom, true).lens);
        let (Lens::Orthographic { height: one }, Lens::Orthographic { height: two }) = (one, two)
        else {
            panic!("parallel views have orthographic lenses, not {one:?} and {two:?}");
        };
        assert!((one - 2.0 * two).abs() < 1e-12, "{one} {two}");
    }
}
