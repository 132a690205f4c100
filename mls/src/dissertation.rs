//! The dissertation's discretisation of a cloud, whole: neighbours, weights, stencils, masses.

use glam::DVec3;

use crate::error::StencilError;
use crate::kernel::Kernel;
use crate::masses::{NodalMasses, dissertation_masses};
use crate::neighborhoods::Neighborhoods;
use crate::search::KNearest;
use crate::stencil::GradientStencils;
use crate::weights::kernel_weights;

/// A cloud as Aras 2014, 2.3 and 2.4, discretises it: for comparison.
#[derive(Debug, Clone)]
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
/// * `rank_tolerance` -- as [`GradientStencils::new`] has it.
///
/// # Errors
/// [`StencilError`] for points that are not finite.
///
/// # Panics
/// If `near` is not of these points.
///
/// # Examples
/// ```
/// use glam::DVec3;
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
    let KNearest {
        neighborhoods: one_way,
        support_radii,
        mean_distances,
    } = near;
    let neighborhoods = one_way.symmetrized()?;
    let mut weights = kernel_weights(Kernel::Polynomial, points, support_radii, &neighborhoods);
    for node in 0..points.len() {
        for (pair, &other) in neighborhoods.pairs(node).zip(neighborhoods.row(node)) {
            if one_way.find_pair(node, other).is_none() {
                weights[pair] = 0.0;
            }
        }
    }
    Ok(DissertationCloud {
        stencils: GradientStencils::new(points, &neighborhoods, weights, rank_tolerance)?,
        masses: dissertation_masses(points, one_way, mean_distances, support_radii, density),
        neighborhoods,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::{NearestSettings, k_nearest};
    use glam::DMat3;

    /// Pairs that are none in one direction change nothing: the stencils are those of the neighbours
    /// that a node looks for, and a linear field is exact.
    #[test]
    fn one_way_pairs_are_those_of_the_search() {
        let jitter =
            |k: u32| 0.3 * f64::from(k.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
        let points: Vec<DVec3> = (0..343_u32)
            .map(|k| {
                let at = DVec3::new(f64::from(k % 7), f64::from(k / 7 % 7), f64::from(k / 49));
                at + DVec3::new(jitter(k), jitter(k + 500), jitter(k + 1_000))
            })
            .collect();
        let near = k_nearest(&points, &NearestSettings::default()).unwrap();
        let cloud = dissertation_cloud(&points, &near, 1000.0, 1e-3).unwrap();
        let one_way = &near.neighborhoods;
        let weights = kernel_weights(Kernel::Polynomial, &points, &near.support_radii, one_way);
        // The kernel is 0 at a neighbour that is looked for and lies outside of the support.
        let weighted = weights.iter().filter(|weight| **weight > 0.0).count();
        let alone = GradientStencils::new(&points, one_way, weights, 1e-3).unwrap();
        let map = DMat3::from_cols_array(&[0.1, 0.7, -0.3, 0.2, -0.4, 0.9, 0.5, 0.6, -0.8]);
        let (mut seen, mut both) = (0, 0);
        for node in 0..points.len() {
            let mut slopes = [DMat3::ZERO; 2];
            for (slope, (graph, stencils)) in slopes
                .iter_mut()
                .zip([(&cloud.neighborhoods, &cloud.stencils), (one_way, &alone)])
            {
                for (pair, &other) in graph.pairs(node).zip(graph.row(node)) {
                    let way = map * (points[other as usize] - points[node]);
                    let [x, y, z] = stencils.pair_gradients[pair].to_array();
                    *slope += DMat3::from_cols(way * x, way * y, way * z);
                }
            }
            assert_eq!(slopes[0], slopes[1], "node {node}");
            assert!(
                slopes[0].abs_diff_eq(map, 1e-12),
                "node {node}: {}",
                slopes[0]
            );
            let row = &cloud.stencils.weights[cloud.neighborhoods.pairs(node)];
            seen += row.iter().filter(|weight| **weight > 0.0).count();
            both += row.len();
        }
        assert_eq!(seen, weighted);
        assert!(both > seen, "some pairs are one-way: {both}, {seen}");
    }
}
