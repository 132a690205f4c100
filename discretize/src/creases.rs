//! Normals of a mesh that stands for a smooth surface with creases.

use glam::DVec3;

use crate::mesh::Mesh;

/// Faces whose normals differ by more than 40° (cosine) meet at a crease, the others are one smooth
/// surface.
const CREASE: f64 = 0.766;

/// Unit normals at the corners of all triangles: the mean of those faces at the vertex that no crease
/// parts from the triangle, weighted by their angles there (Thürmer and Wüthrich 1998).
pub(crate) fn corner_normals(mesh: &Mesh) -> Vec<[DVec3; 3]> {
    let count = mesh.triangles.len();
    let normals: Vec<DVec3> = (0..count)
        .map(|t| mesh.area_vector(t).normalize_or_zero())
        .collect();
    // Triangles with their angle, by vertex.
    let mut around: Vec<Vec<(usize, f64)>> = vec![Vec::new(); mesh.vertices.len()];
    for t in 0..count {
        let corners = mesh.corners(t);
        for k in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|step| corners[(k + step) % 3]);
            let angle = (b - a).angle_between(c - a);
            if angle.is_finite() {
                around[mesh.triangles[t][k] as usize].push((t, angle));
            }
        }
    }
    (0..count)
        .map(|t| {
            mesh.triangles[t].map(|vertex| {
                let near = around[vertex as usize].iter();
                let smooth = near.filter(|(other, _)| normals[*other].dot(normals[t]) > CREASE);
                let sum: DVec3 = smooth.map(|&(other, angle)| normals[other] * angle).sum();
                sum.normalize_or(normals[t])
            })
        })
        .collect()
}

/// The normal at a point of a triangle, interpolated between those at its corners.
pub(crate) fn interpolated(corners: [DVec3; 3], normals: [DVec3; 3], point: DVec3) -> DVec3 {
    let [a, b, c] = corners;
    let whole = (b - a).cross(c - a);
    let share = |p: DVec3, q: DVec3| (p - point).cross(q - point).dot(whole);
    let (u, v, w) = (share(b, c), share(c, a), share(a, b));
    (normals[0] * u + normals[1] * v + normals[2] * w).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Shape, Solid, surface_mesh};

    #[test]
    fn a_ball_of_facets_has_nearly_a_balls_normals_and_a_box_its_faces() {
        let ball = Shape::Ellipsoid {
            semi_axes: DVec3::ONE,
        };
        let solid = Solid::implicit(ball.bounds(), move |p| ball.value(p));
        let mesh = surface_mesh(&solid, 0.2).expect("it has a surface");
        let normals = corner_normals(&mesh);
        let (mut smooth, mut flat) = (0.0_f64, 0.0_f64);
        for (t, normals) in normals.iter().enumerate() {
            let corners = mesh.corners(t);
            for share in [[0.6, 0.3, 0.1], [0.1, 0.1, 0.8], [0.3, 0.4, 0.3]] {
                let at = corners
                    .iter()
                    .zip(share)
                    .map(|(&c, s)| c * s)
                    .sum::<DVec3>();
                let exact = at.normalize();
                smooth = smooth.max(interpolated(corners, *normals, at).distance(exact));
                flat = flat.max(mesh.area_vector(t).normalize().distance(exact));
            }
        }
        assert!(smooth < 0.35 * flat, "{smooth} instead of {flat}");
        let corner =
            |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
        let mut cube = Mesh {
            vertices: (0..8).map(corner).collect(),
            triangles: Vec::new(),
        };
        for [a, b, c, d] in testkit::cloud::BOX_FACES {
            cube.triangles.extend([[a, b, c], [a, c, d]]);
        }
        for (t, normals) in corner_normals(&cube).iter().enumerate() {
            let face = cube.area_vector(t).normalize();
            assert!(normals.iter().all(|n| n.distance(face) < 1e-15));
        }
    }
}
