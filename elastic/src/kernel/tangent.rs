//! Products with the tangent stiffness, of the whole body and within a part.

use glam::{DMat3, DVec3};

use crate::kernel::fixed::{Fixed, Lane, Table};
use crate::kernel::forces::{Received, receive};
use crate::kernel::gather::{Record, choose_arithmetic};
use crate::kernel::inactive::Asleep;
use crate::kernel::lanes::{Block, Laws, gather};
use crate::kernel::mean;
use crate::kernel::nodes::{Model, Scratch, State};
use crate::kernel::storage::{
    BLOCK, CHUNK, Move, Planes, Sixteen, gradient, parallel, set_moves, share_out,
};
use crate::kernel::subset::Subset;
use crate::law::arithmetic::Arithmetic;

/// Tangent product; see [`crate::Elastic::tangent_product_into`].
pub(crate) fn product<const L: usize>(
    (model, state, scratch): (&Model, &State, &mut Scratch),
    mut table: Table<'_, L>,
    vector: &[DVec3],
    product: &mut [DVec3],
) {
    let parallel = parallel(model.node_count());
    set_moves(parallel, &mut scratch.moves, |first, moves| {
        for (to, vector) in moves.iter_mut().zip(&vector[first..]) {
            *to = vector.to_array();
        }
    });
    if model.means.is_some() {
        mean::changes((model, state, scratch), &mut table, product);
    }
    let (moves, asleep) = (&scratch.moves[..], &scratch.asleep[..]);
    if model.means.is_none() {
        let (fixed, deformation) = (table.fixed, &table.deformation[..]);
        let records = table.records.chunks_mut(CHUNK / BLOCK);
        let outputs = records.zip(product.chunks_mut(CHUNK));
        share_out(parallel, outputs, |chunk, (records, own)| {
            model.arch.dispatch(Changes {
                model,
                state,
                fixed,
                deformation,
                moves,
                first: chunk * CHUNK,
                asleep: asleep[chunk],
                records,
                own,
            });
        });
    }
    let (fixed, records) = (table.fixed, &table.records[..]);
    share_out(parallel, product.chunks_mut(CHUNK), |chunk, forces| {
        model.arch.dispatch(Received {
            model,
            fixed,
            records,
            moves,
            first: chunk * CHUNK,
            forces,
            sum: &mut 0.0,
            sign: -1.0,
        });
    });
}

/// Pass one of a product for a chunk.
struct Changes<'a, const L: usize> {
    model: &'a Model,
    state: &'a State,
    fixed: Fixed<'a, L>,
    deformation: &'a [Planes],
    moves: &'a [Move],
    first: usize,
    /// What of the chunk has no records.
    asleep: Asleep,
    records: &'a mut [Sixteen<Record<L>>],
    own: &'a mut [DVec3],
}

choose_arithmetic!(Changes);

impl<const L: usize> Changes<'_, L> {
    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let mut block = Block::<L>::new();
        let mut laws = Laws::new(self.model);
        let prestrain = &self.state.prestrain;
        let viscosity = self.state.viscosity.as_ref();
        let outputs = self.records.iter_mut().zip(self.own.chunks_mut(BLOCK));
        for (at, (records, own)) in outputs.enumerate() {
            if self.asleep.holds(at) {
                own.fill(DVec3::ZERO);
                continue;
            }
            let (first, count) = (self.first + at * BLOCK, own.len());
            let offsets = prestrain.among(first..first + count);
            for lane in 0..count {
                let node = first + lane;
                gather::<A, L>(self.model, self.fixed, self.moves, node, lane, &mut block);
            }
            block.set_at(&self.deformation[first / BLOCK]);
            let constants = self.fixed.constants(first / BLOCK);
            laws.load(self.model, first, count);
            block.gradients::<A>(constants, 0.0);
            for &node in offsets {
                block.carry(prestrain, node as usize, node as usize - first);
            }
            block.stress_changes::<A>(&laws, self.model.logarithm);
            if viscosity.is_some() || !block.all_hold(self.model, first, count) {
                for lane in 0..count {
                    finish(self.model, self.state, first + lane, &mut block, lane);
                }
            }
            for &node in offsets {
                block.pull(prestrain, node as usize, node as usize - first);
            }
            block.records::<A>(constants);
            block.write(records);
            for (lane, own) in own.iter_mut().enumerate() {
                *own = DVec3::from_array(block.own_force(lane));
            }
        }
    }
}

