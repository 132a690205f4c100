//! Parts of a surface's area that belong to nodes on it.

use glam::DVec3;
use rayon::prelude::*;

use crate::sampling::{Near, SampleError, Solid, sample_surfels, surface_mesh};

/// Samples of the surface for each node on it; nodes that are looked at for each; cosine below which a node's
/// normal is that of another face.
const SAMPLES: usize = 12;
const LOOKED_AT: usize = 6;
const SAME_FACE: f64 = 0.5;

/// Area (m²) of the surface that is nearest to each of some nodes on it, shape `(n)`: for contact of bodies
/// without tetrahedra. Beside an edge a position counts for the nearest node of its own face.
///
/// By samples of the surface, twelve a node, so areas are good to some percent; their sum is that of the surface's
/// triangles. A node between nearer ones may have 0.
///
/// # Arguments
/// * `nodes` -- positions on the surface (m), shape `(n)`.
/// * `spacing` -- mean distance (m) of the body's nodes; the surface's triangles are half as large.
///
/// # Errors
/// As [`surface_mesh`].
pub fn nodal_surface_areas(
    solid: &Solid,
    nodes: &[DVec3],
    spacing: f64,
) -> Result<Vec<f64>, SampleError> {
    let surface = surface_mesh(solid, 0.5 * spacing)?;
    let mut areas = vec![0.0; nodes.len()];
    if nodes.is_empty() {
        return Ok(areas);
    }
    let samples = sample_surfels(&surface, SAMPLES * nodes.len(), Some(solid));
    let facing: Vec<DVec3> = nodes.iter().map(|&x| solid.normal(x)).collect();
    let tree = Near::new(nodes);
    let places = samples.positions.par_iter().zip(&samples.normals);
    let owners: Vec<u32> = places
        .map(|(&x, normal)| {
            let near = tree.several(x, LOOKED_AT);
            let alike = |k: &&u32| facing[**k as usize].dot(*normal) > SAME_FACE;
            *near.iter().find(alike).unwrap_or(&near[0])
        })
        .collect();
    for (owner, area) in owners.into_iter().zip(&samples.areas) {
        areas[owner as usize] += area;
    }
    Ok(areas)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::solid::Primitive;

    /// Nodes of a lattice on a cube's surface: the middle of a face has a cell, and none of the samples is lost.
    #[test]
    fn nodes_of_a_cube_share_its_surface() {
        let at = |k: u32| f64::from(k) * 0.1 - 0.2;
        let all = (0..125).map(|k| DVec3::new(at(k % 5), at(k / 5 % 5), at(k / 25)));
        let nodes: Vec<DVec3> = all
            .filter(|x| (x.abs().max_element() - 0.2).abs() < 1e-12)
            .collect();
        let solid = Solid::from(Primitive::Box {
            half_extents: DVec3::splat(0.2),
        });
        let areas = nodal_surface_areas(&solid, &nodes, 0.1).unwrap();
        let sum: f64 = areas.iter().sum();
        assert!((sum - 0.96).abs() < 1e-9, "{sum} m²");
        // Middles of the faces: one cell each, by about a dozen samples.
        let middle = |x: &DVec3| x.abs().to_array().iter().filter(|c| **c < 1e-12).count() == 2;
        let middles = nodes.iter().zip(&areas).filter(|(x, _)| middle(x));
        let middles: Vec<f64> = middles.map(|(_, area)| *area).collect();
        assert_eq!(middles.len(), 6, "one a face");
        for area in &middles {
            assert!((area - 0.01).abs() < 0.005, "{area} m² of 0.01");
        }
    }
}
