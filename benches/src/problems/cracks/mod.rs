//! Cracks with a known answer: how a cut weakens pairs, and what that does to the mechanics.

mod cut_body;
mod field;
mod plate;
mod problems;
pub mod references;

use glam::{DMat3, DVec3};

pub use cut_body::Form;
pub use problems::{Ratios, add_stroke, edge_crack};

use super::nearest;

/// Young's modulus (Pa) and Poisson's ratio of all cracks.
pub const YOUNG: f64 = 1000.0;
/// See [`YOUNG`].
pub const POISSON: f64 = 0.3;

/// Plane strain modulus (Pa).
pub fn plane_modulus() -> f64 {
    YOUNG / (1.0 - POISSON * POISSON)
}

/// Shear modulus (Pa).
pub fn shear_modulus() -> f64 {
    YOUNG / (2.0 * (1.0 + POISSON))
}

/// Stress (Pa) of linear elasticity with [`YOUNG`] and [`POISSON`] at a displacement gradient.
pub fn stress(gradient: DMat3) -> DMat3 {
    let strain = 0.5 * (gradient + gradient.transpose());
    let mu = shear_modulus();
    let lame = YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
    let trace = strain.x_axis.x + strain.y_axis.y + strain.z_axis.z;
    2.0 * mu * strain + lame * trace * DMat3::IDENTITY
}

/// Opening (m) of a cut along `normal` at a point of its face: both sides by the nearest nodes within three spacings that look
/// at it from that side, without a crossing, each with its own gradient. The field are positions at rest, displacements (m) and
/// displacement gradients of the nodes.
pub(crate) fn opening(
    (rest, moved, gradients): (&[DVec3], &[DVec3], &[DMat3]),
    spacing: f64,
    crosses: impl Fn(DVec3, DVec3) -> bool,
    at: DVec3,
    normal: DVec3,
) -> f64 {
    let side = |sign: f64| {
        let from = at + sign * 1e-6 * spacing * normal;
        let sees = |x: DVec3| x.distance(at) < 3.0 * spacing && !crosses(from, x);
        nearest(rest, at, sees).map_or(f64::NAN, |i| {
            (moved[i] + gradients[i] * (at - rest[i])).dot(normal)
        })
    };
    side(1.0) - side(-1.0)
}

/// Eight positions of the tip along the line and of the line across it, relative to the nodes, in
/// spacings: what a method does must not hang on them.
pub const PLACES: [[f64; 2]; 8] = [
    [0.0, 0.25],
    [0.25, 0.25],
    [0.5, 0.25],
    [0.75, 0.25],
    [0.0, 0.4],
    [0.25, 0.4],
    [0.5, 0.4],
    [0.75, 0.4],
];