/// Replaces the change of stress of a node that the lanes do not hold for.
#[inline(always)]
fn finish<const L: usize>(
    model: &Model,
    state: &State,
    node: usize,
    block: &mut Block<L>,
    lane: usize,
) {
    if !(state.viscosity.is_none() && block.holds(model, node, lane)) {
        single(model, state, node, block, lane);
    }
}

#[inline(never)]
fn single<const L: usize>(
    model: &Model,
    state: &State,
    node: usize,
    block: &mut Block<L>,
    lane: usize,
) {
    let viscosity = state.viscosity.as_ref();
    let f = block.matrix(&block.at, lane);
    let dh = block.matrix(&block.deformation, lane);
    if model.elastic_volumes[node] == 0.0 {
        block.set_stress(lane, DMat3::ZERO);
        return;
    }
    let df = model.deformation_change(node, f, dh);
    let change = model.stress_change(viscosity, node, f, df);
    let change = model.seen_change(node, f, dh, change, || {
        model.energy_and_stress(viscosity, node, f).1
    });
    block.set_matrix(lane, dh, change * model.elastic_volumes[node]);
}

/// Tangent product within a part; see [`crate::Elastic::tangent_product_within`].
pub(crate) fn product_within<const L: usize>(
    (model, state, scratch): (&Model, &State, &mut Scratch),
    table: Table<'_, L>,
    part: &Subset,
    vector: &[DVec3],
    out: &mut [DVec3],
) {
    if model.means.is_some() {
        let (mut whole, mut products) = (
            vec![DVec3::ZERO; model.node_count()],
            vec![DVec3::ZERO; model.node_count()],
        );
        for (&node, v) in part.nodes.iter().zip(vector) {
            whole[node as usize] = *v;
        }
        product((model, state, scratch), table, &whole, &mut products);
        for (&node, p) in part.nodes.iter().zip(out) {
            *p = products[node as usize];
        }
        return;
    }
    for &node in &part.seen {
        scratch.moves[node as usize] = [0.0; 3];
    }
    for (&node, v) in part.nodes.iter().zip(vector) {
        scratch.moves[node as usize] = v.to_array();
    }
    model.arch.dispatch(Within {
        model,
        state,
        moves: &scratch.moves,
        table,
        part,
        out,
    });
}

/// Both passes over the rows of a part.
struct Within<'a, const L: usize> {
    model: &'a Model,
    state: &'a State,
    moves: &'a [Move],
    table: Table<'a, L>,
    part: &'a Subset,
    out: &'a mut [DVec3],
}

choose_arithmetic!(Within);

impl<const L: usize> Within<'_, L> {
    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let (model, table, moves) = (self.model, self.table, self.moves);
        let mut block = Block::<L>::new();
        let mut laws = Laws::new(model);
        let mut copies = Lane::new();
        let mut next = self.part.nodes.iter().zip(&mut *self.out).peekable();
        for nodes in self.part.rows.chunks(BLOCK) {
            for (lane, &node) in nodes.iter().enumerate() {
                let node = node as usize;
                gather::<A, L>(model, table.fixed, moves, node, lane, &mut block);
                block.set_matrix_at(lane, gradient(table.deformation, node));
                table.fixed.copy_lane(node, lane, &mut copies);
                laws.load_one(model, node, lane);
            }
            let constants = table.fixed.copied(&copies);
            block.gradients::<A>(constants, 0.0);
            for (lane, &node) in nodes.iter().enumerate() {
                let prestrain = &self.state.prestrain;
                block.carry(prestrain, node as usize, lane);
            }
            block.stress_changes::<A>(&laws, model.logarithm);
            for (lane, &node) in nodes.iter().enumerate() {
                let node = node as usize;
                finish(model, self.state, node, &mut block, lane);
                block.pull(&self.state.prestrain, node, lane);
            }
            block.records::<A>(constants);
            for (lane, &node) in nodes.iter().enumerate() {
                let at = node as usize;
                table.records[at / BLOCK].0[at % BLOCK] = block.record(lane);
                if let Some((_, out)) = next.next_if(|(of, _)| **of == node) {
                    *out = DVec3::from_array(block.own_force(lane));
                }
            }
        }
        let read = (table.fixed, &table.records[..]);
        for (&node, out) in self.part.nodes.iter().zip(self.out) {
            let given = receive::<A, L>(model, read, moves, node as usize);
            *out = (*out + given) * -1.0;
        }
    }
}
