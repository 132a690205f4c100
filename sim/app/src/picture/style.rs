//! How a scene wants surfaces covered and drawn.

use phyxel_splat::{Background, TissueSettings, linear_color};

use phyxel::scene::{Backdrop, SurfelSettings};

/// Radii, clipping and binding of a body's surfels.
pub(super) fn tissue_of(spec: &SurfelSettings) -> TissueSettings {
    TissueSettings {
        neighbors: spec.nodes as usize,
        weights: spec.weights,
        radius: spec.radius,
        opening: spec.opening,
        clip: spec.clip,
        inside: spec.inside,
        ..TissueSettings::default()
    }
}

pub(super) fn background_of(spec: Option<Backdrop>) -> Background {
    spec.map_or_else(Background::default, |spec| Background {
        top: linear_color(spec.top),
        bottom: linear_color(spec.bottom),
    })
}
