//! What exists to be compared with: surfels carried as Aras 2014 prints it. No default uses it.

use crate::binding::Binding;
use crate::cast::index;
use crate::splats::Splats;
use crate::surfels::Surfels;
use glam::DVec3;
use rayon::prelude::*;

/// Carries surfels by the displacements of their nodes alone, Aras 2014, eq. (59) with the sum that its
/// numerator lacks in print: `x = X + Σ w_i u_i / Σ w_i`.
///
/// The text says nothing of normals. Here the disk's axes are r times the derivative of that very map along
/// the tangents, `t + Σ u_i (∇w_i · t)`, and the normal is perpendicular to both: all that displacements alone
/// know of a normal. For comparison with [`crate::carry_into`].
///
/// # Arguments
/// * `rest_nodes`, `nodes` -- node positions in the rest and the deformed frame (m), shape `(n)`.
/// * `splats` -- output, resized; normals do not bend over a disk.
///
/// # Panics
/// If the slices disagree in length.
///
/// # Numerics
/// Only translations are reproduced. A map of the nodes with the constant gradient `F` leaves a surfel
/// `(F - I)(Σ w_i X_i - X)` away from where it belongs, as the nodes that carry it lie on one side of it. Disks
/// without area keep the rest normal. Same bits at any thread count.
pub fn carry_by_displacements_into(
    surfels: &Surfels,
    binding: &Binding,
    rest_nodes: &[DVec3],
    nodes: &[DVec3],
    splats: &mut Splats,
) {
    assert_eq!(binding.len(), surfels.len(), "one binding row per surfel");
    assert_eq!(rest_nodes.len(), nodes.len(), "one position per node");
    let moved: Vec<DVec3> = nodes
        .iter()
        .zip(rest_nodes)
        .map(|(x, rest)| x - rest)
        .collect();
    let carried: Vec<[DVec3; 4]> = (0..surfels.len())
        .into_par_iter()
        .map(|i| {
            let (row, weights) = binding.row(i);
            let (t0, t1) = Surfels::tangents(surfels.normals[i]);
            let (mut x, mut u, mut v) = (surfels.positions[i], t0, t1);
            for ((&node, &weight), slope) in row.iter().zip(weights).zip(binding.slopes(i)) {
                let displacement = moved[index(node)];
                x += displacement * weight;
                u += displacement * slope[0];
                v += displacement * slope[1];
            }
            let normal = u.cross(v).normalize_or(surfels.normals[i]);
            [x, u * surfels.radii[i], v * surfels.radii[i], normal]
        })
        .collect();
    splats.positions = carried.iter().map(|c| c[0]).collect();
    splats.axes_u = carried.iter().map(|c| c[1]).collect();
    splats.axes_v = carried.iter().map(|c| c[2]).collect();
    splats.normals = carried.iter().map(|c| c[3]).collect();
    splats.bends_u = vec![DVec3::ZERO; carried.len()];
    splats.bends_v = vec![DVec3::ZERO; carried.len()];
}
