//! Gradient stencils as the elastic model reads them.

use phyxel_elastic::Stencils;
use phyxel_mls::{GradientStencils, Neighborhoods};

/// The stencils of a body on its neighbours, for its elastic model.
#[must_use]
pub fn elastic_stencils<'a>(
    stencils: &'a GradientStencils,
    graph: &'a Neighborhoods,
) -> Stencils<'a> {
    Stencils {
        offsets: graph.offsets(),
        indices: graph.indices(),
        weights: &stencils.weights,
        matrices: &stencils.matrices,
        scales: &stencils.scales,
        multipliers: &stencils.multipliers,
    }
}
