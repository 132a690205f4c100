//! Triangles of one mesh that cross each other.

use glam::DVec3;
use rayon::prelude::*;
use robust::{Coord3D, orient3d};

use crate::mesh::{Bounds, Hierarchy, Mesh, index};

/// Triangles that cross another one, sorted. Exact signs (Shewchuk 1997); triangles that only
/// touch or overlap in one plane, and neighbours over an edge, do not count.
///
/// # Panics
/// If a triangle names a vertex out of range.
#[must_use]
pub fn self_intersections(mesh: &Mesh, hierarchy: &Hierarchy) -> Vec<u32> {
    let pairs: Vec<[u32; 2]> = (0..mesh.triangles.len())
        .into_par_iter()
        .flat_map_iter(|t| {
            let mut near = Vec::new();
            hierarchy.touching_into(&Bounds::of(mesh.corners(t)), &mut near);
            near.retain(|other| *other as usize > t && cross(mesh, t, *other as usize));
            near.into_iter().map(move |other| [index(t), other])
        })
        .collect();
    let mut crossing: Vec<u32> = pairs.into_iter().flatten().collect();
    crossing.sort_unstable();
    crossing.dedup();
    crossing
}

/// Whether two triangles cross; those with one common corner only away from it.
fn cross(mesh: &Mesh, s: usize, t: usize) -> bool {
    let (a, b) = (mesh.triangles[s], mesh.triangles[t]);
    let common: Vec<u32> = a.into_iter().filter(|v| b.contains(v)).collect();
    if common.len() > 1 {
        return false;
    }
    let pierces = |edges_of: [u32; 3], face: [u32; 3]| {
        (0..3).any(|k| {
            let (p, q) = (edges_of[k], edges_of[(k + 1) % 3]);
            !common.contains(&p)
                && !common.contains(&q)
                && segment_crosses(
                    [p, q].map(|v| mesh.vertices[v as usize]),
                    face.map(|v| mesh.vertices[v as usize]),
                )
        })
    };
    pierces(a, b) || pierces(b, a)
}

fn side(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    let coord = |p: DVec3| Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    };
    orient3d(coord(a), coord(b), coord(c), coord(d))
}

fn segment_crosses([p, q]: [DVec3; 2], [a, b, c]: [DVec3; 3]) -> bool {
    if side(a, b, c, p) * side(a, b, c, q) >= 0.0 {
        return false;
    }
    let (u, v, w) = (side(p, q, a, b), side(p, q, b, c), side(p, q, c, a));
    (u > 0.0 && v > 0.0 && w > 0.0) || (u < 0.0 && v < 0.0 && w < 0.0)
}
