//! Gradient stencils of a body, by the method that its scene asks for.

use glam::DVec3;
use phyxel_elastic as elastic;
use phyxel_mls::{
    ConservativeStencils, GradientStencils, Neighborhoods, StencilError, StencilRank,
};

/// Stencils of either method.
#[derive(Debug, Clone)]
pub enum BodyStencils {
    /// Conservative and consistent ones.
    Conservative(Box<ConservativeStencils>),
    /// Plain moving least squares, the dissertation's.
    Plain(Box<GradientStencils>),
}

/// Binds `$stencils` to either.
macro_rules! with {
    ($of:expr, $stencils:ident => $work:expr) => {
        match $of {
            BodyStencils::Conservative($stencils) => $work,
            BodyStencils::Plain($stencils) => $work,
        }
    };
}

impl BodyStencils {
    /// Present weights of the pairs, any unit, shape `(pairs)`.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        with!(self, stencils => &stencils.weights)
    }

    /// What the neighbours of each node span, shape `(n)`.
    #[must_use]
    pub fn ranks(&self) -> &[StencilRank] {
        with!(self, stencils => &stencils.ranks)
    }

    /// Heap bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        with!(self, stencils => stencils.memory_bytes().total)
    }

    /// The conservative ones; `None` for plain ones, which need no solve and enforce nothing.
    #[must_use]
    pub fn conservative(&self) -> Option<&ConservativeStencils> {
        match self {
            Self::Conservative(stencils) => Some(stencils),
            Self::Plain(_) => None,
        }
    }

    /// The stencils as the elastic model reads them, on the body's neighbours.
    #[must_use]
    pub fn view<'a>(&'a self, graph: &'a Neighborhoods) -> elastic::Stencils<'a> {
        let (offsets, indices) = (graph.offsets(), graph.indices());
        match self {
            Self::Conservative(stencils) => elastic::Stencils {
                offsets,
                indices,
                weights: &stencils.weights,
                matrices: &stencils.matrices,
                scales: &stencils.scales,
                multipliers: &stencils.multipliers,
            },
            Self::Plain(stencils) => elastic::Stencils {
                offsets,
                indices,
                weights: &stencils.weights,
                matrices: &stencils.moment_inverses,
                scales: &[],
                multipliers: &[],
            },
        }
    }

    /// Rebuilds the touched rows with new pair factors.
    pub(crate) fn update_rows(
        &mut self,
        rest: &[DVec3],
        graph: &Neighborhoods,
        factor: impl Fn(usize) -> f64,
        touched: &[u32],
    ) -> Result<(), StencilError> {
        with!(self, stencils => stencils.update_rows(rest, graph, factor, touched))
    }
}
