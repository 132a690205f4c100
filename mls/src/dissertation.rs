//! The dissertation's discretisation of a cloud, whole: neighbours, weights, stencils, masses.

use glam::DVec3;

use crate::{GradientStencils, KNearest, Neighborhoods, StencilError, kernel, kernel_weights};

/// A cloud as Aras 2014, 2.3 and 2.4, discretises it: for comparison.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct DissertationCloud {
    /// Who is a neighbour of whom or has it as a neighbour: every pair both ways, so that cuts find it.
    pub neighborhoods: Neighborhoods,
    /// Plain moving least squares, eqs. (25)-(27). A weight is 0 in the direction in which a pair is none:
    /// node i sees at most as many neighbours as the settings say, though more may see it.
    pub stencils: GradientStencils,
    /// Masses and volumes, eqs. (17) and (18).
    pub masses: NodalMasses,
}

/// Neighbours, kernel weights, stencils and masses of a cloud by Aras 2014, eqs. (15)-(18) and (25)-(27).
///
/// # Arguments
/// * `points` -- rest positions (m), shape `(n)`.
/// * `near` -- what [`crate::k_nearest`] finds by its default, the dissertation's: 16 nearest, at most 16
///   neighbours.
/// * `density` -- of the material (kg/m³).
/// * `rank_tolerance` -- as [`GradientStencils::plain`] has it.
///
/// # Errors
/// [`StencilError`] for points that are not finite, or where `near` is of another number of points.
///
/// # Examples
/// ```
/// use phyxel_mls::glam::DVec3;
/// use phyxel_mls::{NearestSettings, dissertation_cloud, k_nearest};
///
/// let points: Vec<DVec3> = (0..64)
///     .map(|k| DVec3::new(f64::from(k % 4), f64::from(k / 4 % 4), f64::from(k / 16)))
///     .collect();
/// let near = k_nearest(&points, &NearestSettings::default())?;
/// let cloud = dissertation_cloud(&points, &near, 1000.0, 1e-3)?;
/// let seen = |node: usize| {
///     let row = &cloud.stencils.weights[cloud.neighborhoods.pairs(node)];
///     row.iter().filter(|weight| **weight > 0.0).count()
/// };
/// assert!((0..64).all(|node| seen(node) <= 16));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn dissertation_cloud(
    points: &[DVec3],
    near: &KNearest,
    density: f64,
    rank_tolerance: f64,
) -> Result<DissertationCloud, StencilError> {
    let one_way = &near.neighborhoods;
    one_way.check_nodes("positions", points.len())?;
    let neighborhoods = one_way.symmetrized()?;
    let mut weights = kernel_weights(points, &near.support_radii, &neighborhoods);
    for node in 0..points.len() {
        for (pair, &other) in neighborhoods.pairs(node).zip(neighborhoods.row(node)) {
            if one_way.find_pair(node, other).is_none() {
                weights[pair] = 0.0;
            }
        }
    }
    Ok(DissertationCloud {
        stencils: GradientStencils::plain(points, &neighborhoods, weights, rank_tolerance)?,
        masses: masses(points, near, density),
        neighborhoods,
    })
}

/// Integral of the kernel over its support of radius 1.
const INTEGRAL: f64 = 64.0 * std::f64::consts::PI / 315.0;

/// Masses, densities and volumes of nodes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
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
/// A node that no neighbour and no support of its own reaches (radius 0) gets mass and volume 0.
fn masses(positions: &[DVec3], near: &KNearest, density: f64) -> NodalMasses {
    let KNearest {
        neighborhoods,
        support_radii,
        mean_distances,
    } = near;
    let count = neighborhoods.node_count();
    let cubes: Vec<f64> = mean_distances.iter().map(|r| r * r * r * density).collect();
    let term = |i: usize, j: usize| {
        let h = support_radii[j];
        if h > 0.0 {
            let q = (positions[j] - positions[i]).length() / h;
            cubes[j] * kernel(q) / (INTEGRAL * h * h * h)
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
    use crate::symmetric::outer;
    use glam::DMat3;
    use testkit::cloud;
    use testkit::tol::{assert_relative, assert_within};

    /// Pairs that are none in one direction change nothing: the stencils are those of the neighbours
    /// that a node looks for, and a linear field is exact.
    #[test]
    fn one_way_pairs_are_those_of_the_search() {
        let points = cloud::lattice([7; 3], 1.0, 0.15, 3);
        let near = k_nearest(&points, &NearestSettings::default()).unwrap();
        let made = dissertation_cloud(&points, &near, 1000.0, 1e-3).unwrap();
        let one_way = &near.neighborhoods;
        let weights = kernel_weights(&points, &near.support_radii, one_way);
        // The kernel is 0 at a neighbour that is looked for and lies outside of the support.
        let weighted = weights.iter().filter(|weight| **weight > 0.0).count();
        let alone = GradientStencils::plain(&points, one_way, weights, 1e-3).unwrap();
        let both_ways = [(&made.neighborhoods, &made.stencils), (one_way, &alone)]
            .map(|(graph, s)| (graph, s.pair_gradients(&points, graph)));
        let map = DMat3::from_cols_array(&[0.1, 0.7, -0.3, 0.2, -0.4, 0.9, 0.5, 0.6, -0.8]);
        let (mut seen, mut both) = (0, 0);
        for node in 0..points.len() {
            let mut slopes = [DMat3::ZERO; 2];
            for (slope, (graph, gradients)) in slopes.iter_mut().zip(&both_ways) {
                for (pair, &other) in graph.pairs(node).zip(graph.row(node)) {
                    let way = map * (points[other as usize] - points[node]);
                    *slope += outer(way, gradients[pair]);
                }
            }
            assert_eq!(slopes[0], slopes[1], "node {node}");
            let slope = slopes[0];
            assert!(slope.abs_diff_eq(map, 1e-12), "node {node}: {slope}");
            let row = &made.stencils.weights[made.neighborhoods.pairs(node)];
            seen += row.iter().filter(|weight| **weight > 0.0).count();
            both += row.len();
        }
        assert_eq!(seen, weighted);
        assert!(both > seen, "some pairs are one-way: {both}, {seen}");
    }

    #[test]
    fn mean_density_is_the_materials_and_volumes_are_too_large() {
        let n = 10;
        let spacing = 1.0 / f64::from(n - 1);
        let count = usize::try_from(n).unwrap();
        let points = cloud::lattice([count; 3], spacing, 0.0, 0);
        let found = k_nearest(&points, &NearestSettings::default()).unwrap();
        let made = masses(&points, &found, 1060.0);
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
        let made = masses(&points, &found, 1000.0);
        let mut all = made.volumes.iter().chain(&made.densities);
        assert!(all.all(|v| v.is_finite()));
        assert_within("radius 0", made.masses[3], 0.0, 0.0);
    }
}
