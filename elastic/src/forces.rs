//! Forces and energy, in parallel over fixed chunks of nodes.

use std::ops::Range;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::bond::Bonds;
use crate::early::Early;
use crate::fixed::Fixed;
use crate::front::Fronts;
use crate::gather::{Arithmetic, Move, Record, Sums, choose_arithmetic, received, records, sums};
use crate::inactive::Asleep;
use crate::lanes::{Block, Laws, Planes};
use crate::law::{double_dot, volume_ratio};
use crate::mean;
use crate::nodes::{Model, Scratch, State};
use crate::offset::Continuation;
use crate::planes::ZERO;
use crate::stale::Stale;
use crate::storage::{BLOCK, Number, Sixteen, Storage, at};
use crate::viscosity::Viscosity;
use crate::watch::{Watch, Watching, indicator};

/// Nodes per unit of parallel work, and per partial sum of the energy; blocks divide it.
pub(crate) const CHUNK: usize = 256;
/// Nodes per unit of work that only copies.
const COPY_CHUNK: usize = 4 * CHUNK;
/// Below this many nodes a second thread costs more than it saves.
pub(crate) const PARALLEL_NODES: usize = 1024;

/// What depends on the storage and on whether there are multipliers.
#[derive(Debug, Clone)]
pub(crate) struct Table<S: Storage, const L: usize, const R: usize> {
    /// Constant between cuts.
    pub(crate) fixed: Fixed<S, L>,
    /// `F_i` of the state last evaluated.
    pub(crate) deformation: Vec<Planes<S::Number>>,
    /// What pass one writes and pass two reads.
    pub(crate) records: Vec<Sixteen<Record<S::Number, L, R>>>,
}

impl<S: Storage, const L: usize, const R: usize> Table<S, L, R> {
    pub(crate) fn new(fixed: Fixed<S, L>, node_count: usize) -> Self {
        let blank = Sixteen([[[S::Number::ZERO; L]; R]; BLOCK]);
        let one = [S::Number::of(1.0); BLOCK];
        let zero = [S::Number::ZERO; BLOCK];
        let identity = [one, zero, zero, zero, one, zero, zero, zero, one];
        let blocks = node_count.div_ceil(BLOCK);
        Self {
            fixed,
            deformation: vec![identity; blocks],
            records: vec![blank; blocks],
        }
    }

    /// `F_i` of a node.
    pub(crate) fn gradient(&self, node: usize) -> DMat3 {
        gradient(&self.deformation, node)
    }

    /// Heap bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.fixed.bytes()
            + self.deformation.capacity() * size_of::<Planes<S::Number>>()
            + self.records.capacity() * size_of::<Sixteen<Record<S::Number, L, R>>>()
    }
}

/// A node's matrix of those stored by blocks.
pub(crate) fn gradient<T: Number>(stored: &[Planes<T>], node: usize) -> DMat3 {
    let planes = &stored[node / BLOCK];
    let rows = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|k| planes[k][node % BLOCK].wide());
    DMat3::from_cols_array(&rows).transpose()
}

/// Copies those of all nodes.
pub(crate) fn copy_gradients<T: Number>(parallel: bool, stored: &[Planes<T>], to: &mut [DMat3]) {
    let copy = |(chunk, to): (usize, &mut [DMat3])| {
        let blocks = to.chunks_mut(BLOCK);
        for (planes, nodes) in stored[chunk * (COPY_CHUNK / BLOCK)..].iter().zip(blocks) {
            for (lane, f) in nodes.iter_mut().enumerate() {
                let row =
                    |r: usize| DVec3::from_array([0, 1, 2].map(|c| planes[3 * r + c][lane].wide()));
                *f = DMat3::from_cols(row(0), row(1), row(2)).transpose();
            }
        }
    };
    if parallel {
        to.par_chunks_mut(COPY_CHUNK).enumerate().for_each(copy);
    } else {
        to.chunks_mut(COPY_CHUNK).enumerate().for_each(copy);
    }
}

/// Replaces one of them.
pub(crate) fn set_gradient<T: Number>(stored: &mut [Planes<T>], node: usize, value: DMat3) {
    let rows = value.transpose().to_cols_array();
    for (plane, value) in stored[node / BLOCK].iter_mut().zip(rows) {
        plane[node % BLOCK] = T::of(value);
    }
}

