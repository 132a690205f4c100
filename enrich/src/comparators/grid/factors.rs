//! From values at nodes to factors of pairs; the dissertation leaves this step out.

use super::{Enrichment, EnrichmentGrid};
use crate::graph::Graph;

/// How φ enters the weight of a pair. Aras (2014, p. 46) only says that the weight is to be 1
/// on one side and 0 on the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum GridForm {
    /// `(1 + sign(s_i) φ_j) / 2`: node i asks how far node j is on its side. Not the same in both
    /// directions.
    OneSided,
    /// Mean of both directions of [`GridForm::OneSided`].
    #[default]
    OneSidedMean,
    /// `(1 + φ_i φ_j) / 2`, the same in both directions.
    Product,
}

impl GridForm {
    /// Factor of the pair from the values at both nodes.
    #[must_use]
    pub fn factor(self, i: &Enrichment, j: &Enrichment) -> f64 {
        let sign = |e: &Enrichment| if e.s < 0.0 { -1.0 } else { 1.0 };
        match self {
            Self::OneSided => 0.5 * (1.0 + sign(i) * j.phi),
            Self::OneSidedMean => 0.25 * (2.0 + (sign(i) * j.phi + sign(j) * i.phi)),
            Self::Product => 0.5 * (1.0 + i.phi * j.phi),
        }
    }
}

/// Factors of all pairs from the grids of all cuts, multiplied over cuts (eq. (38) between cuts).
///
/// Pairs of which a node is farther from the cut than its support radius keep the factor 1. Values are
/// looked up at the nearest lattice point, as in the dissertation, but on the node's own side.
///
/// # Arguments
/// * `grids` -- one per cut, or per sheet of it, rebuilt for each new piece of it.
/// * `graph` -- nodes and pairs.
/// * `support_radius` -- per node (m).
///
/// # Panics
/// If there is not one support radius per node.
#[must_use]
pub fn grid_pair_factors<'a>(
    grids: impl IntoIterator<Item = &'a EnrichmentGrid>,
    graph: &Graph<'_>,
    support_radius: &[f64],
    form: GridForm,
) -> Vec<f64> {
    let n = graph.positions.len();
    assert_eq!(support_radius.len(), n, "one support radius per node");
    let mut factors = vec![1.0; graph.indices.len()];
    for grid in grids {
        let value = |i: usize| {
            let found = grid.on_its_side(graph.positions[i]);
            found.filter(|e| e.distance < support_radius[i])
        };
        let values: Vec<Option<Enrichment>> = (0..n).map(value).collect();
        for i in 0..n {
            let Some(at_i) = values[i] else { continue };
            for pair in graph.pairs(i) {
                if let Some(at_j) = values[graph.indices[pair] as usize] {
                    factors[pair] *= form.factor(&at_i, &at_j);
                }
            }
        }
    }
    factors
}
