//! Stress intensities of a crack from nodal displacements.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::cut_body::CutBody;
use super::{POISSON, plane_modulus, shear_modulus, stress};

/// Williams' near field of unit stress intensity in the frame of the tip, modes I and II.
fn near_field(mode: usize, p: [f64; 2]) -> [f64; 2] {
    let mu = shear_modulus();
    let kappa = 3.0 - 4.0 * POISSON;
    let (r, theta) = (p[0].hypot(p[1]), p[1].atan2(p[0]));
    let (s, c) = (0.5 * theta).sin_cos();
    let scale = (r / (2.0 * PI)).sqrt() / (2.0 * mu);
    if mode == 0 {
        [
            scale * c * (kappa - 1.0 + 2.0 * s * s),
            scale * s * (kappa + 1.0 - 2.0 * c * c),
        ]
    } else {
        [
            scale * s * (kappa + 1.0 + 2.0 * c * c),
            -scale * c * (kappa - 1.0 - 2.0 * s * s),
        ]
    }
}

fn contract(a: DMat3, b: DMat3) -> f64 {
    a.x_axis.dot(b.x_axis) + a.y_axis.dot(b.y_axis) + a.z_axis.dot(b.z_axis)
}

/// Stress intensities `K_I` and `K_II` (Pa m^1/2) by the interaction integral over a disc of `radius`
/// (m) around the tip of a crack that runs `along`.
pub(crate) fn stress_intensities(
    cut: &CutBody<'_>,
    gradients: &[DMat3],
    tip: DVec3,
    along: DVec3,
    radius: f64,
) -> [f64; 2] {
    let body = cut.body;
    let thickness = body.high.z - body.low.z;
    let normal = DVec3::Z.cross(along);
    let turn = DMat3::from_cols(along, normal, DVec3::Z);
    let mut integrals = [0.0; 2];
    for (i, x) in body.block.rest.iter().enumerate() {
        let d = (*x - tip).with_z(0.0);
        let q = d.length() / radius;
        if !(1e-9..1.0).contains(&q) {
            continue;
        }
        // Weight (1 - q²)², 1 at the tip.
        let local = turn.transpose() * d;
        let slope = -4.0 * (1.0 - q * q) / (radius * radius) * local;
        let gradient = turn.transpose() * gradients[i] * turn;
        let sigma = stress(gradient);
        for (mode, integral) in integrals.iter_mut().enumerate() {
            let step = 1e-6 * d.length();
            let field = |dx: f64, dy: f64| near_field(mode, [local.x + dx, local.y + dy]);
            let (px, mx) = (field(step, 0.0), field(-step, 0.0));
            let (py, my) = (field(0.0, step), field(0.0, -step));
            let column =
                |p: [f64; 2], m: [f64; 2]| DVec3::new(p[0] - m[0], p[1] - m[1], 0.0) / (2.0 * step);
            let other = DMat3::from_cols(column(px, mx), column(py, my), DVec3::ZERO);
            let other_sigma = stress(other);
            let flow = sigma.transpose() * other.x_axis + other_sigma.transpose() * gradient.x_axis;
            let energy = contract(sigma, 0.5 * (other + other.transpose()));
            *integral += cut.stencils.volumes[i] * (flow.dot(slope) - energy * slope.x);
        }
    }
    integrals.map(|integral| 0.5 * plane_modulus() * integral / thickness)
}
