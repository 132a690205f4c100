//! A bound on the largest eigenvalue.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::body::Body;
use crate::front;
use crate::kernel::Lanes;
use crate::law::outer;
use crate::model::{Elastic, with_table};
use crate::rows::Rows;

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
        let fronts = front::row_sums(&self.body);
        with_table!(&self.pairs, table => {
            masses
                .par_iter()
                .enumerate()
                .map_init(
                    || RowBlocks::new(masses.len()),
                    |blocks, (node, mass)| {
                        blocks.assemble(&self.body, &table.rows, node);
                        (blocks.row_sum() + fronts.get(node).unwrap_or(&0.0)) / mass
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

    fn assemble<L: Lanes>(&mut self, body: &Body, rows: &Rows<L>, node: usize) {
        for &column in &self.columns {
            self.place[column as usize] = u32::MAX;
        }
        self.columns.clear();
        self.blocks.clear();
        self.rest = 0.0;
        let id = u32::try_from(node).unwrap_or(u32::MAX - 1);
        let own = (body.self_gradients[node], -body.offset(node));
        self.row_of(body, rows, id, own, id, 0.0);
        let incoming = rows.incoming(node);
        for (&source, pair) in incoming.indices.iter().zip(incoming.pairs) {
            let x = body.rest[node] - body.rest[source as usize];
            let z = (L::gradient(pair), L::offset(pair, x));
            self.row_of(body, rows, source, z, id, L::weight(pair));
        }
    }

    /// Adds the share of the energy of node `i` in the row of `node`, whose gradient and offset there
    /// are `g` and `y`.
    fn row_of<L: Lanes>(
        &mut self,
        body: &Body,
        rows: &Rows<L>,
        i: u32,
        (g, y): (DVec3, DVec3),
        node: u32,
        weight: f64,
    ) {
        let at = i as usize;
        let material = body.material(at);
        let quick = 1.0 + material.prony.iter().map(|term| term.ratio).sum::<f64>();
        let volume = body.elastic_volumes[at] * quick;
        let mu = material.lame_mu() * volume;
        let lambda = (material.lame_lambda() + material.volume_constant) * volume;
        let fibers = material.fiber.map_or(0.0, |f| 4.0 * f.stiffness) * volume;
        let control = body.control(at);
        let spread = body.moment_inverse(at) * y * control;
        let mut add = |k: u32, other: DVec3, other_offset: DVec3| {
            let normal = mu * g.dot(other) - spread.dot(other_offset);
            let block = outer(g, other) * lambda
                + outer(other, g) * mu
                + DMat3::from_diagonal(DVec3::splat(normal));
            *self.block(k) += block;
            self.rest += fibers * g.length() * other.length();
        };
        let row = rows.row(at);
        for (&k, pair) in row.indices.iter().zip(row.pairs) {
            let x = body.rest[k as usize] - body.rest[at];
            add(k, L::gradient(pair), L::offset(pair, x));
        }
        add(i, body.self_gradients[at], -body.offset(at));
        // The graph Laplacian's part of |u_ij|²: diagonal and the pair itself.
        let scalar = |s: f64| DMat3::from_diagonal(DVec3::splat(s));
        if i == node {
            let incoming = rows.incoming(at);
            for (&k, pair) in incoming.indices.iter().zip(incoming.pairs) {
                let w = control * L::weight(pair);
                *self.block(k) -= scalar(w);
                *self.block(node) += scalar(w);
            }
        } else {
            *self.block(i) -= scalar(control * weight);
            *self.block(node) += scalar(control * weight);
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
