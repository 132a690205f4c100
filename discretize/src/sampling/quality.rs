//! How good tetrahedra are.

use std::f64::consts::PI;

use glam::DVec3;

use crate::mesh::{tetrahedra_edges, tetrahedron_volume};

/// Shape and size of a set of tetrahedra.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TetrahedraQuality {
    /// Smallest dihedral angle (degrees).
    pub smallest_dihedral: f64,
    /// Largest dihedral angle (degrees).
    pub largest_dihedral: f64,
    /// Shortest edge (m).
    pub shortest_edge: f64,
    /// Mean edge (m).
    pub mean_edge: f64,
    /// Longest edge (m).
    pub longest_edge: f64,
    /// Smallest height of a corner over its opposite face (m): what limits an explicit step.
    pub smallest_height: f64,
    /// Smallest quarter sum of a node's tetrahedra over the mean one: nodes near a mesh's surface have more.
    pub smallest_volume: f64,
    /// Smallest `sqrt(V_i / K_i)` of a node (m), `K_i = sum_T V_T / h_T^2` with its heights: the
    /// stable explicit step is about three times this over the speed of pressure waves.
    pub smallest_step: f64,
    /// Tetrahedra without positive volume.
    pub inverted: usize,
}

/// Measures tetrahedra; NaN mean for none.
///
/// # Panics
/// If a tetrahedron names a node out of range.
#[must_use]
pub fn tetrahedra_quality(positions: &[DVec3], tetrahedra: &[[u32; 4]]) -> TetrahedraQuality {
    let mut quality = TetrahedraQuality {
        smallest_dihedral: f64::INFINITY,
        largest_dihedral: 0.0,
        shortest_edge: f64::INFINITY,
        mean_edge: 0.0,
        longest_edge: 0.0,
        smallest_height: f64::INFINITY,
        smallest_volume: f64::INFINITY,
        smallest_step: f64::INFINITY,
        inverted: 0,
    };
    // Volume and stiffness of each node.
    let mut nodal = vec![(0.0, 0.0); positions.len()];
    for tetrahedron in tetrahedra {
        let corners = tetrahedron.map(|v| positions[v as usize]);
        let volume = tetrahedron_volume(corners);
        if volume <= 0.0 || volume.is_nan() {
            quality.inverted += 1;
        }
        for (v, normal) in tetrahedron.iter().zip(faces(corners)) {
            let (own, stiffness) = &mut nodal[*v as usize];
            *own += 0.25 * volume;
            *stiffness += normal.length_squared() / (36.0 * volume);
        }
        let (low, high) = dihedral_range(corners);
        quality.smallest_dihedral = quality.smallest_dihedral.min(low);
        quality.largest_dihedral = quality.largest_dihedral.max(high);
        quality.smallest_height = quality.smallest_height.min(smallest_height(corners));
    }
    let used = nodal.iter().filter(|(_, stiffness)| *stiffness != 0.0);
    let mean = nodal.iter().map(|(v, _)| v).sum::<f64>() / used.clone().count() as f64;
    for (volume, stiffness) in used {
        let step = (volume / stiffness).max(0.0).sqrt();
        quality.smallest_volume = quality.smallest_volume.min(volume / mean);
        quality.smallest_step = quality.smallest_step.min(step);
    }
    let (offsets, indices) = tetrahedra_edges(positions.len(), tetrahedra);
    let mut sum = 0.0;
    for (i, window) in offsets.windows(2).enumerate() {
        for &j in &indices[window[0] as usize..window[1] as usize] {
            let length = positions[i].distance(positions[j as usize]);
            quality.shortest_edge = quality.shortest_edge.min(length);
            quality.longest_edge = quality.longest_edge.max(length);
            sum += length;
        }
    }
    quality.mean_edge = sum / indices.len() as f64;
    quality
}

/// Area vectors of the faces opposite a, b, c, d, pointing outward for positive volume.
pub(crate) fn faces([a, b, c, d]: [DVec3; 4]) -> [DVec3; 4] {
    [
        (c - b).cross(d - b),
        (d - a).cross(c - a),
        (b - a).cross(d - a),
        (c - a).cross(b - a),
    ]
}

/// Smallest and largest dihedral angle (degrees).
fn dihedral_range(corners: [DVec3; 4]) -> (f64, f64) {
    let normals = faces(corners).map(|n| n.normalize_or_zero());
    let (mut low, mut high) = (1.0_f64, -1.0_f64);
    for i in 0..4 {
        for j in i + 1..4 {
            let cosine = -normals[i].dot(normals[j]);
            low = low.min(cosine);
            high = high.max(cosine);
        }
    }
    let degrees = |cosine: f64| cosine.clamp(-1.0, 1.0).acos() * 180.0 / PI;
    (degrees(high), degrees(low))
}

/// Smallest height: three times the volume over the largest face.
fn smallest_height(corners: [DVec3; 4]) -> f64 {
    let squares = faces(corners).map(DVec3::length_squared);
    let largest = squares.into_iter().fold(0.0, f64::max).sqrt();
    6.0 * tetrahedron_volume(corners) / largest
}
