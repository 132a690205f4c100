//! Boundary area vectors of a cloud without a mesh of its own.

use glam::DVec3;
use rayon::prelude::*;

use crate::basis::{Basis, Dimension, Order};
use crate::error::BoundaryError;
use crate::kernel::Kernel;
use crate::parallel::ROWS_PER_TASK;
use crate::search::PointTree;
use crate::shape::{Approximation, ShapeScratch};

/// How [`boundary_vectors`] spreads the surface over the nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BoundarySettings {
    /// Support radius tried first (m); about twice the node spacing.
    pub radius: f64,
    /// Growth of the radius where the support is not well posed.
    pub growth: f64,
    /// Most times the radius grows at one point.
    pub growth_limit: usize,
    /// Largest condition number accepted of the scaled moment matrix.
    pub largest_condition: f64,
}

impl BoundarySettings {
    /// Settings for a cloud of about this spacing (m): radius twice the spacing, growing by 1.25 up
    /// to 8 times, condition at most 250.
    #[must_use]
    pub fn for_spacing(spacing: f64) -> Self {
        Self {
            radius: 2.0 * spacing,
            growth: 1.25,
            growth_limit: 8,
            largest_condition: 250.0,
        }
    }
}

/// Boundary vectors `b_i = Σ_q φ_i(x_q) n_q a_q` from quadrature points of a closed surface, with
/// linear moving-least-squares shape functions φ.
///
/// `Σ_i b_i = Σ_q n_q a_q = 0` and `Σ_i b_i ⊗ X_i = Σ_q n_q a_q ⊗ x_q = V I` follow from linear
/// reproduction for any rule that integrates linear functions over each triangle, which makes the
/// vectors fit for [`crate::ConservativeStencils::new`] with any positive volumes of that sum.
///
/// # Arguments
/// * `nodes` -- node positions (m), shape `(n)`.
/// * `points` -- quadrature points on the surface (m), `area_vectors` -- outward normal times area
///   (m²), same shape; see [`triangle_quadrature`].
///
/// # Errors
/// [`BoundaryError`] naming the first quadrature point that is not finite or that no radius up to
/// the limit served, or why the nodes cannot be searched.
///
/// # Panics
/// If `points` and `area_vectors` differ in length.
///
/// # Numerics
/// A support whose condition exceeds the limit is enlarged: an ill-posed φ is large and of both
/// signs and spoils the stencils.
pub fn boundary_vectors(
    nodes: &[DVec3],
    points: &[DVec3],
    area_vectors: &[DVec3],
    settings: &BoundarySettings,
) -> Result<Vec<DVec3>, BoundaryError> {
    assert_eq!(
        points.len(),
        area_vectors.len(),
        "one area vector per quadrature point"
    );
    let finite = |(x, a): (&DVec3, &DVec3)| x.is_finite() && a.is_finite();
    if let Some(point) = points
        .iter()
        .zip(area_vectors)
        .position(|pair| !finite(pair))
    {
        return Err(BoundaryError::NotFinite { point });
    }
    crate::search::positive("the support radius", settings.radius)?;
    crate::search::positive("the growth of the radius", settings.growth)?;
    let tree = PointTree::new(nodes)?;
    let found: Vec<Result<Vec<(u32, f64)>, BoundaryError>> = points
        .par_iter()
        .enumerate()
        .with_min_len(ROWS_PER_TASK)
        .map_init(ShapeScratch::default, |scratch, (point, &x)| {
            spread(&tree, nodes, x, settings, scratch)
                .map_err(|radius| BoundaryError::Unsupported { point, radius })
        })
        .collect();
    let mut vectors = vec![DVec3::ZERO; nodes.len()];
    for (part, area) in found.into_iter().zip(area_vectors) {
        for (node, phi) in part? {
            vectors[node as usize] += *area * phi;
        }
    }
    Ok(vectors)
}

/// Shape functions at one point; the largest radius tried where none was well posed.
fn spread(
    tree: &PointTree,
    nodes: &[DVec3],
    x: DVec3,
    settings: &BoundarySettings,
    scratch: &mut ShapeScratch,
) -> Result<Vec<(u32, f64)>, f64> {
    let mut radius = settings.radius;
    let mut neighbors = Vec::new();
    let mut phi = Vec::new();
    for _ in 0..=settings.growth_limit {
        neighbors.clear();
        neighbors.extend(tree.within(x, radius));
        neighbors.sort_unstable();
        let local: Vec<DVec3> = neighbors.iter().map(|&node| nodes[node as usize]).collect();
        let all: Vec<u32> = (0..).take(local.len()).collect();
        phi.clear();
        phi.resize(local.len(), 0.0);
        let approximation = Approximation {
            nodes: &local,
            support_radii: &vec![radius; local.len()],
            basis: Basis::polynomial(Order::Linear, Dimension::Three),
            kernel: Kernel::Polynomial,
        };
        let made = approximation.shape_values_into(x, &all, scratch, &mut phi);
        if made.is_ok_and(|condition| condition <= settings.largest_condition) {
            return Ok(neighbors.into_iter().zip(phi).collect());
        }
        radius *= settings.growth;
    }
    Err(radius / settings.growth)
}

