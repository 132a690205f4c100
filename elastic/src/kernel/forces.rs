//! Forces and energy, in parallel over fixed chunks of nodes.

use glam::{DMat3, DVec3};

use crate::kernel::fixed::{Fixed, Table};
use crate::kernel::gather::{Record, choose_arithmetic, received, records};
use crate::kernel::inactive::Asleep;
use crate::kernel::lanes::{Block, Laws, gather};
use crate::kernel::mean;
use crate::kernel::nodes::{Model, Scratch, State};
use crate::kernel::planes::ZERO;
use crate::kernel::prestrain::Prestrain;
use crate::kernel::stale::Stale;
use crate::kernel::storage::{
    BLOCK, CHUNK, Move, Planes, Sixteen, at, both, moved, parallel, set_moves, share_out,
};
use crate::kernel::watch::{Watching, watch_node};
use crate::kernel::worst::Watch;
use crate::law::arithmetic::Arithmetic;
use crate::law::tensor::double_dot;
use crate::law::viscosity::Viscosity;

/// Chunks that an evaluation takes; of others all that the last one left is kept. `None` for all.
pub(crate) type Chosen<'a> = Option<&'a [bool]>;

fn skips(chosen: Chosen<'_>, chunk: usize) -> bool {
    chosen.is_some_and(|chosen| !chosen[chunk])
}

/// Deformation gradients, stresses, records and what a node's own row gives it. With mean dilatation all chunks are
/// evaluated. Meanwhile `beside` runs, on another thread if there is one; its result is returned.
pub(crate) fn pass_one<const L: usize>(
    (model, state, scratch): (&Model, &mut State, &mut Scratch),
    mut table: Table<'_, L>,
    (positions, forces): (&[DVec3], &mut [DVec3]),
    chosen: Chosen<'_>,
    beside: &mut (dyn FnMut() -> f64 + Send),
) -> f64 {
    let parallel = parallel(model.node_count());
    set_moves(parallel, &mut scratch.moves, |first, moves| {
        let places = positions[first..].iter().zip(&model.rest[first..]);
        for (to, (position, rest)) in moves.iter_mut().zip(places) {
            *to = moved(*position, *rest);
        }
    });
    scratch.stale.wake(&mut scratch.asleep);
    state.prestrain.pulls.clear();
    for (chunk, sum) in scratch.partial.iter_mut().enumerate() {
        if !skips(chosen, chunk) {
            *sum = 0.0;
        }
    }
    let State {
        viscosity,
        prestrain,
        watches,
        ..
    } = &mut *state;
    if model.means.is_some() {
        let result = beside();
        mean::stresses((model, state, scratch), &mut table, forces);
        return result;
    }
    let moves = &scratch.moves[..];
    let (viscosity, prestrain, fixed) = (viscosity.as_ref(), &*prestrain, table.fixed);
    let work = |chunk: usize, outputs: Outputs<'_, L>| {
        if !skips(chosen, chunk) {
            model.arch.dispatch(Stresses {
                model,
                viscosity,
                prestrain,
                fixed,
                moves,
                first: chunk * CHUNK,
                outputs,
            });
        }
    };
    let mut pass = || {
        let outputs = table
            .records
            .chunks_mut(CHUNK / BLOCK)
            .zip(table.deformation.chunks_mut(CHUNK / BLOCK))
            .zip(forces.chunks_mut(CHUNK));
        let seen = scratch
            .partial
            .iter_mut()
            .zip(&mut *watches)
            .zip(&mut scratch.asleep);
        share_out(parallel, outputs.zip(seen), work);
    };
    // What threads share out is all that there is in a step between two of the caller's passes: one that waits for
    // longer than some 10 µs goes to sleep, and takes longer than a pass to wake.
    let mut result = 0.0;
    both(parallel, &mut || result = beside(), &mut pass);
    result
}

