//! Rigid things drawn beside the splats: triangle meshes with a colour.

use crate::cast::{count, real};
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
    /// Interpolate normals over vertices (round things) or not (flat faces).
    pub smooth: bool,
}

/// Sides of round tools.
const SIDES: usize = 24;
/// Width of a knife over its edge's length, and its largest value (m).
const KNIFE_WIDTH: f64 = 0.16;
const LARGEST_KNIFE_WIDTH: f64 = 0.011;
/// Half the thickness of a knife's spine over its width.
const HALF_THICKNESS: f64 = 0.05;

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
                let latitude = real(k) / real(rings) * std::f64::consts::FRAC_PI_2;
                for s in 0..SIDES {
                    let turn = real(s) / real(SIDES) * std::f64::consts::TAU;
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

    /// A knife along a cutting edge: a wedge behind it, slanted at its first point, and a handle at its last.
    ///
    /// # Arguments
    /// * `edge` -- corners of the cutting edge (m), at least two.
    /// * `ahead` -- where it cuts to, any length: the spine lies on the other side.
    ///
    /// # Returns
    /// The wedge and the handle; nothing for an edge without points.
    #[must_use]
    pub fn knife(edge: &[DVec3], ahead: DVec3) -> Vec<Self> {
        let (Some(&tip), Some(&heel)) = (edge.first(), edge.last()) else {
            return Vec::new();
        };
        let length = tip.distance(heel);
        let along = (heel - tip).normalize_or(DVec3::Z);
        let back = -(ahead - along * ahead.dot(along))
            .try_normalize()
            .unwrap_or_else(|| along.any_orthonormal_vector());
        let side = along.cross(back);
        let width = (KNIFE_WIDTH * length).min(LARGEST_KNIFE_WIDTH);
        let half = HALF_THICKNESS * width;
        // Cross-section at each point of the edge: sharp in front, thick at the spine; the tip slants.
        let mut vertices = Vec::new();
        for (index, &point) in edge.iter().enumerate() {
            let slant = if index == 0 {
                along * width
            } else {
                DVec3::ZERO
            };
            let spine = point + back * width + slant;
            vertices.extend([point, spine + side * half, spine - side * half]);
        }
        let mut triangles = Vec::new();
        let rows = count(edge.len());
        for row in 0..rows - 1 {
            for k in 0..3 {
                let (a, b) = (3 * row + k, 3 * row + (k + 1) % 3);
                triangles.extend([[a, b, a + 3], [b, b + 3, a + 3]]);
            }
        }
        let last = 3 * (rows - 1);
        triangles.extend([[0, 1, 2], [last, last + 2, last + 1]]);
        let grip = heel + back * (0.5 * width);
        let radius = 0.42 * width;
        let mut handle = Self::capsule(grip + along * radius, grip + along * (9.0 * width), radius);
        handle.color = Vec3::new(0.03, 0.035, 0.04);
        vec![Self::metal(vertices, triangles), handle]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume (m³) that a closed mesh's triangles enclose, positive if they face outwards.
    fn volume(mesh: &DrawnMesh) -> f64 {
        let corners = mesh
            .triangles
            .iter()
            .map(|t| t.map(|k| mesh.vertices[k as usize]));
        corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    #[test]
    fn a_turned_box_faces_outwards_and_has_its_volume() {
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 2.0) / 3.0, 0.7);
        let mesh = DrawnMesh::cuboid(DVec3::new(0.3, -1.0, 2.0), turn, DVec3::new(1.0, 2.0, 0.5));
        assert!((volume(&mesh) - 8.0).abs() < 1e-12, "{} m³", volume(&mesh));
    }

    #[test]
    fn a_knife_is_closed_and_its_spine_lies_behind() {
        let edge = [DVec3::ZERO, DVec3::Z * 0.05, DVec3::Z * 0.1];
        let meshes = DrawnMesh::knife(&edge, DVec3::Y);
        let [wedge, handle] = &meshes[..] else {
            panic!("a wedge and a handle, not {}", meshes.len());
        };
        assert!(wedge.vertices.iter().all(|x| x.y <= 0.0), "behind the edge");
        // Closed: each edge is that of two triangles.
        let mut edges: Vec<[u32; 2]> = (wedge.triangles.iter())
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        edges.sort_unstable();
        let pairs = edges.chunks(2);
        assert!(edges.len().is_multiple_of(2) && pairs.into_iter().all(|pair| pair[0] == pair[1]));
        let width = wedge.vertices.iter().fold(0.0, |w: f64, x| w.max(-x.y));
        assert!((width - 0.011).abs() < 1e-15, "{width} m wide at most");
        assert!(
            handle.vertices.iter().all(|x| x.z > 0.0999),
            "beyond the heel"
        );
        assert!(DrawnMesh::knife(&[], DVec3::Y).is_empty());
    }
}