/// Quadrature points of triangles: each is cut into `subdivisions²` equal ones with their
/// centroids, exact for linear functions. Returns points (m) and area vectors (m²), outward if the
/// triangles turn anticlockwise seen from outside.
///
/// # Panics
/// If `subdivisions` is 0 or a vertex index is out of range.
#[must_use]
#[allow(clippy::cast_precision_loss, reason = "subdivisions are few")]
pub fn triangle_quadrature(
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    subdivisions: usize,
) -> (Vec<DVec3>, Vec<DVec3>) {
    assert!(
        subdivisions > 0,
        "a triangle has at least one quadrature point"
    );
    let m = subdivisions;
    let mut points = Vec::with_capacity(triangles.len() * m * m);
    let mut areas = Vec::with_capacity(triangles.len() * m * m);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| vertices[v as usize]);
        let (along, across) = ((b - a) / m as f64, (c - a) / m as f64);
        let area = along.cross(across) * 0.5;
        for i in 0..m {
            for j in 0..m - i {
                let corner = a + along * i as f64 + across * j as f64;
                points.push(corner + (along + across) / 3.0);
                areas.push(area);
                if i + j + 1 < m {
                    points.push(corner + (along + across) * (2.0 / 3.0));
                    areas.push(area);
                }
            }
        }
    }
    (points, areas)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conservative::{ConservativeSettings, ConservativeStencils};
    use crate::search::{NearestSettings, k_nearest};
    use crate::symmetric::outer;
    use crate::weights::inverse_square_weights;
    use glam::DMat3;
    use testkit::cloud;
    use testkit::kuhn::kuhn_block;
    use testkit::tol::{assert_below, assert_within};

    #[test]
    fn moments_of_the_surface_survive_and_stencils_become_conservative() {
        // Nodes at cell centres, all inside the surface; volumes any positive partition.
        let n = 6;
        let block = kuhn_block([n; 3], 1.0, 0.0, 1);
        for jitter in [0.0, 0.2] {
            let nodes: Vec<DVec3> = cloud::lattice([n; 3], 1.0, jitter, 7)
                .iter()
                .map(|&x| x + DVec3::splat(0.5))
                .collect();
            let (points, areas) = triangle_quadrature(&block.positions, &block.surface, 2);
            let settings = BoundarySettings::for_spacing(1.0);
            let b = boundary_vectors(&nodes, &points, &areas, &settings).unwrap();
            let sum: DVec3 = b.iter().copied().sum();
            assert_below("closed surface", sum.length(), 1e-12);
            let mut moment = DMat3::ZERO;
            for (b, &x) in b.iter().zip(&nodes) {
                moment += outer(*b, x);
            }
            let volume = 216.0;
            let error = (moment - DMat3::IDENTITY * volume).to_cols_array();
            assert_below(
                "V I",
                error.iter().fold(0.0_f64, |m, e| m.max(e.abs())),
                1e-11,
            );
            let nearest = NearestSettings {
                nearest: 18,
                scale: 3.0,
                limit: Some(18),
            };
            let found = k_nearest(&nodes, &nearest).unwrap();
            let graph = found.neighborhoods.symmetrized().unwrap();
            let weights = inverse_square_weights(&nodes, &graph);
            let solved = ConservativeStencils::new(
                &nodes,
                &vec![1.0; nodes.len()],
                &b,
                &graph,
                weights,
                &ConservativeSettings::default(),
            )
            .unwrap();
            assert!(solved.report.converged, "{:?}", solved.report);
            assert_below("shift", solved.report.boundary_shift, 1e-13);
        }
    }

    #[test]
    fn quadrature_is_exact_for_linear_functions() {
        let vertices = [
            DVec3::ZERO,
            DVec3::new(2.0, 0.5, 0.0),
            DVec3::new(0.3, 1.0, 1.0),
        ];
        let area = (vertices[1] - vertices[0]).cross(vertices[2] - vertices[0]) * 0.5;
        let centre = (vertices[0] + vertices[1] + vertices[2]) / 3.0;
        for subdivisions in 1..5 {
            let (points, areas) = triangle_quadrature(&vertices, &[[0, 1, 2]], subdivisions);
            assert_eq!(points.len(), subdivisions * subdivisions);
            let total: DVec3 = areas.iter().copied().sum();
            assert_within("area", (total - area).length(), 0.0, 1e-15);
            let first: DVec3 = points
                .iter()
                .zip(&areas)
                .map(|(&x, a)| x * a.length())
                .sum();
            assert_within(
                "moment",
                (first / area.length() - centre).length(),
                0.0,
                1e-15,
            );
        }
    }

    #[test]
    fn every_error_is_named() {
        let nodes = cloud::lattice([3, 3, 1], 1.0, 0.0, 1);
        let settings = BoundarySettings::for_spacing(1.0);
        let at = |nodes: &[DVec3], x: DVec3, settings: &BoundarySettings| {
            boundary_vectors(nodes, &[x], &[DVec3::Z], settings).unwrap_err()
        };
        let plane = at(&nodes, DVec3::ONE, &settings);
        assert!(
            matches!(plane, BoundaryError::Unsupported { point: 0, .. }),
            "{plane}"
        );
        let none = at(&nodes, DVec3::NAN, &settings);
        assert_eq!(none, BoundaryError::NotFinite { point: 0 });
        let flat = BoundarySettings {
            radius: 0.0,
            ..settings
        };
        assert!(matches!(
            at(&nodes, DVec3::ONE, &flat),
            BoundaryError::Cloud(_)
        ));
    }
}
