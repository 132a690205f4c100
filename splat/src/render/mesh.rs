//! Rigid things drawn beside the splats: triangle meshes with a colour.

use crate::cast::count;
use glam::{DQuat, DVec3, Vec3};

/// Triangles with one colour, world frame. Both faces are drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnMesh {
    /// Vertices (m).
    pub vertices: Vec<DVec3>,
    /// Vertex indices per triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Linear colour.
    pub color: Vec3,
    /// Strength of the highlight (1).
    pub specular: f32,
    /// Exponent of the highlight (1).
    pub shininess: f32,
    /// Light each triangle by the mean of its vertices' normals (round things), not by its own (flat faces).
    pub smooth: bool,
}

/// Sides of round tools.
const SIDES: usize = 24;

impl DrawnMesh {
    /// A mesh of metal.
    #[must_use]
    pub fn metal(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        Self {
            vertices,
            triangles,
            color: Vec3::new(0.34, 0.36, 0.39),
            specular: 0.9,
            shininess: 40.0,
            smooth: false,
        }
    }

    /// A capsule between two points; a sphere if they coincide.
    #[must_use]
    pub fn capsule(from: DVec3, to: DVec3, radius: f64) -> Self {
        let axis = (to - from).try_normalize().unwrap_or(DVec3::Z);
        let (a, b) = axis.any_orthonormal_pair();
        let rings = SIDES / 4;
        let mut vertices = Vec::new();
        for (centre, sign) in [(from, -1.0), (to, 1.0)] {
            for k in 0..=rings {
                // From the pole of the first cap to the pole of the second.
                let k = if sign < 0.0 { rings - k } else { k };
                let latitude = k as f64 / rings as f64 * std::f64::consts::FRAC_PI_2;
                for s in 0..SIDES {
                    let turn = s as f64 / SIDES as f64 * std::f64::consts::TAU;
                    let out = (a * turn.cos() + b * turn.sin()) * latitude.cos()
                        + axis * (sign * latitude.sin());
                    vertices.push(centre + out * radius);
                }
            }
        }
        let mut triangles = Vec::new();
        for ring in 0..2 * rings + 1 {
            for s in 0..SIDES {
                let (i, j) = (ring * SIDES + s, ring * SIDES + (s + 1) % SIDES);
                let [i0, j0, i1, j1] = [i, j, i + SIDES, j + SIDES].map(count);
                triangles.push([i0, j0, j1]);
                triangles.push([i0, j1, i1]);
            }
        }
        Self {
            smooth: true,
            ..Self::metal(vertices, triangles)
        }
    }

    /// A box about a centre (m), `half` its half edge lengths (m) along the axes of a frame that `rotation` turns into
    /// the world's.
    #[must_use]
    pub fn cuboid(center: DVec3, rotation: DQuat, half: DVec3) -> Self {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
                let first = count(vertices.len());
                // Counter-clockwise seen from outside; every face has its own corners and normals.
                for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                    let corner = DVec3::AXES[axis] * side + u * (a * side) + v * b;
                    vertices.push(center + rotation * (corner * half));
                }
                triangles.extend([[0, 1, 2], [0, 2, 3]].map(|face| face.map(|k| first + k)));
            }
        }
        Self::metal(vertices, triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume (m³) that a closed mesh's triangles enclose, positive if they face outwards.
    fn volume(mesh: &DrawnMesh) -> f64 {
        let volume = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|k| mesh.vertices[k as usize]);
            a.dot(b.cross(c)) / 6.0
        };
        mesh.triangles.iter().map(volume).sum()
    }

    #[test]
    fn a_turned_box_faces_outwards_and_has_its_volume() {
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 2.0) / 3.0, 0.7);
        let mesh = DrawnMesh::cuboid(DVec3::new(0.3, -1.0, 2.0), turn, DVec3::new(1.0, 2.0, 0.5));
        assert!((volume(&mesh) - 8.0).abs() < 1e-12, "{} m³", volume(&mesh));
    }
}
