//! Blades as knives.

use glam::{DVec3, Vec3};
use phyxel_splat::DrawnMesh;

/// Width of a knife over its edge's length, and its largest value (m).
const KNIFE_WIDTH: f64 = 0.16;
const LARGEST_KNIFE_WIDTH: f64 = 0.011;
/// Half the thickness of a knife's spine over its width.
const HALF_THICKNESS: f64 = 0.05;

/// A knife along a cutting edge: a wedge behind it, slanted at its first point, and a handle at its last.
///
/// # Arguments
/// * `edge` -- corners of the cutting edge (m), at least two.
/// * `ahead` -- where it cuts to, any length: the spine lies on the other side.
///
/// # Returns
/// The wedge and the handle; nothing for an edge without points.
pub(super) fn knife(edge: &[DVec3], ahead: DVec3) -> Vec<DrawnMesh> {
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
    let rows = u32::try_from(edge.len()).unwrap_or(u32::MAX);
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
    let mut handle =
        DrawnMesh::capsule(grip + along * radius, grip + along * (9.0 * width), radius);
    handle.color = Vec3::new(0.03, 0.035, 0.04);
    vec![DrawnMesh::metal(vertices, triangles), handle]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_knife_is_closed_and_its_spine_lies_behind() {
        let edge = [DVec3::ZERO, DVec3::Z * 0.05, DVec3::Z * 0.1];
        let meshes = knife(&edge, DVec3::Y);
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
        let beyond = handle.vertices.iter().all(|x| x.z > 0.0999);
        assert!(beyond && knife(&[], DVec3::Y).is_empty());
    }
}
