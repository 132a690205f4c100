//! A bound on the largest eigenvalue.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::fixed::Fixed;
use crate::front::Fronts;
use crate::law::outer;
use crate::model::{Elastic, with_table};
use crate::nodes::Model;
use crate::storage::Storage;

impl Elastic {
    /// Upper bound on the largest eigenvalue (1/s²) of `M⁻¹ K` at rest, without iterations.
    ///
    /// Row sums of absolute entries (Gershgorin) of the assembled small-strain stiffness with
    /// zero-energy control; fibers enter by their norm. The explicit step `2 / sqrt(bound)` is
    /// stable at small strain. Strong stretch or compression stiffens a body, so a run should
    /// estimate the eigenvalue again with [`Elastic::tangent_product_into`]. Under mean dilatation
    /// it remains a bound, since means do not stiffen. Costs about as much as 40 tangent products.
    ///
    /// # Panics
    /// If `masses` (kg) is not as long as there are nodes.
    #[must_use]
    pub fn eigenvalue_bound(&self, masses: &[f64]) -> f64 {
        assert_eq!(masses.len(), self.node_count(), "one mass per node");
        with_table!(&self.tables, table => {
            masses
                .par_iter()
                .enumerate()
                .map_init(
                    || RowBlocks::new(masses.len()),
                    |blocks, (node, mass)| {
                        blocks.assemble((&self.model, &self.state.fronts), &table.fixed, node);
                        blocks.row_sum() / mass
                    },
                )
                .reduce(|| 0.0, f64::max)
        })
    }
}

/// One block row of the stiffness matrix.
struct RowBlocks {
    /// Place in `blocks` of a column, `u32::MAX` for none.
    place: Vec<u32>,
    columns: Vec<u32>,
    blocks: Vec<DMat3>,
    /// Norm of what is not in the blocks.
    rest: f64,
}

impl RowBlocks {
    fn new(node_count: usize) -> Self {
        Self {
            place: vec![u32::MAX; node_count],
            columns: Vec::new(),
            blocks: Vec::new(),
            rest: 0.0,
        }
    }

    fn block(&mut self, column: u32) -> &mut DMat3 {
        let place = &mut self.place[column as usize];
        if *place == u32::MAX {
            *place = u32::try_from(self.blocks.len()).unwrap_or(u32::MAX - 1);
            self.columns.push(column);
            self.blocks.push(DMat3::ZERO);
        }
        &mut self.blocks[*place as usize]
    }

    fn assemble<S: Storage, const L: usize>(
        &mut self,
        (model, fronts): (&Model, &Fronts),
        fixed: &Fixed<S, L>,
        node: usize,
    ) {
        for &column in &self.columns {
            self.place[column as usize] = u32::MAX;
        }
        self.columns.clear();
        self.blocks.clear();
        self.rest = 0.0;
        let id = u32::try_from(node).unwrap_or(u32::MAX - 1);
        self.row_of((model, fronts), fixed, id, id);
        for pair in model.pairs.incoming(node) {
            self.row_of((model, fronts), fixed, pair.to, id);
        }
    }

    /// Adds the share of the energy of node `i` in the row of `node`.
    fn row_of<S: Storage, const L: usize>(
        &mut self,
        (model, fronts): (&Model, &Fronts),
        fixed: &Fixed<S, L>,
        i: u32,
        node: u32,
    ) {
        let at = i as usize;
        let mut row: Vec<_> = fixed
            .row(at, model.pairs.row(at))
            .map(|(k, w, x, g)| (k, w, x * w, g))
            .collect();
        let sums = row
            .iter()
            .fold((DVec3::ZERO, DVec3::ZERO), |(y, g), r| (y + r.2, g + r.3));
        row.push((i, 0.0, -sums.0, -sums.1));
        let found = row.iter().find(|(k, ..)| *k == node);
        let Some(&(_, weight, y, g)) = found else {
            return;
        };
        let material = model.material(at);
        let quick = 1.0 + material.prony.iter().map(|term| term.ratio).sum::<f64>();
        let volume = model.elastic_volumes[at] * quick;
        let mu = material.lame_mu() * volume;
        let lambda = (material.lame_lambda() + material.volume_constant) * volume;
        let fibers = material.fiber.map_or(0.0, |f| 4.0 * f.stiffness) * volume;
        let control = DMat3::from_diagonal(DVec3::splat(fixed.control(at))) + fronts.at_rest(at);
        let spread = if control == DMat3::ZERO {
            DVec3::ZERO
        } else {
            fixed.moment_inverse(at) * y
        };
        for &(k, _, other_offset, other) in &row {
            let normal = mu * g.dot(other);
            let block = outer(g, other) * lambda
                + outer(other, g) * mu
                + DMat3::from_diagonal(DVec3::splat(normal))
                - control * spread.dot(other_offset);
            *self.block(k) += block;
            self.rest += fibers * g.length() * other.length();
        }
        // The graph Laplacian's part of |u_ij|²: diagonal and the pair itself.
        if i == node {
            for &(k, w, ..) in &row[..row.len() - 1] {
                *self.block(k) -= control * w;
                *self.block(node) += control * w;
            }
        } else {
            *self.block(i) -= control * weight;
            *self.block(node) += control * weight;
        }
    }

    /// Largest sum of absolute entries over the three rows.
    fn row_sum(&self) -> f64 {
        let mut sums = DVec3::ZERO;
        for block in &self.blocks {
            sums += block.x_axis.abs() + block.y_axis.abs() + block.z_axis.abs();
        }
        sums.max_element() + self.rest
    }
}