pub(crate) fn parallel(model: &Model) -> bool {
    model.node_count() >= PARALLEL_NODES && rayon::current_num_threads() > 1
}

/// Runs `work` on the numbered chunks of two slices, on the pool or in place.
///
/// Chunks are fixed and disjoint: the result does not depend on the number of threads.
pub(crate) fn chunks<A: Send, B: Send>(
    parallel: bool,
    (a, a_size): (&mut [A], usize),
    (b, b_size): (&mut [B], usize),
    work: impl Fn(usize, &mut [A], &mut [B]) + Sync,
) {
    debug_assert_eq!(
        a.len().div_ceil(a_size),
        b.len().div_ceil(b_size),
        "chunks of the same nodes"
    );
    if parallel {
        a.par_chunks_mut(a_size)
            .zip(b.par_chunks_mut(b_size))
            .enumerate()
            .with_max_len(1)
            .for_each(|(chunk, (a, b))| work(chunk, a, b));
    } else {
        let both = a.chunks_mut(a_size).zip(b.chunks_mut(b_size));
        for (chunk, (a, b)) in both.enumerate() {
            work(chunk, a, b);
        }
    }
}

/// Sets displacements (or any vectors): `fill` is given the number of the first of some of them.
pub(crate) fn set_moves(
    parallel: bool,
    moves: &mut [Move],
    fill: impl Fn(usize, &mut [Move]) + Sync,
) {
    let set = |(chunk, moves): (usize, &mut [Move])| fill(chunk * COPY_CHUNK, moves);
    if parallel {
        let chunks = moves.par_chunks_mut(COPY_CHUNK).enumerate();
        chunks.with_max_len(1).for_each(set);
    } else {
        moves.chunks_mut(COPY_CHUNK).enumerate().for_each(set);
    }
}

/// Displacement (m) of a node as passes read it.
#[inline(always)]
pub(crate) fn displacement<S: Storage>(model: &Model, positions: &[DVec3], node: usize) -> DVec3 {
    DVec3::from_array(moved::<S>(positions[node], model.rest[node]))
}

#[inline(always)]
fn moved<S: Storage>(position: DVec3, rest: DVec3) -> Move {
    let seen = |u: f64| {
        if u.abs() < S::LEAST_DISPLACEMENT {
            0.0
        } else {
            u
        }
    };
    let u = position - rest;
    [seen(u.x), seen(u.y), seen(u.z)]
}

