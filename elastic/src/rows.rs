//! Rows that change when a cut passes.

use std::ops::Range;

use glam::{DMat3, DVec3};

use crate::error::ElasticError;
use crate::input::{Stencils, same_length};
use crate::kernel::row::{set_drags, set_row};
use crate::model::Elastic;

/// Rows of some nodes alone, as [`Stencils`] has those of all.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a> {
    /// The nodes, each once.
    pub nodes: &'a [u32],
    /// `w_ij` of their pairs, one row after the other.
    pub weights: &'a [f64],
    /// `B_i`, one per node.
    pub matrices: &'a [DMat3],
    /// `s_i`, one per node; empty without multipliers.
    pub scales: &'a [f64],
    /// Nodes with their `μ_i`, among them all in these rows; empty without multipliers.
    pub multipliers: &'a [(u32, DVec3)],
}

/// Rows of stencils, for programs that apply a cut in steps of their own or share out a body.
impl Elastic {
    /// As [`Elastic::update_rows`], where the caller with the rows does not have all of the stencils. The rows are
    /// spread over lists as long as the model's for it.
    ///
    /// # Errors
    /// [`ElasticError`] as in [`Elastic::update_rows`], and if the lists' lengths do not fit together.
    ///
    /// # Panics
    /// As [`Elastic::update_rows`].
    pub fn take_rows(&mut self, rows: &Rows<'_>) -> Result<(), ElasticError> {
        if rows.nodes.is_empty() {
            return Ok(());
        }
        let (n, pairs) = (self.node_count(), self.model.pairs.pair_count());
        let lengths = rows.nodes.iter().map(|&node| self.pairs_of(node).len());
        same_length("weights", rows.weights.len(), lengths.sum())?;
        same_length("matrices", rows.matrices.len(), rows.nodes.len())?;
        let corrected = !rows.multipliers.is_empty();
        let scaled = if corrected { rows.nodes.len() } else { 0 };
        same_length("scales", rows.scales.len(), scaled)?;
        let mut weights = vec![0.0; pairs];
        let mut matrices = vec![DMat3::ZERO; n];
        let count = if corrected { n } else { 0 };
        let (mut scales, mut multipliers) = (vec![0.0; count], vec![DVec3::ZERO; count]);
        let mut rest = rows.weights;
        for (at, &node) in rows.nodes.iter().enumerate() {
            let pairs = self.pairs_of(node);
            let (these, others) = rest.split_at(pairs.len());
            weights[pairs].copy_from_slice(these);
            rest = others;
            matrices[node as usize] = rows.matrices[at];
            if let Some(scale) = rows.scales.get(at) {
                scales[node as usize] = *scale;
            }
        }
        for &(node, multiplier) in rows.multipliers {
            multipliers[node as usize] = multiplier;
        }
        let offsets = self.model.pairs.offsets().to_vec();
        let stencils = Stencils {
            offsets: &offsets,
            // Those of the start, which nobody reads again.
            indices: &vec![0; pairs],
            weights: &weights,
            matrices: &matrices,
            scales: &scales,
            multipliers: &multipliers,
        };
        self.update_rows(rows.nodes, &stencils)
    }

    /// Places of a node's pairs among all, as [`Elastic::weaken`] asks for them.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn pairs_of(&self, node: u32) -> Range<usize> {
        self.model.pairs.range(node as usize)
    }

    /// Adopts the rows of `touched` nodes from rebuilt stencils.
    ///
    /// Volumes, masses and materials stay. A row may have lost its rank, down to an isolated node
    /// whose row is all zeros: such nodes stay objective and finite (see
    /// [`Elastic::deformation_gradients`]). Deficient nodes stay weak. Call
    /// [`Elastic::forces_into`] before the next tangent product.
    ///
    /// # Arguments
    /// * `touched` -- nodes whose row changed. If a weight changed, both ends of its pair.
    /// * `stencils` -- complete, on the graph the model was built with; only touched rows are read.
    ///
    /// # Errors
    /// [`ElasticError`] as in [`Elastic::new`]. The model then holds some new rows and must be
    /// updated again before use.
    ///
    /// # Panics
    /// If a node does not exist, or multipliers come or go.
    pub fn update_rows(
        &mut self,
        touched: &[u32],
        stencils: &Stencils<'_>,
    ) -> Result<(), ElasticError> {
        self.scratch.stale.add(touched);
        let model = &mut self.model;
        stencils.check_lengths(model.node_count())?;
        // The graph is that of the start; severed pairs get zeros.
        same_length("pairs", stencils.indices.len(), model.pairs.pair_count())?;
        for &node in touched {
            model.pairs.set_row(node as usize, stencils)?;
        }
        for &node in touched {
            model.pairs.check_symmetry(node as usize)?;
        }
        assert_eq!(
            self.tables.is_corrected(),
            !stencils.multipliers.is_empty(),
            "multipliers as at the start"
        );
        let tables = &mut self.tables;
        for &node in touched {
            tables.set_multiplier(node as usize, stencils.multipliers);
        }
        for &node in touched {
            set_row(model, tables, node as usize, stencils)?;
        }
        set_drags(model, tables, touched.iter().map(|&node| node as usize));
        self.refresh_fronts();
        self.refresh_squares(touched.iter().map(|&node| node as usize));
        Ok(())
    }
}
