//! Measures of a stress.

use glam::{DMat3, DVec3};

/// Equivalent stress `sqrt(3/2 s:s)` (Pa) of a Cauchy stress with the deviator `s` (von Mises 1913).
#[must_use]
pub fn von_mises_stress(stress: DMat3) -> f64 {
    let pressure = (stress.x_axis.x + stress.y_axis.y + stress.z_axis.z) / 3.0;
    let deviator = stress - DMat3::from_diagonal(DVec3::splat(pressure));
    let squares: f64 = deviator.to_cols_array().iter().map(|s| s * s).sum();
    (1.5 * squares).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equivalent_stress_of_tension_is_the_tension() {
        let tension = DMat3::from_diagonal(DVec3::new(3.0, 0.0, 0.0));
        assert!((von_mises_stress(tension) - 3.0).abs() < 1e-14, "tension");
        assert!(von_mises_stress(DMat3::IDENTITY * 7.0) < 1e-14, "pressure");
        // Pure shear: sqrt(3) times the shear stress.
        let shear = DMat3::from_cols(DVec3::Y, DVec3::X, DVec3::ZERO) * 2.0;
        let off = von_mises_stress(shear) - 12.0_f64.sqrt();
        assert!(off.abs() < 1e-14, "shear");
    }
}