/// What an evaluation takes of the chunks.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Stage<'a> {
    /// All, or the marked ones; of others all that the last evaluation left is kept.
    Chosen(Option<&'a [bool]>),
    /// What comes first.
    Begin(&'a Early),
    /// What that left.
    Finish(&'a Early),
}

impl Stage<'_> {
    pub(crate) const ALL: Self = Self::Chosen(None);

    fn skips_stresses(self, chunk: usize) -> bool {
        match self {
            Self::Chosen(chosen) => chosen.is_some_and(|chosen| !chosen[chunk]),
            Self::Begin(early) => !early.stresses[chunk],
            Self::Finish(early) => early.stresses[chunk],
        }
    }

    fn skips_forces(self, chunk: usize) -> bool {
        match self {
            Self::Chosen(_) => self.skips_stresses(chunk),
            Self::Begin(early) => !early.forces[chunk],
            Self::Finish(early) => early.forces[chunk],
        }
    }

    /// Nodes whose places are read now.
    fn places(self, node_count: usize) -> [Range<usize>; 2] {
        match self {
            Self::Chosen(_) => [0..node_count, 0..0],
            Self::Begin(early) => [early.known.clone(), 0..0],
            Self::Finish(early) => [0..early.known.start, early.known.end..node_count],
        }
    }
}

/// Forces and energy; see [`crate::Elastic::forces_into`]. With mean dilatation all chunks are evaluated, at once.
pub(crate) fn forces<S: Storage, const L: usize, const R: usize>(
    (model, state, scratch): (&Model, &mut State, &mut Scratch),
    table: &mut Table<S, L, R>,
    positions: &[DVec3],
    forces: &mut [DVec3],
    stage: Stage<'_>,
) -> f64 {
    let of_bonds = pass_one(
        (model, &mut *state, &mut *scratch),
        table,
        positions,
        forces,
        stage,
    );
    of_bonds + pass_two((model, state, scratch), table, forces, stage)
}

/// Deformation gradients, stresses, records and what a node's own row gives it; the energy (J) of bonds.
pub(crate) fn pass_one<S: Storage, const L: usize, const R: usize>(
    (model, state, scratch): (&Model, &mut State, &mut Scratch),
    table: &mut Table<S, L, R>,
    positions: &[DVec3],
    forces: &mut [DVec3],
    stage: Stage<'_>,
) -> f64 {
    let parallel = parallel(model);
    for nodes in stage.places(model.node_count()) {
        let (positions, rest) = (&positions[nodes.clone()], &model.rest[nodes.clone()]);
        set_moves(parallel, &mut scratch.moves[nodes], |first, moves| {
            let places = positions[first..].iter().zip(&rest[first..]);
            for (to, (position, rest)) in moves.iter_mut().zip(places) {
                *to = moved::<S>(*position, *rest);
            }
        });
    }
    if !matches!(stage, Stage::Finish(_)) {
        scratch.stale.wake(&mut scratch.asleep);
        state.continuation.pulls.clear();
    }
    for (chunk, sum) in scratch.partial.iter_mut().enumerate() {
        if !stage.skips_stresses(chunk) {
            *sum = 0.0;
        }
    }
    let begins = matches!(stage, Stage::Begin(_));
    let State {
        viscosity,
        continuation,
        watches,
        bonds,
        fronts,
        ..
    } = &mut *state;
    // What threads share out is all that there is in a step between two of the caller's passes: one that waits for
    // longer than some 10 µs goes to sleep, and takes longer than a pass to wake.
    let of_bonds = |bonds: &mut Bonds, fronts: &mut Fronts| {
        if begins {
            return 0.0;
        }
        fronts.evaluate(&model.rest, positions);
        bonds.evaluate(positions)
    };
    let energy_of_bonds;
    if model.means.is_some() {
        energy_of_bonds = of_bonds(bonds, fronts);
        mean::stresses((model, state, scratch), table, forces);
    } else {
        let moves = &scratch.moves[..];
        let rest = Rest {
            viscosity: viscosity.as_ref(),
            continuation,
        };
        let fixed = &table.fixed;
        let work = |(chunk, (((records, deformation), forces), ((sum, watch), asleep))): (
            usize,
            Slots<'_, S, L, R>,
        )| {
            if stage.skips_stresses(chunk) {
                return;
            }
            model.arch.dispatch(Stresses {
                model,
                rest,
                fixed,
                moves,
                first: chunk * CHUNK,
                outputs: (records, deformation, forces),
                sum,
                watch,
                asleep,
            });
        };
        if parallel {
            let outputs = table
                .records
                .par_chunks_mut(CHUNK / BLOCK)
                .zip(table.deformation.par_chunks_mut(CHUNK / BLOCK))
                .zip(forces.par_chunks_mut(CHUNK))
                .zip(
                    scratch
                        .partial
                        .par_iter_mut()
                        .zip(watches)
                        .zip(&mut scratch.asleep),
                )
                .enumerate()
                .with_max_len(1);
            (energy_of_bonds, ()) =
                rayon::join(|| of_bonds(bonds, fronts), || outputs.for_each(work));
        } else {
            energy_of_bonds = of_bonds(bonds, fronts);
            let outputs = table
                .records
                .chunks_mut(CHUNK / BLOCK)
                .zip(table.deformation.chunks_mut(CHUNK / BLOCK))
                .zip(forces.chunks_mut(CHUNK))
                .zip(
                    scratch
                        .partial
                        .iter_mut()
                        .zip(watches)
                        .zip(&mut scratch.asleep),
                )
                .enumerate();
            outputs.for_each(work);
        }
    }
    energy_of_bonds
}

/// What neighbours and bonds give; the energy (J) but that of bonds.
pub(crate) fn pass_two<S: Storage, const L: usize, const R: usize>(
    (model, state, scratch): (&Model, &mut State, &mut Scratch),
    table: &mut Table<S, L, R>,
    forces: &mut [DVec3],
    stage: Stage<'_>,
) -> f64 {
    let parallel = parallel(model);
    let State { bonds, fronts, .. } = state;
    let moves = &scratch.moves[..];
    let receive = |forces: &mut [DVec3], partial: &mut [f64], (fixed, records): (&_, &[_])| {
        chunks(
            parallel,
            (forces, CHUNK),
            (partial, 1),
            |chunk, forces, sum| {
                if stage.skips_forces(chunk) {
                    return;
                }
                model.arch.dispatch(Received {
                    model,
                    fixed,
                    records,
                    moves,
                    first: chunk * CHUNK,
                    forces,
                    sum: &mut sum[0],
                    sign: 1.0,
                });
            },
        );
    };
    let read = (&table.fixed, &table.records[..]);
    let deformation = &mut table.deformation[..];
    if matches!(stage, Stage::Begin(_)) {
        receive(forces, &mut scratch.partial, read);
        return 0.0;
    }
    let mut means = || bonds.set_gradients(deformation);
    if parallel {
        rayon::join(means, || receive(forces, &mut scratch.partial, read));
    } else {
        means();
        receive(forces, &mut scratch.partial, read);
    }
    scratch.stale = Stale::default();
    let runs = (&mut scratch.partial[..], CHUNK);
    fronts.add_forces(forces, runs);
    bonds.add_forces(forces);
    scratch.partial.iter().sum()
}

/// Records, deformation gradients and forces of a chunk, its part of the energy, what is seen of it, and what
/// of it sleeps.
type Slots<'a, S, const L: usize, const R: usize> = (
    (
        (
            &'a mut [Sixteen<Record<<S as Storage>::Number, L, R>>],
            &'a mut [Planes<<S as Storage>::Number>],
        ),
        &'a mut [DVec3],
    ),
    ((&'a mut f64, &'a mut Watch), &'a mut Asleep),
);

/// What stresses follow from besides deformation gradients.
#[derive(Clone, Copy)]
pub(crate) struct Rest<'a> {
    pub(crate) viscosity: Option<&'a Viscosity>,
    pub(crate) continuation: &'a Continuation,
}

