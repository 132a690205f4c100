//! Surfaces coloured by a quantity.

use glam::Vec3;
use phyxel_elastic::von_mises_stress;
use phyxel_splat::{ColorScale, DrawnTissue};
use rayon::prelude::*;

use phyxel::Body;
use phyxel::scene::Coloring;

/// The scale and the title of a legend; `None` for the tissue's own colours.
pub(super) fn legend(coloring: Coloring) -> Option<(ColorScale, &'static str)> {
    let scale = |low, high| ColorScale { low, high };
    match coloring {
        Coloring::Tissue => None,
        Coloring::Displacement { most } => Some((scale(0.0, 1e3 * most), "moved (mm)")),
        Coloring::Stress { most } => Some((scale(0.0, 1e-3 * most), "stress (kPa)")),
        Coloring::Curvature { most } => Some((scale(-most, most), "curvature (1/m)")),
    }
}

/// Linear colours of carried surfels.
pub(super) fn colors(
    coloring: Coloring,
    scale: &ColorScale,
    skin: &DrawnTissue,
    body: &Body,
) -> Vec<Vec3> {
    let (surfels, splats) = (skin.tissue.surfels(), skin.splats());
    let elastic = body.elastic();
    let stress: Vec<f64> = match coloring {
        Coloring::Stress { .. } => (0..body.rest.len())
            .into_par_iter()
            .map(|node| von_mises_stress(elastic.cauchy_stress(node)))
            .collect(),
        _ => Vec::new(),
    };
    let moved = |i: usize| splats[i].position.distance(surfels[i].position);
    let colors = (0..surfels.len()).into_par_iter().map(|i| {
        scale.color(match coloring {
            Coloring::Tissue => f64::NAN,
            Coloring::Displacement { .. } => 1e3 * moved(i),
            Coloring::Stress { .. } => 1e-3 * skin.tissue.binding().mean(i, &stress),
            Coloring::Curvature { .. } => splats[i].mean_curvature(),
        })
    });
    colors.collect()
}