/// What neighbours give. Meanwhile `beside` changes deformation gradients, which no row reads any more.
pub(crate) fn pass_two<const L: usize>(
    (model, scratch): (&Model, &mut Scratch),
    table: Table<'_, L>,
    forces: &mut [DVec3],
    chosen: Chosen<'_>,
    beside: &(dyn Fn(&mut [Planes]) + Sync),
) {
    let parallel = parallel(model.node_count());
    let moves = &scratch.moves[..];
    let (fixed, records) = (table.fixed, &table.records[..]);
    let mut receive = || {
        let outputs = forces.chunks_mut(CHUNK).zip(&mut scratch.partial);
        share_out(parallel, outputs, |chunk, (forces, sum)| {
            if !skips(chosen, chunk) {
                model.arch.dispatch(Received {
                    model,
                    fixed,
                    records,
                    moves,
                    first: chunk * CHUNK,
                    forces,
                    sum,
                    sign: 1.0,
                });
            }
        });
    };
    let deformation = &mut table.deformation[..];
    both(parallel, &mut || beside(deformation), &mut receive);
    scratch.stale = Stale::default();
}

/// What a chunk writes in pass one: records, deformation gradients and forces of its nodes; its part of the energy, what is
/// seen of it, and what of it sleeps.
type Outputs<'a, const L: usize> = (
    (
        (&'a mut [Sixteen<Record<L>>], &'a mut [Planes]),
        &'a mut [DVec3],
    ),
    ((&'a mut f64, &'a mut Watch), &'a mut Asleep),
);

/// Pass one for a chunk: gradients, stresses, records, and what a node's own row gives it.
struct Stresses<'a, const L: usize> {
    model: &'a Model,
    viscosity: Option<&'a Viscosity>,
    prestrain: &'a Prestrain,
    fixed: Fixed<'a, L>,
    moves: &'a [Move],
    first: usize,
    outputs: Outputs<'a, L>,
}

choose_arithmetic!(Stresses);

impl<const L: usize> Stresses<'_, L> {
    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let (model, fixed) = (self.model, self.fixed);
        let (viscosity, prestrain) = (self.viscosity, self.prestrain);
        let (((all_records, all_deformation), all_forces), seen) = self.outputs;
        let ((all_energy, all_watch), asleep) = seen;
        let mut block = Block::<L>::new();
        let mut laws = Laws::new(model);
        let mut watching = Watching::new(model);
        let mut watch = asleep.watch;
        let mut energies = ZERO;
        let outputs = all_records
            .iter_mut()
            .zip(all_deformation)
            .zip(all_forces.chunks_mut(BLOCK));
        for (at, ((records, deformation), forces)) in outputs.enumerate() {
            if asleep.holds(at) {
                forces.fill(DVec3::ZERO);
                continue;
            }
            let first = self.first + at * BLOCK;
            let count = forces.len();
            let offsets = prestrain.among(first..first + count);
            for lane in 0..count {
                let node = first + lane;
                gather::<A, L>(model, fixed, self.moves, node, lane, &mut block);
            }
            let constants = fixed.constants(first / BLOCK);
            block.gradients::<A>(constants, 1.0);
            for &node in offsets {
                block.carry(prestrain, node as usize, node as usize - first);
            }
            laws.load(model, first, count);
            block.stresses::<A>(&laws, model.logarithm);
            watching.load(model, prestrain, first, count);
            let mut singles = Watch::NOTHING;
            // Nothing strains these: what a law with memory or a retained gradient makes of that is its own.
            let is_at_rest = |node: usize| {
                model.inactive.is_unstrained(node) && viscosity.is_none() && offsets.is_empty()
            };
            if viscosity.is_some() || !block.all_hold(model, first, count) {
                for lane in 0..count {
                    let node = first + lane;
                    if viscosity.is_some() || !block.holds(model, node, lane) {
                        if is_at_rest(node) {
                            block.set_matrix(lane, DMat3::IDENTITY, DMat3::ZERO);
                            block.work[lane] = 0.0;
                            watching.skip(lane);
                            continue;
                        }
                        let f = single(model, viscosity, node, &mut block, lane);
                        singles = singles.and(watch_node((model, prestrain), node, f));
                        watching.skip(lane);
                    }
                }
            }
            watch = watch.and(singles);
            watching.see(&block.ratio, &block.bound);
            for &node in offsets {
                let (node, lane) = (node as usize, node as usize - first);
                let stress = block.matrix(&block.stress, lane);
                block.work[lane] += prestrain.excess(node, stress);
                block.pull(prestrain, node, lane);
            }
            block.records::<A>(constants);
            block.write(records);
            block.write_deformation(deformation);
            for (lane, force) in forces.iter_mut().enumerate() {
                *force = DVec3::from_array(block.own_force(lane));
            }
            for (lane, (sum, work)) in energies.iter_mut().zip(&*block.work).enumerate() {
                *sum += if lane < count { *work } else { 0.0 };
            }
            if model.inactive.are_unstrained(first..first + count)
                && viscosity.is_none()
                && offsets.is_empty()
                && forces.iter().all(|force| *force == DVec3::ZERO)
                && block.work[..count].iter().all(|work| *work == 0.0)
                && are_blank(&records.0[..count])
            {
                let seen = watching.of_block(&block.ratio, &block.bound);
                asleep.add(at, singles.and(seen));
            }
        }
        *all_energy += energies.iter().sum::<f64>();
        *all_watch = watching.worst(watch);
    }
}