/// What a chunk writes in pass one.
type Outputs<'a, S, const L: usize, const R: usize> = (
    &'a mut [Sixteen<Record<<S as Storage>::Number, L, R>>],
    &'a mut [Planes<<S as Storage>::Number>],
    &'a mut [DVec3],
);

/// Pass one for a chunk: gradients, stresses, records, and what a node's own row gives it.
struct Stresses<'a, S: Storage, const L: usize, const R: usize> {
    model: &'a Model,
    rest: Rest<'a>,
    fixed: &'a Fixed<S, L>,
    moves: &'a [Move],
    first: usize,
    outputs: Outputs<'a, S, L, R>,
    sum: &'a mut f64,
    watch: &'a mut Watch,
    asleep: &'a mut Asleep,
}

choose_arithmetic!(Stresses<S, L, R>);

impl<S: Storage, const L: usize, const R: usize> Stresses<'_, S, L, R> {
    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let (model, fixed) = (self.model, self.fixed);
        let (all_records, all_deformation, all_forces) = self.outputs;
        let mut block = Block::<L>::new();
        let mut laws = Laws::new(model);
        let Rest {
            viscosity,
            continuation,
        } = self.rest;
        let mut watching = Watching::new(model);
        let asleep = self.asleep;
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
            let offsets = continuation.among(first..first + count);
            for lane in 0..count {
                let node = first + lane;
                gather::<A, S, L>(model, fixed, self.moves, node, lane, &mut block);
            }
            let constants = fixed.constants(first / BLOCK);
            block.gradients::<A, _>(constants, 1.0);
            for &node in offsets {
                continuation.carry(node as usize, node as usize - first, &mut block);
            }
            laws.load(model, first, count);
            block.stresses::<A>(&laws, model.logarithm);
            watching.load(model, continuation, first, count);
            let mut singles = Watch::NOTHING;
            // Nothing strains these: what a law with memory or a carried-over gradient makes of that is its own.
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
                        singles = singles.and(watch_node((model, continuation), node, f));
                        watching.skip(lane);
                    }
                }
            }
            watch = watch.and(singles);
            watching.see(&block.ratio, &block.bound);
            for &node in offsets {
                let (node, lane) = (node as usize, node as usize - first);
                let stress = block.matrix(&block.stress, lane);
                block.work[lane] += continuation.excess(node, stress);
                continuation.pull(node, lane, &mut block);
            }
            block.records::<A, _>(constants);
            block.write(records);
            block.write_deformation(deformation);
            for (lane, force) in forces.iter_mut().enumerate() {
                *force = DVec3::from_array(block.own_force(lane));
            }
            for (lane, (sum, work)) in energies.iter_mut().zip(&block.work).enumerate() {
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
        let watch = watching.worst(watch);
        *self.sum += energies.iter().sum::<f64>();
        *self.watch = watch;
    }
}

