//! Surfels on a body's surface at rest: spread on its shape, or points of a file.

use glam::DVec3;
use phyxel_discretize::{
    Mesh, Solid, SurfaceSamples, read_point_cloud, sample_surfels, surface_mesh,
};
use phyxel_mls::{NearestSettings, k_nearest};
use phyxel_splat::{estimate_normals, follow_curvature};

use super::SkinProblem;
use phyxel::scene::{PointFile, SurfelSettings, SurfelSpacing, SurfelTarget};
use phyxel::{Body, World, ask_memory};

/// Fewest surfels of a body that shares their number: a ball's outline is still round.
const FEWEST: usize = 300;
/// Bytes of a surfel, bound and drawn, and of a sample of the surface that it is chosen from, by the peaks of `check`
/// with 30,000 and 1e6 surfels of the liver (920 B each) and with 1e5 that follow its curvature (3.9 kB, 8 samples each).
const SURFEL: f64 = 1000.0;
const SAMPLE: f64 = 400.0;
/// Even samples that each surfel is chosen from, where surfels follow curvature.
const CHOICE: usize = 8;
/// Nearest points by which the area of a file's point is estimated.
const NEAREST: usize = 12;
/// Mean distance of that many on an even surface over the root of a point's area: the mean of
/// `sqrt((j + 1/2) / π)`, as π r² / area - 1/2 others lie within r. On a square lattice it is 1.47.
const MEAN_OVER_ROOT: f64 = 1.44;

/// Each body's fraction of a number of surfels for all that share one: its size squared over the sum of
/// them, the size being the cube root of the volume.
pub(super) fn shares(world: &World) -> Vec<f64> {
    let squares = world.bodies().iter().zip(&world.scene().bodies);
    let squares: Vec<f64> = squares
        .map(|(body, spec)| match spec.surfels.target {
            SurfelTarget::Shared(_) => body.volume.cbrt().powi(2),
            SurfelTarget::Count(_) | SurfelTarget::Density(_) => 0.0,
        })
        .collect();
    let sum: f64 = squares.iter().sum();
    squares.iter().map(|square| square / sum).collect()
}

/// About as many as asked on the body's shape; `share` is its fraction of a number that bodies share.
pub(super) fn spread(
    target: SurfelTarget,
    spacing: SurfelSpacing,
    share: f64,
    body: &Body,
) -> Result<SurfaceSamples, SkinProblem> {
    // Half the nodes' spacing resolves a shape's curvature better than its nodes do.
    let surface = surface_mesh(&body.solid, 0.5 * body.spacing)?;
    let count = match target {
        SurfelTarget::Shared(count) => rounded(share * f64::from(count)).max(FEWEST),
        SurfelTarget::Count(count) => count as usize,
        SurfelTarget::Density(density) => rounded(allowed("target", density, surface.area())?),
    };
    let even = match spacing {
        SurfelSpacing::Even => count,
        SurfelSpacing::Curvature { .. } => CHOICE * count,
    };
    ask_memory(SURFEL * count as f64 + SAMPLE * even as f64)?;
    Ok(surfels_on_solid(&body.solid, &surface, count, spacing))
}

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

/// Surfels of a density (1/m²) on an area (m²), if no more than a body may have.
pub(super) fn allowed(key: &'static str, density: f64, area: f64) -> Result<f64, SkinProblem> {
    let count = density * area;
    let most = f64::from(SurfelSettings::MOST);
    if count > most {
        return Err(SkinProblem::TooManySurfels {
            key,
            density,
            area,
            count,
        });
    }
    Ok(count)
}

/// The points of a file where the body as it is `placed` has them, with areas by how near their
/// nearest are.
pub(super) fn scanned(
    points: &PointFile,
    placed: &phyxel::scene::Body,
    body: &Body,
) -> Result<SurfaceSamples, SkinProblem> {
    let mut surfels = read_point_cloud(&points.file)?;
    if surfels.normals.is_empty() {
        surfels.normals = estimate_normals(&surfels.positions)?;
    }
    let placed = placed.placement().of_file(points.scale, points.up);
    placed.place(&mut surfels.positions);
    for normal in &mut surfels.normals {
        *normal = placed.turn * *normal;
    }
    let count = surfels.positions.len() as f64;
    let apart = surfels.positions.iter();
    let apart: f64 = apart.map(|&x| body.solid.signed_distance(x).abs()).sum();
    if apart / count > body.spacing {
        return Err(SkinProblem::FarPoints {
            file: points.file.clone(),
            distance: apart / count,
            spacing: body.spacing,
        });
    }
    let settings = NearestSettings {
        nearest: NEAREST,
        limit: Some(NEAREST),
        ..NearestSettings::default()
    };
    let near = k_nearest(&surfels.positions, &settings)?;
    let areas = near.mean_distances.iter();
    surfels.areas = areas.map(|mean| (mean / MEAN_OVER_ROOT).powi(2)).collect();
    Ok(surfels)
}

/// A count from a number that is not negative.
#[allow(
    clippy::cast_possible_truncation,
    reason = "clamped to the range of u32"
)]
fn rounded(value: f64) -> usize {
    value.round().clamp(0.0, f64::from(u32::MAX)) as usize
}