/// Whether records say nothing.
fn are_blank<const L: usize>(records: &[Record<L>]) -> bool {
    let numbers = records.iter().flatten().flatten();
    numbers.fold(true, |blank, number| blank & (*number == 0.0))
}

/// Energy and stress of a node that the lanes do not hold for; returns its deformation gradient.
#[inline(never)]
fn single<const L: usize>(
    model: &Model,
    viscosity: Option<&Viscosity>,
    node: usize,
    block: &mut Block<L>,
    lane: usize,
) -> DMat3 {
    let h = block.matrix(&block.deformation, lane) - DMat3::IDENTITY;
    if model.elastic_volumes[node] == 0.0 {
        // Weak: bonds say what its deformation is.
        block.set_matrix(lane, DMat3::IDENTITY, DMat3::ZERO);
        block.work[lane] = 0.0;
        return DMat3::IDENTITY;
    }
    let f = model.deformation_gradient(node, h);
    let (energy, stress) = model.energy_and_stress(viscosity, node, f);
    let volume = model.elastic_volumes[node];
    let stress = model.seen_stress(node, f, stress) * volume;
    block.set_matrix(lane, f, stress);
    block.work[lane] = volume * energy - 0.5 * double_dot(stress, h);
    f
}

/// Pass two for a chunk: what neighbours give, with the energy of the penalty.
pub(crate) struct Received<'a, const L: usize> {
    pub(crate) model: &'a Model,
    pub(crate) fixed: Fixed<'a, L>,
    pub(crate) records: &'a [Sixteen<Record<L>>],
    pub(crate) moves: &'a [Move],
    pub(crate) first: usize,
    pub(crate) forces: &'a mut [DVec3],
    pub(crate) sum: &'a mut f64,
    /// Of the result.
    pub(crate) sign: f64,
}

choose_arithmetic!(Received);

impl<const L: usize> Received<'_, L> {
    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let mut work = 0.0;
        let read = (self.fixed, self.records);
        for (node, force) in (self.first..).zip(self.forces) {
            let given = receive::<A, L>(self.model, read, self.moves, node);
            *force = (*force + given) * self.sign;
            work += DVec3::from_array(self.moves[node]).dot(*force);
        }
        *self.sum -= 0.5 * work;
    }
}

/// Rows and what pass one wrote of them.
type Read<'a, const L: usize> = (Fixed<'a, L>, &'a [Sixteen<Record<L>>]);

/// What its neighbours give a node.
#[inline(always)]
pub(crate) fn receive<A: Arithmetic, const L: usize>(
    model: &Model,
    (fixed, all): Read<'_, L>,
    moves: &[Move],
    node: usize,
) -> DVec3 {
    if model.inactive.is_unloaded(node) && model.means.is_none() {
        return DVec3::ZERO;
    }
    let sum = records::<A, L>(model.pairs.incoming(node), all);
    let anchor = at(fixed.anchors, node);
    let force = DVec3::from_array(received::<A, L>(&sum, anchor));
    let drag = fixed.drag(node);
    force - DVec3::from_array(moves[node]) * drag
}
