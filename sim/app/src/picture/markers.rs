//! Points and lines as small solids, to look into a model.

use glam::{DVec3, Vec3};
use phyxel_splat::DrawnMesh;

/// Octahedra at points and thin prisms along lines, put together into one mesh.
#[derive(Debug, Default, Clone, PartialEq)]
pub(super) struct Markers {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Markers {
    fn triangle(&mut self, corners: [DVec3; 3]) {
        let first = u32::try_from(self.vertices.len()).expect("fewer than 2^32 corners");
        self.vertices.extend(corners);
        self.triangles.push([first, first + 1, first + 2]);
    }

    /// Adds an octahedron whose corners lie `radius` (m) from its middle (m).
    pub(super) fn point(&mut self, at: DVec3, radius: f64) {
        for x in [-radius, radius] {
            for y in [-radius, radius] {
                for z in [-radius, radius] {
                    self.triangle([at + x * DVec3::X, at + y * DVec3::Y, at + z * DVec3::Z]);
                }
            }
        }
    }

    /// Adds a prism of three sides, its edges `radius` (m) from the line between two points (m), without ends;
    /// nothing where they coincide.
    pub(super) fn line(&mut self, from: DVec3, to: DVec3, radius: f64) {
        let Some(axis) = (to - from).try_normalize() else {
            return;
        };
        let (a, b) = axis.any_orthonormal_pair();
        let out = [0.0_f64, 120.0, 240.0].map(|angle| {
            let (sin, cos) = angle.to_radians().sin_cos();
            radius * (a * cos + b * sin)
        });
        for k in 0..3 {
            let (p, q) = (out[k], out[(k + 1) % 3]);
            self.triangle([from + p, from + q, to + p]);
            self.triangle([to + p, from + q, to + q]);
        }
    }

    /// The mesh of them, without gloss.
    pub(super) fn colored(self, color: Vec3) -> DrawnMesh {
        DrawnMesh {
            color,
            specular: 0.0,
            ..DrawnMesh::metal(self.vertices, self.triangles)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_and_lines_have_the_radius_asked() {
        let mut markers = Markers::default();
        markers.point(DVec3::X, 0.1);
        markers.line(DVec3::ZERO, DVec3::ZERO, 0.1);
        let point = markers.clone().colored(Vec3::ONE);
        assert_eq!(point.triangles.len(), 8, "an octahedron and no line");
        let off = |x: &DVec3, middle: DVec3| (x.distance(middle) - 0.1).abs() < 1e-15;
        assert!(point.vertices.iter().all(|x| off(x, DVec3::X)));
        let mut markers = Markers::default();
        markers.line(DVec3::ZERO, DVec3::Z, 0.1);
        let line = markers.colored(Vec3::ONE);
        assert_eq!(line.triangles.len(), 6, "three sides");
        assert!(line.vertices.iter().all(|x| off(x, DVec3::Z * x.z)));
        // Their sides, of a triangle of circumradius r: 3 sqrt(3) r / 2 in all.
        let sides: f64 = (line.triangles.iter())
            .map(|t| {
                let [a, b, c] = t.map(|k| line.vertices[k as usize]);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum();
        let expected = 3.0 * 3.0_f64.sqrt() * 0.1;
        assert!((sides - expected).abs() < 1e-12, "{sides} m²");
    }
}
