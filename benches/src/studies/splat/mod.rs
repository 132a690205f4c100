//! Surfaces drawn as splats: how near to exact pictures, how fast, and how they look.

mod adaptive;
mod ball;
mod cuts;
mod exact;
mod inside;
pub(super) mod sheet;
mod speed;
pub(super) mod stills;

use glam::DVec3;
use phyxel_cli::picture::Painter;
use phyxel_discretize::{Primitive, Solid, SurfaceSamples};
use phyxel_splat::{RadiusRule, RenderSettings, Renderer, Tissue, TissueSettings};

use crate::report::Report;
use crate::{Effort, StudyError};

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let mut report = exact::run(effort)?;
    report.tables.push(speed::table(effort)?);
    report.tables.push(ball::table(effort)?);
    report.tables.push(inside::table(effort)?);
    report.tables.push(adaptive::table(effort)?);
    report.pictures = stills::pictures(effort)?;
    report.pictures.extend(cuts::pictures(effort)?);
    report.words.push(
        "Times of the table of speed are medians, all threads, of a ball of evenly spread surfels \
         carried by 8,000 nodes, drawn with 1280 x 720 pixels; half of the surfels face away and are \
         counted as drawn. The pictures follow those of the dissertation named on them, with a liver \
         and a block."
            .to_owned(),
    );
    Ok(report)
}

/// The solid of a shape's own function.
pub(super) fn implicit(shape: Primitive) -> Solid {
    Solid::implicit(shape.bounds(), move |p| shape.value(p))
}

/// Mean distance (m) of the surfels of a painter's first body.
pub(super) fn spacing(painter: &Painter) -> f64 {
    let (_, _, areas) = painter.surfels(0);
    let count = areas.len() as f64;
    (areas.iter().sum::<f64>() / count).sqrt()
}

/// Draws one sample a pixel and keeps the normals, to be compared with exact pictures.
fn plain_renderer(width: u32, height: u32) -> Renderer {
    Renderer::new(RenderSettings {
        width,
        height,
        samples: 1,
        keep_normals: true,
        ..RenderSettings::default()
    })
}

/// Surfels that nothing carries: a tissue of one node, at rest.
pub(super) fn at_rest(surfels: &SurfaceSamples, radius: RadiusRule) -> Result<Tissue, StudyError> {
    let settings = TissueSettings {
        radius,
        ..TissueSettings::default()
    };
    Ok(Tissue::new(
        &surfels.positions,
        &surfels.normals,
        &surfels.areas,
        &[DVec3::ZERO],
        &settings,
    )?)
}
