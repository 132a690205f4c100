//! Normals of a mesh that stands for a smooth surface with creases.

use glam::DVec3;

use crate::mesh::{Hierarchy, Mesh};

/// Faces whose normals differ by more than 40° (cosine) meet at a crease, the others are one smooth
/// surface.
const CREASE: f64 = 0.766;

/// A mesh as a smooth surface with creases.
pub(crate) struct Creased<'a> {
    mesh: &'a Mesh,
    hierarchy: &'a Hierarchy,
    corner_normals: Vec<[DVec3; 3]>,
}

impl<'a> Creased<'a> {
    pub(crate) fn new(mesh: &'a Mesh, hierarchy: &'a Hierarchy) -> Self {
        Self {
            mesh,
            hierarchy,
            corner_normals: corner_normals(mesh),
        }
    }

    /// The unit normal where the surface is closest to `p`, interpolated between those at the corners of
    /// the triangle; zero for an empty or degenerate one.
    pub(crate) fn normal(&self, p: DVec3) -> DVec3 {
        self.hierarchy.closest(p).map_or(DVec3::ZERO, |closest| {
            let triangle = closest.triangle as usize;
            let corners = self.mesh.corners(triangle);
            interpolated(corners, self.corner_normals[triangle], closest.point)
        })
    }
}

/// Unit normals at the corners of all triangles: the mean of those faces at the vertex that no crease
/// parts from the triangle, weighted by their angles there (Thürmer and Wüthrich 1998).
fn corner_normals(mesh: &Mesh) -> Vec<[DVec3; 3]> {
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
fn interpolated(corners: [DVec3; 3], normals: [DVec3; 3], point: DVec3) -> DVec3 {
    let [a, b, c] = corners;
    let whole = (b - a).cross(c - a);
    let share = |p: DVec3, q: DVec3| (p - point).cross(q - point).dot(whole);
    let (u, v, w) = (share(b, c), share(c, a), share(a, b));
    (normals[0] * u + normals[1] * v + normals[2] * w).normalize_or_zero()
}
