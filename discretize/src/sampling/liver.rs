//! A liver made of smooth primitives.

use glam::DVec3;

/// Centimetre, the unit of the constants below (m).
const CENTIMETRE: f64 = 0.01;

/// Ellipsoid turned about the z axis: centre, semi-axes (cm), angle (degrees).
struct Lobe {
    center: [f64; 3],
    semi_axes: [f64; 3],
    angle: f64,
}

impl Lobe {
    /// `(|q/r| - 1) min(r)`: zero on the ellipsoid, negative inside, smooth off the centre.
    fn value(&self, p: DVec3) -> f64 {
        let q = p - DVec3::from_array(self.center);
        let (sin, cos) = self.angle.to_radians().sin_cos();
        let q = DVec3::new(cos * q.x + sin * q.y, cos * q.y - sin * q.x, q.z);
        let r = DVec3::from_array(self.semi_axes);
        ((q / r).length() - 1.0) * r.min_element()
    }
}

const RIGHT: Lobe = Lobe {
    center: [-2.9, -0.2, -0.3],
    semi_axes: [4.9, 7.2, 6.1],
    angle: 14.0,
};
const MIDDLE: Lobe = Lobe {
    center: [1.0, 2.3, 0.3],
    semi_axes: [5.0, 4.2, 5.2],
    angle: 10.0,
};
const LEFT: Lobe = Lobe {
    center: [4.4, 2.9, 1.2],
    semi_axes: [4.4, 2.7, 3.6],
    angle: 14.0,
};
/// What presses the underside hollow (stomach, duodenum, kidney).
const UNDERSIDE: Lobe = Lobe {
    center: [4.6, -9.6, -6.6],
    semi_axes: [10.2, 10.6, 9.0],
    angle: 0.0,
};
/// The notch of the round ligament between the lobes.
const NOTCH: Lobe = Lobe {
    center: [2.4, -2.7, 4.8],
    semi_axes: [1.05, 4.2, 3.4],
    angle: -16.0,
};

/// Cubic smooth minimum, twice continuously differentiable, blending over `|a - b| < width`.
fn smooth_minimum(a: f64, b: f64, width: f64) -> f64 {
    let h = (width - (a - b).abs()).max(0.0) / width;
    a.min(b) - h * h * h * width / 6.0
}

fn smooth_maximum(a: f64, b: f64, width: f64) -> f64 {
    -smooth_minimum(-a, -b, width)
}

/// The level-set function of the liver (m), negative inside; about 17 cm wide, 1.2 litres.
///
/// x points to the patient's left, y to the head, z to the front; the origin is near the middle.
pub(crate) fn liver(p: DVec3) -> f64 {
    let p = p / CENTIMETRE;
    let right_and_middle = smooth_minimum(RIGHT.value(p), MIDDLE.value(p), 4.0);
    let lobes = smooth_minimum(right_and_middle, LEFT.value(p), 3.0);
    let hollow = smooth_maximum(lobes, -UNDERSIDE.value(p), 0.9);
    smooth_maximum(hollow, -NOTCH.value(p), 1.4) * CENTIMETRE
}
