//! Nodal masses, densities and volumes as the dissertation assigns them.

use glam::DVec3;

use crate::basis::Dimension;
use crate::kernel::Kernel;
use crate::neighborhoods::Neighborhoods;

/// Masses, densities and volumes of nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalMasses {
    /// Scaling factor s of eq. (17), chosen so that the mean of the densities is the material's.
    pub scale: f64,
    /// `m_i = s r̄_i³ ρ` (kg), shape `(n)`.
    pub masses: Vec<f64>,
    /// `ρ_i = Σ_j m_j w_ij` (kg/m³), shape `(n)`.
    pub densities: Vec<f64>,
    /// `v_i = m_i / ρ_i` (m³), shape `(n)`.
    pub volumes: Vec<f64>,
}

/// Masses, densities and volumes of Aras 2014, eqs. (17)–(18): the comparison mode.
///
/// The kernel is normalised to unit integral (eq. (18) as printed has the unit of a mass), the sum
/// runs over the node itself and its neighbours, and s is the value for which the densities average
/// to `density`. **The volumes do not add up to the body's**: nodes at the surface get as much as
/// nodes inside, so the sum is 1.3 to 2.2 times too large. Use true volumes for mechanics.
///
/// # Arguments
/// * `mean_distances` -- r̄ (m), `support_radii` -- h (m), shape `(n)`; see [`crate::k_nearest`].
/// * `density` -- ρ of the material (kg/m³).
///
/// A node that no neighbour and no support of its own reaches (radius 0) gets mass and volume 0.
///
/// # Panics
/// If a slice does not have its stated length.
#[must_use]
#[allow(clippy::cast_precision_loss, reason = "node counts are far below 2^53")]
pub fn dissertation_masses(
    positions: &[DVec3],
    neighborhoods: &Neighborhoods,
    mean_distances: &[f64],
    support_radii: &[f64],
    density: f64,
) -> NodalMasses {
    let count = neighborhoods.node_count();
    assert_eq!(positions.len(), count, "one position per node");
    assert_eq!(mean_distances.len(), count, "one mean distance per node");
    assert_eq!(support_radii.len(), count, "one radius per node");
    let integral = Kernel::Polynomial.integral(Dimension::Three).unwrap_or(1.0);
    let cubes: Vec<f64> = mean_distances.iter().map(|r| r * r * r * density).collect();
    let term = |i: usize, j: usize| {
        let h = support_radii[j];
        if h > 0.0 {
            let q = (positions[j] - positions[i]).length() / h;
            cubes[j] * Kernel::Polynomial.value(q) / (integral * h * h * h)
        } else {
            0.0
        }
    };
    let unscaled: Vec<f64> = (0..count)
        .map(|i| {
            let own = term(i, i);
            let row = neighborhoods.row(i);
            own + row.iter().map(|&j| term(i, j as usize)).sum::<f64>()
        })
        .collect();
    let mean = unscaled.iter().sum::<f64>() / count.max(1) as f64;
    let scale = if mean > 0.0 { density / mean } else { 0.0 };
    let masses: Vec<f64> = cubes.iter().map(|m| m * scale).collect();
    let densities: Vec<f64> = unscaled.iter().map(|d| d * scale).collect();
    let volume = |(m, d): (&f64, &f64)| if *d > 0.0 { m / d } else { 0.0 };
    let volumes = masses.iter().zip(&densities).map(volume).collect();
    NodalMasses {
        scale,
        masses,
        densities,
        volumes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::{NearestSettings, k_nearest};
    use testkit::cloud;
    use testkit::tol::{assert_relative, assert_within};

    #[test]
    fn mean_density_is_the_materials_and_volumes_are_too_large() {
        let n = 10;
        let spacing = 1.0 / f64::from(n - 1);
        let count = usize::try_from(n).unwrap();
        let points = cloud::lattice([count; 3], spacing, 0.0, 0);
        let found = k_nearest(&points, &NearestSettings::default()).unwrap();
        let made = dissertation_masses(
            &points,
            &found.neighborhoods,
            &found.mean_distances,
            &found.support_radii,
            1060.0,
        );
        let mean = made.densities.iter().sum::<f64>() / points.len() as f64;
        assert_relative("mean density", mean, 1060.0, 0.0, 1e-12);
        for i in 0..points.len() {
            let product = made.volumes[i] * made.densities[i];
            assert_relative("m = ρ v", product, made.masses[i], 0.0, 1e-14);
            let cube = found.mean_distances[i].powi(3) * 1060.0 * made.scale;
            assert_relative("eq. 17", made.masses[i], cube, 0.0, 1e-14);
        }
        // The body has the volume 1; what eqs. (17)–(18) make of it is known to be far more.
        let sum: f64 = made.volumes.iter().sum();
        assert_within("volume of the cube of 1,000 nodes", sum, 1.7, 0.15);
    }

    #[test]
    fn a_coincident_cluster_has_no_mass() {
        let mut points = vec![DVec3::ZERO; 20];
        points.extend(cloud::uniform(60, 1.0, 2));
        let found = k_nearest(&points, &NearestSettings::default()).unwrap();
        let made = dissertation_masses(
            &points,
            &found.neighborhoods,
            &found.mean_distances,
            &found.support_radii,
            1000.0,
        );
        assert!(
            made.volumes
                .iter()
                .chain(&made.densities)
                .all(|v| v.is_finite())
        );
        assert_within("radius 0", made.masses[3], 0.0, 0.0);
    }
}
