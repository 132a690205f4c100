//! Where the surfels of a surface lie.

use glam::DVec3;
use phyxel_discretize::{Mesh, Solid, SurfaceSamples, sample_surfels};
use phyxel_splat::follow_curvature;

use phyxel::scene::SurfelSpacing;

/// Even samples that each surfel is chosen from, where surfels follow curvature.
pub(super) const CHOICE: usize = 8;

/// About `count` surfels on the surface of a solid, `mesh` being that surface: even, or closer where it
/// curves (`phyxel_splat::follow_curvature`). Positions (m), outward unit normals, areas (m²).
///
/// The number found is near `count` and rarely equal to it.
#[must_use]
pub fn surfels_on_solid(
    solid: &Solid,
    mesh: &Mesh,
    count: usize,
    spacing: SurfelSpacing,
) -> SurfaceSamples {
    let SurfelSpacing::Curvature { range } = spacing else {
        return sample_surfels(mesh, count, Some(solid));
    };
    let many = sample_surfels(mesh, CHOICE * count, Some(solid));
    let (chosen, areas) =
        follow_curvature(&many.positions, &many.normals, &many.areas, count, range);
    let pick = |values: &[DVec3]| chosen.iter().map(|&i| values[i as usize]).collect();
    SurfaceSamples {
        positions: pick(&many.positions),
        normals: pick(&many.normals),
        areas,
    }
}
