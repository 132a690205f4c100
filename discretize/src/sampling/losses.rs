//! What of a body a sampling lost.

use rayon::prelude::*;

use crate::mesh::{Bounds, Hierarchy, Mesh};
use crate::sampling::{SampleError, Solid, nodes_at};

/// Counts cavities that no edge met; an outward part that no edge met is an error.
pub(crate) fn check_parts(
    solid: &Solid,
    parts_hit: &[bool],
    spacing: f64,
) -> Result<usize, SampleError> {
    let Some(mesh) = solid.mesh() else {
        return Ok(0);
    };
    let mut lost: Option<(Bounds, usize)> = None;
    let mut thinnest = f64::INFINITY;
    let mut cavities = 0;
    let (part_of, count) = solid.parts();
    let of = |part: usize| {
        let all = mesh.triangles.iter().zip(part_of);
        let own = all.filter(|(_, other)| **other as usize == part);
        own.map(|(triangle, _)| *triangle).collect()
    };
    for (part, _) in parts_hit.iter().enumerate().filter(|(_, hit)| !**hit) {
        let own = Mesh {
            vertices: mesh.vertices.clone(),
            triangles: of(part),
        };
        if own.volume() < 0.0 {
            cavities += 1;
        } else if !is_buried(solid, &own) {
            let bounds = own.bounds();
            thinnest = thinnest.min(2.0 * own.volume() / own.area());
            lost = Some(lost.map_or((bounds, 1), |(first, n)| (first, n + 1)));
        }
    }
    match lost {
        None => Ok(cavities),
        Some((bounds, parts)) => {
            let advice = (0.5 * thinnest).min(0.5 * spacing);
            Err(SampleError::LostParts {
                parts,
                of: *count,
                spacing,
                near: bounds.center(),
                advice,
                nodes: nodes_at(advice, solid.measures()),
            })
        }
    }
}

/// Whether a part lies inside another one, so that no edge has to leave the body there.
fn is_buried(solid: &Solid, part: &Mesh) -> bool {
    let first = part.triangles[0].map(|v| part.vertices[v as usize]);
    let normal = part.area_vector(0).normalize_or_zero();
    let step = 1e-3 * part.bounds().diagonal();
    let middle = (first[0] + first[1] + first[2]) / 3.0;
    solid.contains(middle + step * normal)
}

/// Fraction of the input's vertices farther than `spacing` from the sampled surface.
pub(crate) fn missed_share(input: &Mesh, sampled: &Mesh, spacing: f64) -> f64 {
    let hierarchy = Hierarchy::new(sampled);
    let far = input
        .vertices
        .par_iter()
        .filter(|v| {
            hierarchy
                .closest(**v)
                .is_none_or(|c| c.distance_squared > spacing * spacing)
        })
        .count();
    far as f64 / input.vertices.len() as f64
}
