//! What changes when a cut passes: rows, and the control of their nodes.

use crate::error::ElasticError;
use crate::model::{Elastic, Stencils, with_table};

impl Elastic {
    /// Takes over the rows of `touched` nodes from rebuilt stencils.
    ///
    /// Volumes, masses and materials stay. A row may have lost its rank, down to an isolated node
    /// whose row is all zeros: such nodes stay objective and finite (see
    /// [`Elastic::deformation_gradients`]). Weak nodes stay weak; crack fronts at touched nodes are
    /// forgotten (see [`Elastic::set_fronts`]). Call [`Elastic::forces_into`] before the next tangent
    /// product.
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
        body.fronts.forget(touched);
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
        self.refresh_squares(touched.iter().map(|&node| node as usize));
        Ok(())
    }

    /// Multiplies the zero-energy control of `nodes` with `factor`, in place of what an earlier call gave
    /// them. A cut's one-sided rows leave more to it: 3 on touched nodes, at the default of 0.1, takes
    /// 1 % from the work of a crack at 6.4 spacings; 10 takes 3 %.
    ///
    /// # Panics
    /// If a node does not exist.
    pub fn scale_control(&mut self, nodes: &[u32], factor: f64) {
        self.body.scale_control(nodes, factor);
    }
}
