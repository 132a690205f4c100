//! Rigid things drawn beside the splats: triangle meshes with a colour.

use crate::cast::{count, real};
use glam::{DAffine3, DVec3, Vec3};

/// Triangles with one colour, world frame. Both faces are drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
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

impl Mesh {
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

    /// A scalpel: its cutting edge runs from `tip` to `heel`, the handle continues away from the
    /// tissue along `back` (from the edge towards the spine).
    #[must_use]
    pub fn scalpel(tip: DVec3, heel: DVec3, back: DVec3) -> Vec<Self> {
        let edge = heel - tip;
        let length = edge.length().max(f64::MIN_POSITIVE);
        let along = edge / length;
        let back = (back - along * back.dot(along))
            .try_normalize()
            .unwrap_or_else(|| along.any_orthonormal_vector());
        let side = along.cross(back);
        // Outline of the blade in (along, back), units of its length; belly first.
        let outline = [
            (0.0, 0.0),
            (0.12, -0.0),
            (1.0, 0.0),
            (1.25, 0.08),
            (1.3, 0.3),
            (0.42, 0.3),
            (0.12, 0.16),
        ];
        let thickness = 0.012 * length;
        let mut vertices = Vec::new();
        for sign in [-1.0, 1.0] {
            for (k, &(u, v)) in outline.iter().enumerate() {
                // The edge itself is sharp, the spine thick.
                let t = if k < 3 { 0.0 } else { thickness };
                vertices.push(tip + (along * u + back * v) * length + side * (sign * t));
            }
        }
        let n = outline.len();
        let mut triangles = Vec::new();
        for k in 1..n - 1 {
            triangles.push([0, k, k + 1].map(count));
            triangles.push([n, n + k + 1, n + k].map(count));
        }
        for k in 0..n {
            let next = (k + 1) % n;
            triangles.push([k, n + k, next].map(count));
            triangles.push([next, n + k, n + next].map(count));
        }
        let blade = Self::metal(vertices, triangles);
        let grip = |u: f64| tip + (along * u + back * (0.17 + 0.10 * (u - 1.2))) * length;
        let mut handle = Self::capsule(grip(1.2), grip(4.5), 0.13 * length);
        handle.color = Vec3::new(0.16, 0.17, 0.19);
        handle.shininess = 25.0;
        vec![blade, handle]
    }

    /// The mesh moved by an affine map.
    #[must_use]
    pub fn transformed(&self, map: &DAffine3) -> Self {
        let mut out = self.clone();
        for v in &mut out.vertices {
            *v = map.transform_point3(*v);
        }
        out
    }
}
