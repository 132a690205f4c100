//! How a scene wants surfaces covered and drawn.

use phyxel_splat::{
    Background, BindSettings, DrawMode, InsideTest, Measure, RadiusRule, TissueSettings, WeightLaw,
    linear_color,
};

use crate::scene::{self, Backdrop, SurfelMeasure, SurfelRadius, SurfelWeights, Surfels};

/// Radii, clipping and binding of a body's surfels.
pub(super) fn tissue_of(wish: &Surfels) -> TissueSettings {
    let usual = TissueSettings::default();
    TissueSettings {
        bind: BindSettings {
            neighbors: wish.nodes as usize,
            law: match wish.weights {
                SurfelWeights::Compact => WeightLaw::Compact,
                SurfelWeights::Gaussian => WeightLaw::Gaussian,
            },
            ..usual.bind
        },
        radius: match wish.radius {
            SurfelRadius::Covering => RadiusRule::Covering,
            SurfelRadius::Constant(radius) => RadiusRule::Constant(radius),
            SurfelRadius::Mapped {
                measure,
                neighbors,
                least,
                most,
                at_cuts,
            } => RadiusRule::Mapped {
                measure: match measure {
                    SurfelMeasure::Density => Measure::Density,
                    SurfelMeasure::Curvature => Measure::Curvature,
                    SurfelMeasure::Variation => Measure::Variation,
                },
                neighbors: neighbors as usize,
                least,
                most,
                at_cuts,
            },
        },
        opening: wish.opening,
        clip: wish.clip,
        inside: match wish.inside {
            scene::InsideTest::Shape => InsideTest::Given,
            scene::InsideTest::TwoNearest => InsideTest::TwoNearest,
        },
        ..usual
    }
}

pub(super) fn mode_of(wish: scene::DrawMode) -> DrawMode {
    match wish {
        scene::DrawMode::ThreePass => DrawMode::ThreePass,
        scene::DrawMode::Squares => DrawMode::Squares,
        scene::DrawMode::Disks => DrawMode::Disks,
        scene::DrawMode::SinglePass => DrawMode::SinglePass,
    }
}

pub(super) fn background_of(wish: Option<Backdrop>) -> Background {
    wish.map_or_else(Background::default, |wish| Background {
        top: linear_color(wish.top),
        bottom: linear_color(wish.bottom),
    })
}