/// Sums of one node into a lane.
#[inline(always)]
pub(crate) fn gather<A: Arithmetic, S: Storage, const L: usize>(
    model: &Model,
    fixed: &Fixed<S, L>,
    moves: &[Move],
    node: usize,
    lane: usize,
    block: &mut Block<L>,
) {
    // Mean pressures reach nodes without strain, whose own row then counts.
    let found: Sums<L> = if model.inactive.is_unstrained(node) && model.means.is_none() {
        [[0.0; L]; 4]
    } else {
        let row = model.pairs.row(node);
        sums::<A, S::Place, L>(node, row, &fixed.anchors, &fixed.unit, moves)
    };
    let anchor = at(&fixed.anchors, node);
    block.take(lane, &found, (anchor, &fixed.unit), &moves[node]);
}

/// Whether records say nothing.
fn are_blank<T: Number, const L: usize, const R: usize>(records: &[Record<T, L, R>]) -> bool {
    let numbers = records.iter().flatten().flatten();
    numbers.fold(true, |blank, number| blank & (*number == T::ZERO))
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

/// What is watched of a node.
pub(crate) fn watch_node(
    (model, continuation): (&Model, &Continuation),
    node: usize,
    f: DMat3,
) -> Watch {
    if model.elastic_volumes[node] > 0.0 {
        Watch {
            ratio: volume_ratio(f),
            stiffness: indicator(model, node, f) * continuation.gain(node),
        }
    } else {
        Watch::NOTHING
    }
}

/// Pass two for a chunk: what neighbours give, with the energy of the penalty.
pub(crate) struct Received<'a, S: Storage, const L: usize, const R: usize> {
    pub(crate) model: &'a Model,
    pub(crate) fixed: &'a Fixed<S, L>,
    pub(crate) records: &'a [Sixteen<Record<S::Number, L, R>>],
    pub(crate) moves: &'a [Move],
    pub(crate) first: usize,
    pub(crate) forces: &'a mut [DVec3],
    pub(crate) sum: &'a mut f64,
    /// Of the result.
    pub(crate) sign: f64,
}

choose_arithmetic!(Received<S, L, R>);

impl<S: Storage, const L: usize, const R: usize> Received<'_, S, L, R> {
    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let signed = self.fixed.signed_unit();
        let mut work = 0.0;
        let read = (self.fixed, self.records);
        for (node, force) in (self.first..).zip(self.forces) {
            let given = receive::<A, S, L, R>(self.model, read, &signed, self.moves, node);
            *force = (*force + given) * self.sign;
            work += DVec3::from_array(self.moves[node]).dot(*force);
        }
        *self.sum -= 0.5 * work;
    }
}

/// Rows and what pass one wrote of them.
type Read<'a, S, const L: usize, const R: usize> = (
    &'a Fixed<S, L>,
    &'a [Sixteen<Record<<S as Storage>::Number, L, R>>],
);

/// What its neighbours give a node; `signed` are the units of [`Fixed::signed_unit`].
#[inline(always)]
pub(crate) fn receive<A: Arithmetic, S: Storage, const L: usize, const R: usize>(
    model: &Model,
    (fixed, all): Read<'_, S, L, R>,
    signed: &[f64; L],
    moves: &[Move],
    node: usize,
) -> DVec3 {
    if model.inactive.is_unloaded(node) && model.means.is_none() {
        return DVec3::ZERO;
    }
    let sum = records::<A, S::Number, L, R>(model.pairs.incoming(node), all);
    let anchor = at(&fixed.anchors, node);
    let force = DVec3::from_array(received::<A, S::Place, L, R>(&sum, anchor, signed));
    let drag = fixed.drag(node);
    force - DVec3::from_array(moves[node]) * drag
}
