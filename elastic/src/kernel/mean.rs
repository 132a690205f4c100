//! Pass one with mean dilatation: volume ratios, their means, then stresses.
//!
//! Stresses need the means, so rows are gathered twice; nothing of the first gather is kept but what
//! the means are made of.

use glam::{DMat3, DVec3};

use crate::kernel::fixed::{Fixed, Table};
use crate::kernel::gather::{Record, choose_arithmetic};
use crate::kernel::lanes::{Block, gather};
use crate::kernel::nodes::{Model, Scratch, State};
use crate::kernel::prestrain::Prestrain;
use crate::kernel::storage::{
    BLOCK, CHUNK, Move, Sixteen, gradient, parallel, set_gradient, share_out,
};
use crate::kernel::watch::watch_node;
use crate::kernel::worst::Watch;
use crate::law::arithmetic::Arithmetic;
use crate::law::tensor::{cofactor, cofactor_change, double_dot, volume_ratio};

/// Stresses and records of all nodes; see [`crate::Elastic::forces_into`].
pub(crate) fn stresses<const L: usize>(
    (model, state, scratch): (&Model, &mut State, &mut Scratch),
    table: &mut Table<'_, L>,
    forces: &mut [DVec3],
) {
    let (Some(means), Some(pressures)) = (&model.means, &mut state.pressures) else {
        return;
    };
    let prestrain = &state.prestrain;
    let parallel = parallel(model.node_count());
    let moves = &scratch.moves[..];
    let work = Work {
        model,
        table: table.fixed,
        moves,
    };
    let deformed = table.deformation.chunks_mut(CHUNK / BLOCK);
    let outputs = deformed.zip(pressures.ratios.chunks_mut(CHUNK));
    share_out(parallel, outputs, |chunk, (f, ratios)| {
        let first = chunk * CHUNK;
        work.each(first, ratios.len(), |node, h| {
            let value = deformation(model, prestrain, node, h);
            let at = node - first;
            set_gradient(f, at, value);
            ratios[at] = volume_ratio(value);
        });
    });
    let ratios = &pressures.ratios[..];
    let mean = pressures.means.chunks_mut(CHUNK);
    let outputs = mean.zip(pressures.pressures.chunks_mut(CHUNK));
    let outputs = outputs.zip(&mut scratch.partial);
    share_out(parallel, outputs, |chunk, ((mean, pressures), sum)| {
        for (node, (j, p)) in (chunk * CHUNK..).zip(mean.iter_mut().zip(pressures)) {
            let (volume, elastic) = (model.volumes[node], model.elastic_volumes[node]);
            let spread = means.spread(&model.pairs, node, ratios) / volume;
            *j = ratios[node] + spread + prestrain.mean(node);
            let [energy, slope, _] = means.law(model.material_index(node)).at(*j);
            *sum += elastic * energy;
            *p = elastic / volume * slope;
        }
    });
    let (pressures, viscosity) = (&*pressures, state.viscosity.as_ref());
    let energies = &mut scratch.partial[..];
    let records = table.records.chunks_mut(CHUNK / BLOCK);
    let outputs = records.zip(forces.chunks_mut(CHUNK)).zip(energies);
    share_out(parallel, outputs, |chunk, ((records, forces), sum)| {
        let stress = |node: usize, h: DMat3| {
            let f = deformation(model, prestrain, node, h);
            let volume = model.elastic_volumes[node];
            let (energy, stress) = model.energy_and_stress(viscosity, node, f);
            let pressure = means.pressure(
                &model.pairs,
                (node, model.volumes[node]),
                &pressures.pressures,
            );
            let stress = stress * volume + cofactor(f) * pressure;
            let mut stress = model.seen_stress(node, f, stress);
            if let Some(factor) = prestrain.factor(node) {
                stress *= factor.transpose();
            }
            (stress, volume * energy - 0.5 * double_dot(stress, h))
        };
        *sum += work.records(chunk * CHUNK, records, forces, stress);
    });
    for (chunk, watch) in state.watches.iter_mut().enumerate() {
        let nodes = chunk * CHUNK..((chunk + 1) * CHUNK).min(model.node_count());
        *watch = nodes.fold(Watch::NOTHING, |worst, node| {
            let f = gradient(table.deformation, node);
            worst.and(watch_node((model, prestrain), node, f))
        });
    }
}

