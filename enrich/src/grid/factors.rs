//! From values at nodes to factors of pairs; the dissertation leaves this step out.

use glam::DVec3;

use super::{Enrichment, EnrichmentGrid};

/// How φ enters the weight of a pair. The text (Aras 2014, p. 46) only says that the weight is to be 1
/// on one side and 0 on the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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
/// looked up at the nearest lattice point, as in the dissertation.
///
/// # Arguments
/// * `grids` -- one per cut, rebuilt for each new piece of it.
/// * `positions`, `offsets`, `indices` -- nodes (m) and graph.
/// * `support_radius` -- per node (m).
///
/// # Panics
/// If slices do not fit each other.
#[must_use]
pub fn grid_pair_factors(
    grids: &[EnrichmentGrid],
    positions: &[DVec3],
    offsets: &[u32],
    indices: &[u32],
    support_radius: &[f64],
    form: GridForm,
) -> Vec<f64> {
    assert_eq!(offsets.len(), positions.len() + 1, "one row per node");
    assert_eq!(
        support_radius.len(),
        positions.len(),
        "one support radius per node"
    );
    let mut factors = vec![1.0; indices.len()];
    for grid in grids {
        let values: Vec<Option<Enrichment>> = positions
            .iter()
            .zip(support_radius)
            .map(|(&p, &radius)| grid.look_up(p).filter(|e| e.distance < radius))
            .collect();
        for i in 0..positions.len() {
            let Some(at_i) = values[i] else { continue };
            for pair in offsets[i] as usize..offsets[i + 1] as usize {
                if let Some(at_j) = values[indices[pair] as usize] {
                    factors[pair] *= form.factor(&at_i, &at_j);
                }
            }
        }
    }
    factors
}
