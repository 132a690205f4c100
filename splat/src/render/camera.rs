//! Cameras.

use glam::{BVec3, DMat3, DVec3};

/// How a camera maps depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lens {
    /// Perspective; `focal` in units of the image's height (`0.5 / tan(fov / 2)`).
    Perspective {
        /// Focal length over image height (1).
        focal: f64,
    },
    /// Orthographic; `height` is what the image shows from bottom to top (m).
    Orthographic {
        /// Height of the view (m).
        height: f64,
    },
}

impl Lens {
    /// Pixels (px) per metre at a depth (m), of an image so many pixels high.
    pub(crate) fn scale(self, image_height: f64, depth: f64) -> f64 {
        match self {
            Self::Perspective { focal } => focal * image_height / depth,
            Self::Orthographic { height } => image_height / height,
        }
    }
}

/// A camera: right-handed, x to the right of the image, y up, looking along `forward`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Eye point (m).
    pub eye: DVec3,
    /// Unit vector to the right.
    pub right: DVec3,
    /// Unit vector up.
    pub up: DVec3,
    /// Unit vector of view.
    pub forward: DVec3,
    /// Projection.
    pub lens: Lens,
}

/// Vertical field of view of the framing cameras (radians): 28°, about a short telephoto lens.
const FIELD_OF_VIEW: f64 = 0.488_69;
/// Fraction of the image that a framed box leaves free on each side.
const MARGIN: f64 = 0.06;

impl Camera {
    /// A perspective camera that looks along `direction` at the box `low..high` and shows all of
    /// it, as large as it fits an image of `aspect` = width / height.
    ///
    /// # Panics
    /// If `direction` is zero, the box is not finite or empty, or `aspect` is not positive.
    #[must_use]
    pub fn framing(low: DVec3, high: DVec3, direction: DVec3, up: DVec3, aspect: f64) -> Self {
        let (camera, corners) = Self::aimed(low, high, direction, up, aspect);
        camera.backed_off(&corners, (low + high) * 0.5, aspect)
    }

    /// The camera with its eye on the line of sight through `centre`, where it just sees all points.
    fn backed_off(mut self, points: &[DVec3], centre: DVec3, aspect: f64) -> Self {
        let half = (FIELD_OF_VIEW * 0.5).tan();
        // Per point, the distance at which it just fits; the farthest wins.
        let room = half * (1.0 - 2.0 * MARGIN);
        let mut distance: f64 = 0.0;
        for &p in points {
            let d = p - centre;
            let side = (d.dot(self.right).abs() / aspect).max(d.dot(self.up).abs());
            distance = distance.max(side / room - d.dot(self.forward));
        }
        self.eye = centre - self.forward * distance;
        self.lens = Lens::Perspective { focal: 0.5 / half };
        self
    }

    /// A perspective camera that looks along `direction` at some points and shows all of them, z upwards, as
    /// large as they fit an image of `aspect` = width / height.
    ///
    /// # Panics
    /// As [`Camera::framing`], for the points' box.
    #[must_use]
    pub fn around(points: &[DVec3], direction: DVec3, aspect: f64) -> Self {
        let low = points.iter().fold(DVec3::INFINITY, |low, x| low.min(*x));
        let high = points.iter().fold(-DVec3::INFINITY, |high, x| high.max(*x));
        let (camera, _) = Self::aimed(low, high, direction, DVec3::Z, aspect);
        // The middle of what is seen, which is not that of the box where the points lie along its diagonal.
        let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in points {
            let seen = DVec3::new(p.dot(camera.right), p.dot(camera.up), p.dot(camera.forward));
            (least, most) = (least.min(seen), most.max(seen));
        }
        let middle = (least + most) * 0.5;
        let centre = camera.right * middle.x + camera.up * middle.y + camera.forward * middle.z;
        camera.backed_off(points, centre, aspect)
    }

