//! Stress intensities of a crack from nodal displacements.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use phyxel_enrich::Cuts;

use super::{POISSON, YOUNG};

/// Displacement gradients at the nodes of a slab.
pub(super) struct Field<'a> {
    /// Rest positions (m).
    pub(super) rest: &'a [DVec3],
    /// Volumes (m³).
    pub(super) volumes: &'a [f64],
    /// Displacement gradients.
    pub(super) gradients: &'a [DMat3],
    /// Extent of the slab along z (m).
    pub(super) thickness: f64,
    /// The cut, which tells on which of its sides a node in its plane lies.
    pub(super) cuts: &'a Cuts,
}

/// Plane strain modulus (Pa).
pub(super) fn plane_modulus() -> f64 {
    YOUNG / (1.0 - POISSON * POISSON)
}

/// Williams' near field of unit stress intensity in the frame of the tip, modes I and II.
fn near_field(mode: usize, p: [f64; 2]) -> [f64; 2] {
    let mu = YOUNG / (2.0 * (1.0 + POISSON));
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

/// Stress (Pa) of linear elasticity with [`YOUNG`] and [`POISSON`] at a displacement gradient.
#[must_use]
pub fn stress(gradient: DMat3) -> DMat3 {
    let strain = 0.5 * (gradient + gradient.transpose());
    let mu = YOUNG / (2.0 * (1.0 + POISSON));
    let lame = YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
    let trace = strain.x_axis.x + strain.y_axis.y + strain.z_axis.z;
    2.0 * mu * strain + lame * trace * DMat3::IDENTITY
}

fn contract(a: DMat3, b: DMat3) -> f64 {
    a.x_axis.dot(b.x_axis) + a.y_axis.dot(b.y_axis) + a.z_axis.dot(b.z_axis)
}

/// Stress intensities `K_I` and `K_II` (Pa m^1/2) by the interaction integral over a disc of `radius`
/// (m) round the tip of a crack that runs `along`.
pub(super) fn stress_intensities(
    field: &Field<'_>,
    tip: DVec3,
    along: DVec3,
    radius: f64,
) -> [f64; 2] {
    let normal = DVec3::Z.cross(along);
    let turn = DMat3::from_cols(along, normal, DVec3::Z);
    let mut integrals = [0.0; 2];
    for (i, x) in field.rest.iter().enumerate() {
        let d = (*x - tip).with_z(0.0);
        let q = d.length() / radius;
        if !(1e-9..1.0).contains(&q) {
            continue;
        }
        // Weight (1 - q²)², 1 at the tip.
        let mut local = turn.transpose() * d;
        if local.y.abs() < 1e-4 * d.length() {
            // Nodes in the plane of the cut belong to one of its sides.
            let below = 1e-3 * d.length() * normal;
            let above = local.x > 0.0 || field.cuts.crosses(*x, *x - below);
            local.y = 1e-4 * d.length() * if above { 1.0 } else { -1.0 };
        }
        let slope = -4.0 * (1.0 - q * q) / (radius * radius) * local;
        let gradient = turn.transpose() * field.gradients[i] * turn;
        let sigma = stress(gradient);
        for (mode, integral) in integrals.iter_mut().enumerate() {
            let step = 1e-6 * d.length();
            let near = |dx: f64, dy: f64| near_field(mode, [local.x + dx, local.y + dy]);
            let (px, mx) = (near(step, 0.0), near(-step, 0.0));
            let (py, my) = (near(0.0, step), near(0.0, -step));
            let column =
                |p: [f64; 2], m: [f64; 2]| DVec3::new(p[0] - m[0], p[1] - m[1], 0.0) / (2.0 * step);
            let other = DMat3::from_cols(column(px, mx), column(py, my), DVec3::ZERO);
            let other_sigma = stress(other);
            let flow = sigma.transpose() * other.x_axis + other_sigma.transpose() * gradient.x_axis;
            let energy = contract(sigma, 0.5 * (other + other.transpose()));
            *integral += field.volumes[i] * (flow.dot(slope) - energy * slope.x);
        }
    }
    integrals.map(|integral| 0.5 * plane_modulus() * integral / field.thickness)
}

/// Opening (m) of a cut along `normal` at a point of its face: both sides by the nearest nodes, of those
/// with a mean distance of `spacing` (m), that look at it from that side, each with its own gradient.
pub(super) fn opening(
    (rest, spacing): (&[DVec3], f64),
    cuts: &Cuts,
    u: &[DVec3],
    gradients: &[DMat3],
    at: DVec3,
    normal: DVec3,
) -> f64 {
    let side = |sign: f64| -> f64 {
        let from = at + sign * 1e-6 * spacing * normal;
        let (mut best, mut nearest) = (f64::INFINITY, 0);
        for (i, x) in rest.iter().enumerate() {
            let d = x.distance(at);
            if d < best && d < 3.0 * spacing && !cuts.crosses(from, *x) {
                (best, nearest) = (d, i);
            }
        }
        let value = u[nearest] + gradients[nearest] * (at - rest[nearest]);
        value.dot(normal)
    };
    side(1.0) - side(-1.0)
}
