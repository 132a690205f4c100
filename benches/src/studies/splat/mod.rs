//! Surfaces drawn as splats: how near to exact pictures, and how fast.

mod adaptive;
mod ball;
mod exact;
mod speed;

use glam::DVec3;
use phyxel_discretize::{Primitive, Solid, SurfaceSamples};
use phyxel_splat::{RadiusRule, Tissue, TissueSettings};

use crate::report::Report;
use crate::{Effort, StudyError};

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let mut report = exact::run(effort)?;
    report.tables.push(speed::table(effort)?);
    report.tables.push(ball::table(effort)?);
    report.tables.push(adaptive::table(effort)?);
    report.words.push(
        "Times of the table of speed are medians, all threads, of a ball of evenly spread surfels \
         carried by 8,000 nodes, drawn with 1280 x 720 pixels; half of the surfels face away and are \
         counted as drawn."
            .to_owned(),
    );
    Ok(report)
}

/// The solid of a shape's own function.
fn implicit(shape: Primitive) -> Solid {
    Solid::implicit(shape.bounds(), move |p| shape.value(p))
}

/// Surfels that nothing carries: a tissue of one node, at rest.
fn at_rest(surfels: &SurfaceSamples, radius: RadiusRule) -> Result<Tissue, StudyError> {
    let settings = TissueSettings {
        radius,
        ..TissueSettings::default()
    };
    let (x, normals, areas) = (&surfels.positions, &surfels.normals, &surfels.areas);
    Ok(Tissue::new(x, normals, areas, &[DVec3::ZERO], &settings)?)
}