    /// A perspective camera at a position (m) that looks at another, as far as it can with `up` upwards, with a vertical
    /// field of view (rad) above 0 and below π. It looks along y where the positions coincide, and is turned
    /// anyhow where `up` lies along its view.
    #[must_use]
    pub fn looking_at(eye: DVec3, target: DVec3, up: DVec3, field_of_view: f64) -> Self {
        let focal = 0.5 / (0.5 * field_of_view).tan();
        Self {
            eye,
            lens: Lens::Perspective { focal },
            ..Self::along((target - eye).normalize_or(DVec3::Y), up)
        }
    }

    /// A camera at the origin that looks along a unit vector.
    fn along(forward: DVec3, up: DVec3) -> Self {
        let aside = forward.any_orthonormal_vector();
        let right = forward.cross(up).normalize_or(aside);
        Self {
            eye: DVec3::ZERO,
            right,
            up: right.cross(forward),
            forward,
            lens: Lens::Orthographic { height: 1.0 },
        }
    }

    /// As [`Camera::framing`], orthographic.
    ///
    /// # Panics
    /// As [`Camera::framing`].
    #[must_use]
    pub fn framing_orthographic(
        low: DVec3,
        high: DVec3,
        direction: DVec3,
        up: DVec3,
        aspect: f64,
    ) -> Self {
        let (mut camera, corners) = Self::aimed(low, high, direction, up, aspect);
        let centre = (low + high) * 0.5;
        let mut half: f64 = 0.0;
        for p in corners {
            let d = p - centre;
            half = half.max((d.dot(camera.right).abs() / aspect).max(d.dot(camera.up).abs()));
        }
        camera.eye = centre - camera.forward * (high - low).length();
        camera.lens = Lens::Orthographic {
            height: 2.0 * half / (1.0 - 2.0 * MARGIN),
        };
        camera
    }

    fn aimed(
        low: DVec3,
        high: DVec3,
        direction: DVec3,
        up: DVec3,
        aspect: f64,
    ) -> (Self, Vec<DVec3>) {
        let framed = low.is_finite() && high.is_finite() && low.cmplt(high).any();
        assert!(framed, "the box to frame must be finite and not a point");
        assert!(aspect > 0.0, "the aspect must be positive");
        let forward = direction
            .try_normalize()
            .expect("the direction of view must not be zero");
        let corner = |k: u32| {
            let is_high = BVec3::new(k & 1 > 0, k & 2 > 0, k & 4 > 0);
            DVec3::select(is_high, high, low)
        };
        (Self::along(forward, up), (0..8).map(corner).collect())
    }

    /// World to camera axes: image right, image **down**, forward.
    pub(crate) fn axes(&self) -> DMat3 {
        DMat3::from_cols(self.right, -self.up, self.forward).transpose()
    }

    /// Pixel coordinates (x right, y down, pixel centres at halves) and depth along the view (m)
    /// of a world point in an image of `width × height`.
    #[must_use]
    pub fn project(&self, p: DVec3, width: u32, height: u32) -> (f64, f64, f64) {
        let c = self.axes() * (p - self.eye);
        let (w, h) = (f64::from(width), f64::from(height));
        let scale = self.lens.scale(h, c.z);
        (0.5 * w + scale * c.x, 0.5 * h + scale * c.y, c.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use testkit::strategies;

    proptest! {
        /// All points are seen, and some lie at the margin.
        #[test]
        fn points_fill_the_image(
            points in proptest::collection::vec(strategies::vector(1.0), 20..60),
            direction in strategies::vector(1.0),
            wide in proptest::bool::ANY,
        ) {
            prop_assume!(direction.length() > 0.1);
            let (width, height) = if wide { (1600, 900) } else { (600, 800) };
            let camera = Camera::around(&points, direction, f64::from(width) / f64::from(height));
            let mut widest: f64 = 0.0;
            for p in points {
                let (x, y, depth) = camera.project(p, width, height);
                let beside = (2.0 * x / f64::from(width) - 1.0).abs();
                widest = widest.max(beside).max((2.0 * y / f64::from(height) - 1.0).abs());
                prop_assert!(depth > 0.0);
            }
            prop_assert!((widest - (1.0 - 2.0 * MARGIN)).abs() < 1e-12, "{widest}");
        }
    }
}
