//! How far a curved surface stands in front of triangles with corners on it.

use glam::DVec3;
use rayon::prelude::*;

use crate::sampling::Solid;

/// Largest bulge over its edge, `1 − √¾`: that of a sphere whose radius is as long. Triangles that cut off a crease are farther from
/// it, or face as one of its sides does.
const LARGEST: f64 = 0.134;

/// How far (m) the surface stands in front of the middles of the edges ab, bc and ca of triangles abc. Shape `(triangles, 3)`, along
/// their normals, negative in hollows, 0 at creases that triangles cut off. A surface of the curvature `κ` along an edge of the
/// length `l` has `κ l²/8`.
///
/// # Arguments
/// * `positions` -- corners on the surface (m), shape `(n)`.
///
/// # Panics
/// If a corner is not there.
#[must_use]
pub fn edge_bulges(solid: &Solid, positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<[f64; 3]> {
    let middles = Middles::new(solid, positions, triangles);
    let bulges = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|node| positions[node as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let lengths = [a.distance(b), b.distance(c), c.distance(a)];
        let offs = middles.of(*triangle);
        [0, 1, 2].map(|side| {
            let is_bulge = offs[side].length() <= LARGEST * lengths[side];
            if is_bulge {
                offs[side].dot(normal)
            } else {
                0.0
            }
        })
    };
    triangles.iter().map(bulges).collect()
}

fn sides([a, b, c]: [u32; 3]) -> [(u32, u32); 3] {
    [(a, b), (b, c), (c, a)].map(|(a, b)| (a.min(b), a.max(b)))
}

/// The ways from the middles of triangles' edges to the surface.
pub(crate) struct Middles {
    edges: Vec<(u32, u32)>,
    offs: Vec<DVec3>,
}

impl Middles {
    pub(crate) fn new(solid: &Solid, positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let mut edges: Vec<(u32, u32)> = triangles.iter().flat_map(|t| sides(*t)).collect();
        edges.sort_unstable();
        edges.dedup();
        let off = |&(a, b): &(u32, u32)| {
            let middle = positions[a as usize].midpoint(positions[b as usize]);
            solid.project(middle) - middle
        };
        let offs = edges.par_iter().map(off).collect();
        Self { edges, offs }
    }

    /// Those (m) of the edges ab, bc and ca of one of the triangles.
    pub(crate) fn of(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        sides(triangle).map(|edge| {
            let found = self.edges.binary_search(&edge);
            found.map_or(DVec3::ZERO, |edge| self.offs[edge])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::boundary_triangles;
    use crate::sampling::solid::Primitive;
    use crate::sampling::{SampleSettings, sample_tetrahedra};

    /// On a sphere all stand as far in front as the sphere does; across a box's edge none does.
    #[test]
    fn bulges_are_those_of_a_sphere() {
        let radius = 0.02;
        let sphere = Solid::from(Primitive::Ellipsoid {
            semi_axes: DVec3::splat(radius),
        });
        let found = sample_tetrahedra(&sphere, &SampleSettings::nodes(500)).unwrap();
        let triangles = boundary_triangles(&found.tetrahedra, |_| true);
        let bulges = edge_bulges(&sphere, &found.positions, &triangles);
        for (&[a, b, c], bulges) in triangles.iter().zip(&bulges) {
            let [a, b, c] = [a, b, c].map(|node| found.positions[node as usize]);
            let normal = (b - a).cross(c - a).normalize();
            for ((x, y), bulge) in [(a, b), (b, c), (c, a)].into_iter().zip(bulges) {
                let middle = x.midpoint(y);
                let expected = (radius - middle.length()) * middle.normalize().dot(normal);
                assert!((bulge - expected).abs() < 1e-9, "{bulge} m for {expected}");
                assert!(*bulge > 0.0, "in front");
            }
        }
        let edge = [(0.5, 0.0, 1.0), (0.5, 0.8, 1.0), (1.0, 0.4, 0.5)].map(DVec3::from);
        let cube = Solid::from(Primitive::Box {
            half_extents: DVec3::ONE,
        });
        let none = edge_bulges(&cube, &edge, &[[0, 2, 1]]);
        assert_eq!(none, [[0.0; 3]], "what a triangle cuts off of an edge");
    }
}