/// Changes of stress and records of all nodes; see [`crate::Elastic::tangent_product_into`].
pub(crate) fn changes<const L: usize>(
    (model, state, scratch): (&Model, &State, &mut Scratch),
    table: &mut Table<'_, L>,
    own: &mut [DVec3],
) {
    let (Some(means), Some(pressures)) = (&model.means, &state.pressures) else {
        return;
    };
    let (parallel, prestrain) = (parallel(model.node_count()), &state.prestrain);
    let Scratch { moves, changes, .. } = scratch;
    let [ratios, slopes] = changes;
    let work = Work {
        model,
        table: table.fixed,
        moves,
    };
    let deformation = &table.deformation[..];
    share_out(parallel, ratios.chunks_mut(CHUNK), |chunk, ratios| {
        let mut outputs = ratios.iter_mut();
        work.each(chunk * CHUNK, outputs.len(), |node, dh| {
            if let Some(ratio) = outputs.next() {
                let f = gradient(deformation, node);
                let dh = prestrain.factor(node).map_or(dh, |factor| dh * factor);
                *ratio = double_dot(cofactor(f), model.deformation_change(node, f, dh));
            }
        });
    });
    let ratios = &ratios[..];
    share_out(parallel, slopes.chunks_mut(CHUNK), |chunk, slopes| {
        for (node, slope) in (chunk * CHUNK..).zip(slopes) {
            let (volume, law) = (model.volumes[node], means.law(model.material_index(node)));
            let dj = ratios[node] + means.spread(&model.pairs, node, ratios) / volume;
            let [_, _, u2] = law.at(pressures.means[node]);
            *slope = model.elastic_volumes[node] / volume * u2 * dj;
        }
    });
    let slopes = &slopes[..];
    let viscosity = state.viscosity.as_ref();
    let records = table.records.chunks_mut(CHUNK / BLOCK);
    let outputs = records.zip(own.chunks_mut(CHUNK));
    share_out(parallel, outputs, |chunk, (records, own)| {
        let change = |node: usize, dh: DMat3| {
            let f = gradient(deformation, node);
            let factor = prestrain.factor(node);
            let dh = factor.map_or(dh, |factor| dh * factor);
            let df = model.deformation_change(node, f, dh);
            let cof = cofactor(f);
            let volume = model.elastic_volumes[node];
            let p = means.pressure(
                &model.pairs,
                (node, model.volumes[node]),
                &pressures.pressures,
            );
            let dp = means.pressure(&model.pairs, (node, model.volumes[node]), slopes);
            let change = model.stress_change(viscosity, node, f, df) * volume
                + cof * dp
                + cofactor_change(f, df) * p;
            let change = model.seen_change(node, f, dh, change, || {
                model.energy_and_stress(viscosity, node, f).1 * volume + cof * p
            });
            let change = factor.map_or(change, |factor| change * factor.transpose());
            (change, 0.0)
        };
        work.records(chunk * CHUNK, records, own, change);
    });
}

/// `F` of a node from its displacement gradient, with what has been retained from before a cut.
fn deformation(model: &Model, prestrain: &Prestrain, node: usize, h: DMat3) -> DMat3 {
    let f = model.deformation_gradient(node, h);
    prestrain.factor(node).map_or(f, |factor| f * factor)
}

/// What all stages read.
struct Work<'a, const L: usize> {
    model: &'a Model,
    table: Fixed<'a, L>,
    moves: &'a [Move],
}

impl<const L: usize> Work<'_, L> {
    /// Gathers `count` nodes from `first` on and hands out their displacement gradients.
    fn each(&self, first: usize, count: usize, mut use_of: impl FnMut(usize, DMat3)) {
        let mut block = Block::<L>::new();
        for start in (first..first + count).step_by(BLOCK) {
            let in_block = BLOCK.min(first + count - start);
            self.gather(start, in_block, &mut block);
            for lane in 0..in_block {
                let h = block.matrix(&block.deformation, lane);
                use_of(start + lane, h);
            }
        }
    }

    /// Fills the block's sums and displacement gradients.
    fn gather(&self, first: usize, count: usize, block: &mut Block<L>) {
        self.model.arch.dispatch(Gather {
            work: self,
            first,
            count,
            block,
        });
    }

    /// Writes records and own forces of a chunk for the stresses that `stress` gives, with energies to
    /// be summed.
    fn records(
        &self,
        first: usize,
        records: &mut [Sixteen<Record<L>>],
        forces: &mut [DVec3],
        stress: impl Fn(usize, DMat3) -> (DMat3, f64),
    ) -> f64 {
        let mut block = Block::<L>::new();
        let mut sum = 0.0;
        let mut first = first;
        for (records, forces) in records.iter_mut().zip(forces.chunks_mut(BLOCK)) {
            let count = forces.len();
            self.gather(first, count, &mut block);
            for lane in 0..count {
                let h = block.matrix(&block.deformation, lane);
                let (stress, energy) = stress(first + lane, h);
                block.set_matrix(lane, h, stress);
                sum += energy;
            }
            self.model.arch.dispatch(FinishRecords {
                work: self,
                first,
                block: &mut block,
                records,
            });
            for (lane, force) in forces.iter_mut().enumerate() {
                *force = DVec3::from_array(block.own_force(lane));
            }
            first += BLOCK;
        }
        sum
    }
}

/// Sums and displacement gradients of a block.
struct Gather<'a, const L: usize> {
    work: &'a Work<'a, L>,
    first: usize,
    count: usize,
    block: &'a mut Block<L>,
}

choose_arithmetic!(Gather);

impl<const L: usize> Gather<'_, L> {
    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let Work {
            model,
            table,
            moves,
        } = *self.work;
        for lane in 0..self.count {
            gather::<A, L>(model, table, moves, self.first + lane, lane, self.block);
        }
        let constants = table.constants(self.first / BLOCK);
        self.block.gradients::<A>(constants, 0.0);
    }
}

/// Records of a block from its stresses.
struct FinishRecords<'a, const L: usize> {
    work: &'a Work<'a, L>,
    first: usize,
    block: &'a mut Block<L>,
    records: &'a mut Sixteen<Record<L>>,
}

choose_arithmetic!(FinishRecords);

impl<const L: usize> FinishRecords<'_, L> {
    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let constants = self.work.table.constants(self.first / BLOCK);
        self.block.records::<A>(constants);
        self.block.write(self.records);
    }
}
