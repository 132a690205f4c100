//! Proptest strategies for vectors, rotations and scales.

use glam::{DQuat, DVec3};
use proptest::prelude::*;

/// A vector with components in `[-half, half]`.
pub fn vector(half: f64) -> impl Strategy<Value = DVec3> {
    (-half..=half, -half..=half, -half..=half).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

/// A uniformly spread rotation.
pub fn rotation() -> impl Strategy<Value = DQuat> {
    (vector(1.0), 0.0..std::f64::consts::TAU).prop_map(|(axis, angle)| {
        DQuat::from_axis_angle(axis.try_normalize().unwrap_or(DVec3::Z), angle)
    })
}

/// A length scale between 1e-6 and 1e6, uniform in its logarithm.
pub fn scale() -> impl Strategy<Value = f64> {
    (-6.0..=6.0).prop_map(|exponent: f64| 10.0_f64.powf(exponent))
}
