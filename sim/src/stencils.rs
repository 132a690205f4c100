//! Gradient stencils as the elastic model reads them.

use phyxel_elastic::Stencils;
use phyxel_mls::{GradientStencils, Neighborhoods};

/// The stencils of a body on its neighbours, for its elastic model.
#[must_use]
pub fn elastic_stencils<'a>(
    stencils: &'a GradientStencils,
    graph: &'a Neighborhoods,
) -> Stencils<'a> {
    let (weights, matrices) = (&stencils.weights, &stencils.matrices);
    Stencils::plain(graph.offsets(), graph.indices(), weights, matrices)
        .with_multipliers(&stencils.scales, &stencils.multipliers)
}
