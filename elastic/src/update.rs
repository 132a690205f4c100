//! What changes when a cut passes: rows, and the stiffness of nodes that a sliver left thin.

use crate::bound::StiffnessCap;
use crate::error::ElasticError;
use crate::model::{Elastic, Stencils, with_table};

impl Elastic {
    /// Takes over the rows of `touched` nodes from rebuilt stencils.
    ///
    /// Volumes, masses and materials stay. A row may have lost its rank, down to an isolated node
    /// whose row is all zeros: such nodes stay objective and finite (see
    /// [`Elastic::deformation_gradients`]). A stiffness cap stays in force. Call
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
    /// If the slices' lengths do not fit or a node does not exist.
    pub fn update_rows(
        &mut self,
        touched: &[u32],
        stencils: &Stencils<'_>,
    ) -> Result<(), ElasticError> {
        let body = &mut self.body;
        stencils.check_lengths(body.node_count(), body.controlled());
        let controlled = body.controlled();
        with_table!(&mut self.pairs, table => {
            assert_eq!(
                stencils.indices.len(),
                table.rows.pair_count(),
                "the graph is that of the start; severed pairs get zeros"
            );
            for &node in touched {
                body.set_row(&mut table.rows, node as usize, stencils)?;
            }
            if controlled {
                for &node in touched {
                    table.rows.check_symmetry(node as usize)?;
                }
            }
        });
        Ok(())
    }

    /// Lowers the elastic volume of `touched` nodes so that none is stiffer, for its neighbours'
    /// masses, than `kappa` times the stiffest node of the uncut body; returns how many are lowered.
    ///
    /// `V_i_el = V_i min(1, kappa q_ref / q_i)`, `q_i = V_i M_i sum_j |g_ij|² / m_j` including
    /// `j = i`, `M_i` the material's modulus. Masses stay. Call it only where the largest eigenvalue
    /// rose after a cut, with 1, 0.5, 0.3 in turn; infinity gives the touched nodes their full
    /// volume back.
    ///
    /// # Panics
    /// If a node does not exist or the cap was made for another model.
    pub fn cap_stiffness(&mut self, cap: &StiffnessCap, touched: &[u32], kappa: f64) -> usize {
        assert_eq!(
            cap.node_count(),
            self.node_count(),
            "the cap was made for another model"
        );
        let mut lowered = 0;
        for &node in touched {
            let node = node as usize;
            let stiffness = cap.stiffness(self, node);
            let allowed = kappa * cap.reference();
            let factor = if stiffness > allowed {
                lowered += 1;
                allowed / stiffness
            } else {
                1.0
            };
            let body = &mut self.body;
            body.elastic_volumes[node] = body.volumes[node] * factor;
            body.refresh_control(node);
        }
        lowered
    }
}
