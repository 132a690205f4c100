//! Surfaces coloured by a quantity.

use glam::Vec3;
use phyxel_elastic::von_mises_stress;
use phyxel_splat::{Binding, ColorScale, Splats, Surfels, Tissue};
use rayon::prelude::*;

use crate::scene::Coloring;
use crate::world::Body;

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
    tissue: &Tissue,
    splats: &Splats,
    body: &Body,
    colors: &mut Vec<Vec3>,
) {
    let surfels = tissue.surfels();
    let stress: Vec<f64> = match coloring {
        Coloring::Stress { .. } => (0..body.rest.len())
            .into_par_iter()
            .map(|node| von_mises_stress(body.elastic.cauchy_stress(node)))
            .collect(),
        _ => Vec::new(),
    };
    (0..surfels.len())
        .into_par_iter()
        .map(|i| {
            scale.color(match coloring {
                Coloring::Tissue => f64::NAN,
                Coloring::Displacement { .. } => 1e3 * moved(surfels, splats, i),
                Coloring::Stress { .. } => 1e-3 * of_nodes(&stress, tissue.binding(), i),
                Coloring::Curvature { .. } => splats.mean_curvature(i),
            })
        })
        .collect_into_vec(colors);
}

fn moved(surfels: &Surfels, splats: &Splats, i: usize) -> f64 {
    splats.positions[i].distance(surfels.positions[i])
}

/// Mean of the nodes' values by the weights that carry a surfel.
fn of_nodes(values: &[f64], binding: &Binding, i: usize) -> f64 {
    let (nodes, weights) = binding.row(i);
    let pairs = nodes.iter().zip(weights);
    pairs.map(|(&node, w)| w * values[node as usize]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};
    use phyxel_splat::TissueSettings;

    /// A golden spiral on a ball of 0.1 m, one node.
    fn ball() -> Tissue {
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        for i in 0..2_000 {
            let y = 1.0 - (f64::from(i) + 0.5) / 1_000.0;
            let ring = (1.0 - y * y).sqrt();
            let (sine, cosine) = (2.399_963_229_728_653 * f64::from(i)).sin_cos();
            let out = DVec3::new(ring * cosine, y, ring * sine);
            positions.push(0.1 * out);
            normals.push(out);
        }
        let areas = vec![4.0 * std::f64::consts::PI * 0.01 / 2_000.0; 2_000];
        let settings = TissueSettings::default();
        Tissue::new(&positions, &normals, &areas, &[DVec3::ZERO], &settings).expect("it binds")
    }

    #[test]
    fn displacement_is_that_of_the_surfels() {
        let tissue = ball();
        let mut splats = Splats::default();
        tissue.carry_into(&[DVec3::X], &[DMat3::IDENTITY], &mut splats);
        for i in 0..2_000 {
            assert!((moved(tissue.surfels(), &splats, i) - 1.0).abs() < 1e-12);
        }
    }
}
