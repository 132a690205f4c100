//! How a scene wants surfaces covered and drawn.

use phyxel_splat::{Background, BindSettings, TissueSettings, linear_color};

use crate::scene::{Backdrop, Surfels};

/// Radii, clipping and binding of a body's surfels.
pub(super) fn tissue_of(wish: &Surfels) -> TissueSettings {
    let usual = TissueSettings::default();
    TissueSettings {
        bind: BindSettings {
            neighbors: wish.nodes as usize,
            law: wish.weights,
            ..usual.bind
        },
        radius: wish.radius,
        opening: wish.opening,
        clip: wish.clip,
        inside: wish.inside,
        ..usual
    }
}

pub(super) fn background_of(wish: Option<Backdrop>) -> Background {
    wish.map_or_else(Background::default, |wish| Background {
        top: linear_color(wish.top),
        bottom: linear_color(wish.bottom),
    })
}
