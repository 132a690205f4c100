//! The passes over nodes: forces and tangent products, in parallel over fixed chunks.

use glam::{DMat3, DVec3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::body::Body;
use crate::dilatation::MeanDilatation;
use crate::kernel::{Lanes, Real};
use crate::law::{cofactor, cofactor_change, double_dot, volume_ratio};
use crate::part::Part;
use crate::plain::{BLOCK, Block, Plane};
use crate::rows::Rows;
use crate::watch::{Watch, indicator};

/// Nodes per unit of parallel work, and per partial sum of the energy.
pub(crate) const CHUNK: usize = 256;
/// Nodes per unit of work that only copies.
pub(crate) const PARALLEL_CHUNK: usize = 8 * CHUNK;
/// Below this many nodes a second thread costs more than it saves.
pub(crate) const PARALLEL_NODES: usize = 1024;

/// Rows and the 3×6 matrices that pass one writes and pass two reads.
#[derive(Debug, Clone)]
pub(crate) struct Table<L: Lanes> {
    pub(crate) rows: Rows<L>,
    pub(crate) matrices: Vec<L::Matrix>,
}

/// Runs `work` over nodes with their places in three output slices, on the pool or in place.
///
/// What `work` returns is added to the node's chunk in `partial`, in the order of the nodes;
/// outputs are disjoint: the result does not depend on the number of threads.
#[inline(always)]
fn each<A: Send, B: Send, C: Send>(
    (arch, parallel): (Arch, bool),
    (a, b, c): (&mut [A], &mut [B], &mut [C]),
    partial: &mut [f64],
    work: impl Fn(usize, &mut A, &mut B, &mut C) -> f64 + Sync,
) {
    let chunk = |(chunk, (((a, b), c), sum)): Chunk<'_, A, B, C>| {
        arch.dispatch(
            #[inline(always)]
            || {
                for (k, ((a, b), c)) in a.iter_mut().zip(b).zip(c).enumerate() {
                    *sum += work(chunk * CHUNK + k, a, b, c);
                }
            },
        );
    };
    if parallel {
        a.par_chunks_mut(CHUNK)
            .zip(b.par_chunks_mut(CHUNK))
            .zip(c.par_chunks_mut(CHUNK))
            .zip(partial)
            .enumerate()
            .for_each(chunk);
    } else {
        a.chunks_mut(CHUNK)
            .zip(b.chunks_mut(CHUNK))
            .zip(c.chunks_mut(CHUNK))
            .zip(partial)
            .enumerate()
            .for_each(chunk);
    }
}

/// A chunk's number, outputs and partial sum.
type Chunk<'a, A, B, C> = (
    usize,
    (((&'a mut [A], &'a mut [B]), &'a mut [C]), &'a mut f64),
);

/// In place of an output slice that a pass does not need.
fn nothing(body: &Body) -> Vec<()> {
    vec![(); body.node_count()]
}

fn parallel(body: &Body) -> bool {
    body.node_count() >= PARALLEL_NODES && rayon::current_num_threads() > 1
}

/// Forces and energy; see [`crate::Elastic::forces_into`].
pub(crate) fn forces<L: Lanes>(
    body: &mut Body,
    table: &mut Table<L>,
    positions: &[DVec3],
    forces: &mut [DVec3],
) -> f64 {
    let (arch, parallel) = (table.rows.arch, parallel(body));
    let rest = std::mem::take(&mut body.rest);
    let least = L::Number::LEAST_DISPLACEMENT;
    body.set_moves(parallel, |node| {
        let u = (positions[node] - rest[node]).to_array();
        DVec3::from_array(u.map(|u| if u.abs() < least { 0.0 } else { u }))
    });
    body.rest = rest;
    let mut deformation = std::mem::take(&mut body.deformation);
    let mut partial = std::mem::take(&mut body.partial_energies);
    let mut watches = std::mem::take(&mut body.watches);
    partial.fill(0.0);
    if body.dilatation.is_some() {
        mean_stress_pass(body, table, &mut deformation, &mut partial, forces);
        watch_pass(body, &deformation, &mut watches);
    } else {
        let matrices = &mut table.matrices[..];
        let outputs = (matrices, &mut deformation[..], &mut *forces);
        let sums = (&mut partial[..], &mut watches[..]);
        stress_pass(body, &table.rows, parallel, outputs, sums);
    }
    body.watches = watches;
    body.deformation = deformation;
    let (rows, matrices) = (&table.rows, &table.matrices);
    let (mut a, mut b) = (nothing(body), nothing(body));
    let reader = &*body;
    let outputs = (&mut *forces, &mut a[..], &mut b[..]);
    each(
        (arch, parallel),
        outputs,
        &mut partial,
        #[inline(always)]
        |node, force, (), ()| {
            *force += gather_force(reader, rows, matrices, node);
            -0.5 * reader.displacement(node).dot(*force)
        },
    );
    let energy: f64 = partial.iter().sum();
    body.partial_energies = partial;
    energy
        + body
            .bonds
            .add_forces(positions, forces, &mut body.deformation)
}

/// What is watched, where no pass over nodes sees it on its way.
fn watch_pass(body: &Body, deformation: &[DMat3], watches: &mut [Watch]) {
    for (chunk, watch) in watches.iter_mut().enumerate() {
        let first = chunk * CHUNK;
        let nodes = deformation[first..].iter().take(CHUNK).enumerate();
        *watch = nodes.fold(Watch::NOTHING, |worst, (k, f)| {
            worst.and(watch_node(body, first + k, *f))
        });
    }
}

fn watch_node(body: &Body, node: usize, f: DMat3) -> Watch {
    if body.elastic_volumes[node] > 0.0 {
        Watch {
            ratio: volume_ratio(f),
            stiffness: indicator(body, node, f),
        }
    } else {
        Watch::NOTHING
    }
}

/// Pass one: gradients, stresses, and what a node's own row gives it, in blocks of nodes.
fn stress_pass<L: Lanes>(
    body: &Body,
    rows: &Rows<L>,
    parallel: bool,
    (matrices, deformation, forces): (&mut [L::Matrix], &mut [DMat3], &mut [DVec3]),
    (partial, watches): (&mut [f64], &mut [Watch]),
) {
    let blocks = |(chunk, slots): (usize, Slots<'_, L>)| {
        let first = chunk * CHUNK;
        rows.arch.dispatch(StressChunk {
            body,
            rows,
            first,
            slots,
        });
    };
    if parallel {
        matrices
            .par_chunks_mut(CHUNK)
            .zip(deformation.par_chunks_mut(CHUNK))
            .zip(forces.par_chunks_mut(CHUNK))
            .zip(partial.par_iter_mut().zip(watches))
            .enumerate()
            .for_each(blocks);
    } else {
        matrices
            .chunks_mut(CHUNK)
            .zip(deformation.chunks_mut(CHUNK))
            .zip(forces.chunks_mut(CHUNK))
            .zip(partial.iter_mut().zip(watches))
            .enumerate()
            .for_each(blocks);
    }
}

/// Outputs of a chunk of [`stress_pass`], its partial sum, and what it watches.
type Slots<'a, L> = (
    (
        (&'a mut [<L as Lanes>::Matrix], &'a mut [DMat3]),
        &'a mut [DVec3],
    ),
    (&'a mut f64, &'a mut Watch),
);

/// [`stress_pass`] for one chunk.
struct StressChunk<'a, L: Lanes> {
    body: &'a Body,
    rows: &'a Rows<L>,
    first: usize,
    slots: Slots<'a, L>,
}

impl<L: Lanes> WithSimd for StressChunk<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (((matrices, deformation), forces), (sum, watch)) = self.slots;
        *watch = Watch::NOTHING;
        let mut block = Block::new();
        let mut first = self.first;
        for ((matrices, deformation), forces) in matrices
            .chunks_mut(BLOCK)
            .zip(deformation.chunks_mut(BLOCK))
            .zip(forces.chunks_mut(BLOCK))
        {
            let outputs = (matrices, deformation, forces);
            let (energy, seen) = stress_block(self.body, self.rows, first, &mut block, outputs);
            *sum += energy;
            *watch = watch.and(seen);
            first += BLOCK;
        }
    }
}

/// [`stress_pass`] for the nodes from `first` on; returns their part of the energy and what is
/// watched of them.
#[inline(always)]
fn stress_block<L: Lanes>(
    body: &Body,
    rows: &Rows<L>,
    first: usize,
    block: &mut Block,
    (matrices, deformation, forces): (&mut [L::Matrix], &mut [DMat3], &mut [DVec3]),
) -> (f64, Watch) {
    let count = matrices.len();
    for lane in 0..count {
        let (mut h, s) = gather(body, rows, first + lane);
        if let Some(offset) = body.continuation.transposed(first + lane) {
            h += offset;
        }
        for (plane, value) in block.gradient.iter_mut().zip(h.to_cols_array()) {
            plane[lane] = value;
        }
        if L::CONTROLLED {
            for (plane, value) in block.offset.iter_mut().zip(s.to_cols_array()) {
                plane[lane] = value;
            }
        }
    }
    match (L::CONTROLLED, body.logarithm) {
        (true, true) => block.evaluate::<true, true>(body, first, count),
        (true, false) => block.evaluate::<true, false>(body, first, count),
        (false, true) => block.evaluate::<false, true>(body, first, count),
        (false, false) => block.evaluate::<false, false>(body, first, count),
    }
    let take = |planes: &[Plane; 9], lane: usize| {
        DMat3::from_cols_array(&std::array::from_fn(|i| planes[i][lane]))
    };
    let (mut sum, mut watch) = (0.0, Watch::NOTHING);
    let watched = !body.gradient_squares.is_empty();
    for (lane, ((matrix, f), force)) in matrices.iter_mut().zip(deformation).zip(forces).enumerate()
    {
        let node = first + lane;
        let h = take(&block.gradient, lane);
        sum += if block.holds(body, node, lane) {
            *f = (DMat3::IDENTITY + h).transpose();
            *matrix = L::matrix(take(&block.stress, lane), take(&block.control, lane));
            *force = DVec3::from_array(std::array::from_fn(|r| block.force[r][lane]));
            let volume = body.elastic_volumes[node];
            if volume > 0.0 {
                watch.ratio = watch.ratio.min(block.ratio[lane]);
                if watched {
                    let stiffness = volume * body.gradient_squares[node] * block.bound[lane];
                    watch.stiffness = watch.stiffness.max(stiffness);
                }
            }
            let excess = body.continuation.excess(node, take(&block.stress, lane));
            block.work[lane] + excess
        } else {
            *f = body.deformation_gradient(node, h.transpose());
            let (energy, stress) = body.energy_and_stress(node, *f);
            let volume = body.elastic_volumes[node];
            let stress = body.seen_stress(node, *f, stress).transpose() * -volume;
            let control = body.control_stress(node, take(&block.offset, lane));
            *matrix = L::matrix(stress, control);
            *force = own_force(body, node, stress, control);
            watch = watch.and(watch_node(body, node, *f));
            let excess = body.continuation.excess(node, stress);
            volume * energy + 0.5 * double_dot(stress, h) + excess
        };
    }
    (sum, watch)
}

/// Tangent product; see [`crate::Elastic::tangent_product_into`].
pub(crate) fn tangent_product<L: Lanes>(
    body: &mut Body,
    table: &mut Table<L>,
    vector: &[DVec3],
    product: &mut [DVec3],
) {
    let (arch, parallel) = (table.rows.arch, parallel(body));
    body.set_moves(parallel, |node| vector[node]);
    let mut partial = std::mem::take(&mut body.partial_energies);
    let (mut a, mut b) = (nothing(body), nothing(body));
    if body.dilatation.is_some() {
        mean_change_pass(body, table, &mut partial, product);
    } else {
        let (rows, matrices) = (&table.rows, &mut table.matrices[..]);
        let body = &*body;
        let outputs = (matrices, &mut *product, &mut a[..]);
        each(
            (arch, parallel),
            outputs,
            &mut partial,
            #[inline(always)]
            |node, matrix, product, ()| {
                (*matrix, *product) = node_change(body, rows, node);
                0.0
            },
        );
    }
    let (rows, matrices) = (&table.rows, &table.matrices);
    let reader = &*body;
    let outputs = (&mut *product, &mut a[..], &mut b[..]);
    each(
        (arch, parallel),
        outputs,
        &mut partial,
        #[inline(always)]
        |node, product, (), ()| {
            *product = -(*product + gather_force(reader, rows, matrices, node));
            0.0
        },
    );
    body.partial_energies = partial;
    body.bonds.add_product(vector, product);
}

/// What a node's matrix and own force change by with the vectors set, without mean dilatation.
#[inline(always)]
fn node_change<L: Lanes>(body: &Body, rows: &Rows<L>, node: usize) -> (L::Matrix, DVec3) {
    let (dh, ds) = gather(body, rows, node);
    let f = body.deformation[node];
    let change = if body.is_plain(node) {
        body.law_shared(node).neo_hookean_change(f.transpose(), dh)
    } else {
        let dh = dh.transpose();
        let df = body.deformation_change(node, f, dh);
        let change = body.stress_change(node, f, df);
        let stress = || body.energy_and_stress(node, f).1;
        seen_change(body, node, f, dh, change, stress).transpose()
    };
    let change = change * -body.elastic_volumes[node];
    let control = body.control_stress(node, ds);
    let own = own_force(body, node, change, control);
    (L::matrix(change, control), own)
}

/// Tangent product within a part; see [`crate::Elastic::tangent_product_within`].
pub(crate) fn tangent_product_within<L: Lanes>(
    body: &mut Body,
    table: &mut Table<L>,
    part: &Part,
    vector: &[DVec3],
    product: &mut [DVec3],
) {
    if body.dilatation.is_some() {
        let (mut whole, mut products) = (
            vec![DVec3::ZERO; body.node_count()],
            vec![DVec3::ZERO; body.node_count()],
        );
        for (&node, v) in part.nodes.iter().zip(vector) {
            whole[node as usize] = *v;
        }
        tangent_product(body, table, &whole, &mut products);
        for (&node, p) in part.nodes.iter().zip(product) {
            *p = products[node as usize];
        }
        return;
    }
    for &node in &part.seen {
        body.set_move(node as usize, DVec3::ZERO);
    }
    for (&node, v) in part.nodes.iter().zip(vector) {
        body.set_move(node as usize, *v);
    }
    let (body, rows, matrices) = (&*body, &table.rows, &mut table.matrices);
    rows.arch.dispatch(
        #[inline(always)]
        || {
            let mut next = part.nodes.iter().zip(&mut *product).peekable();
            for &node in &part.rows {
                let (matrix, own) = node_change(body, rows, node as usize);
                matrices[node as usize] = matrix;
                if let Some((_, product)) = next.next_if(|(at, _)| **at == node) {
                    *product = own;
                }
            }
            for (&node, product) in part.nodes.iter().zip(&mut *product) {
                *product = -(*product + gather_force(body, rows, matrices, node as usize));
            }
        },
    );
}

/// `(sum_j u_ij ⊗ g_ij)ᵀ` and `(sum_j u_ij ⊗ y_ij)ᵀ`: the rows of the sums as columns.
#[inline(always)]
fn gather<L: Lanes>(body: &Body, rows: &Rows<L>, node: usize) -> (DMat3, DMat3) {
    if body.still.is_unstrained(node) {
        return (DMat3::ZERO, DMat3::ZERO);
    }
    L::gather_gradient(rows.row(node), L::states(body))
}

/// What its neighbours give a node.
#[inline(always)]
fn gather_force<L: Lanes>(
    body: &Body,
    rows: &Rows<L>,
    matrices: &[L::Matrix],
    node: usize,
) -> DVec3 {
    // Mean pressures reach one node further than strains.
    if body.still.is_unloaded(node) && body.dilatation.is_none() {
        return DVec3::ZERO;
    }
    L::gather_force(rows.incoming(node), L::states(body), matrices)
}

/// What a node's own row gives itself, from the transposes of `-V P` and `c H`.
#[inline(always)]
fn own_force(body: &Body, node: usize, stress: DMat3, control: DMat3) -> DVec3 {
    let (g, y) = (body.self_gradients[node], body.offset(node));
    let along = |p: DVec3, s: DVec3| p.dot(g) - s.dot(y);
    DVec3::new(
        along(stress.x_axis, control.x_axis),
        along(stress.y_axis, control.y_axis),
        along(stress.z_axis, control.z_axis),
    )
}

#[inline(always)]
fn seen_change(
    body: &Body,
    node: usize,
    f: DMat3,
    dh: DMat3,
    change: DMat3,
    stress: impl FnOnce() -> DMat3,
) -> DMat3 {
    match body.span(node) {
        None => change,
        Some(span) => span.project_change(f, dh, stress(), change),
    }
}

/// Pass one with mean dilatation: gradients, then mean volume ratios, then stresses.
fn mean_stress_pass<L: Lanes>(
    body: &mut Body,
    table: &mut Table<L>,
    deformation: &mut [DMat3],
    partial: &mut [f64],
    forces: &mut [DVec3],
) {
    let (arch, parallel) = (table.rows.arch, parallel(body));
    let Some(mut mean) = body.dilatation.take() else {
        return;
    };
    let reader = &*body;
    let (rows, matrices) = (&table.rows, &mut table.matrices[..]);
    let outputs = (
        &mut *deformation,
        &mut mean.controls[..],
        &mut mean.ratios[..],
    );
    each(
        (arch, parallel),
        outputs,
        partial,
        #[inline(always)]
        |node, f, control, ratio| {
            let (h, s) = gather(reader, rows, node);
            let offset = reader.continuation.transposed(node);
            let h = h + offset.unwrap_or(DMat3::ZERO);
            *f = reader.deformation_gradient(node, h.transpose());
            *control = reader.control_stress(node, s);
            *ratio = volume_ratio(*f);
            0.0
        },
    );
    let mut means = std::mem::take(&mut mean.means);
    let mut pressures = std::mem::take(&mut mean.pressures);
    let mut none = nothing(reader);
    let outputs = (&mut means[..], &mut pressures[..], &mut none[..]);
    each(
        (arch, parallel),
        outputs,
        partial,
        #[inline(always)]
        |node, j, pressure, ()| {
            let (volume, elastic) = (reader.volumes[node], reader.elastic_volumes[node]);
            *j = mean.ratios[node] + mean.spread(rows, node, &mean.ratios) / volume;
            let [u, u1, _] = mean.laws[reader.material_index(node)].at(*j);
            *pressure = elastic / volume * u1;
            elastic * u
        },
    );
    mean.means = means;
    mean.pressures = pressures;
    let outputs = (matrices, forces, &mut none[..]);
    each(
        (arch, parallel),
        outputs,
        partial,
        #[inline(always)]
        |node, matrix, force, ()| {
            let f = deformation[node];
            let volume = reader.elastic_volumes[node];
            let (energy, stress) = reader.energy_and_stress(node, f);
            let pressure = mean_pressure(reader, &mean, rows, node);
            let stress = stress * volume + cofactor(f) * pressure;
            let stress = -reader.seen_stress(node, f, stress).transpose();
            let control = mean.controls[node];
            *matrix = L::matrix(stress, control);
            *force = own_force(reader, node, stress, control);
            let h = reader.displacement_gradient(node, f);
            let excess = reader.continuation.excess(node, stress);
            volume * energy + 0.5 * double_dot(stress, h.transpose()) + excess
        },
    );
    body.dilatation = Some(mean);
}

/// `V_j p_j = sum_i s_ij V_i_el / V_i U'(J̄_i)`.
fn mean_pressure<L: Lanes>(body: &Body, mean: &MeanDilatation, rows: &Rows<L>, node: usize) -> f64 {
    body.volumes[node] * mean.pressures[node] + mean.spread(rows, node, &mean.pressures)
}

/// Pass one of a tangent product with mean dilatation.
fn mean_change_pass<L: Lanes>(
    body: &mut Body,
    table: &mut Table<L>,
    partial: &mut [f64],
    product: &mut [DVec3],
) {
    let (arch, parallel) = (table.rows.arch, parallel(body));
    let Some(mut mean) = body.dilatation.take() else {
        return;
    };
    let reader = &*body;
    let (rows, matrices) = (&table.rows, &mut table.matrices[..]);
    // The change of F waits where the forces kept their control part; the present one follows from
    // a second gather of the same row.
    let mut changes = std::mem::take(&mut mean.controls);
    let mut ratios = std::mem::take(&mut mean.ratios);
    let mut none = nothing(reader);
    let outputs = (&mut changes[..], &mut ratios[..], &mut none[..]);
    each(
        (arch, parallel),
        outputs,
        partial,
        #[inline(always)]
        |node, dh, ratio, ()| {
            let f = reader.deformation[node];
            *dh = gather(reader, rows, node).0.transpose();
            *ratio = double_dot(cofactor(f), reader.deformation_change(node, f, *dh));
            0.0
        },
    );
    let mut pressures = std::mem::take(&mut mean.pressure_changes);
    let mut more = nothing(reader);
    let outputs = (&mut pressures[..], &mut none[..], &mut more[..]);
    each(
        (arch, parallel),
        outputs,
        partial,
        #[inline(always)]
        |node, pressure, (), ()| {
            let volume = reader.volumes[node];
            let dj = ratios[node] + mean.spread(rows, node, &ratios) / volume;
            let [_, _, u2] = mean.laws[reader.material_index(node)].at(mean.means[node]);
            *pressure = reader.elastic_volumes[node] / volume * u2 * dj;
            0.0
        },
    );
    let outputs = (matrices, product, &mut none[..]);
    each(
        (arch, parallel),
        outputs,
        partial,
        #[inline(always)]
        |node, matrix, product, ()| {
            let (f, dh) = (reader.deformation[node], changes[node]);
            let df = reader.deformation_change(node, f, dh);
            let cof = cofactor(f);
            let volume = reader.elastic_volumes[node];
            let p = mean_pressure(reader, &mean, rows, node);
            let dp = reader.volumes[node] * pressures[node] + mean.spread(rows, node, &pressures);
            let change =
                reader.stress_change(node, f, df) * volume + cof * dp + cofactor_change(f, df) * p;
            let change = seen_change(reader, node, f, dh, change, || {
                reader.energy_and_stress(node, f).1 * volume + cof * p
            });
            let change = -change.transpose();
            let control = reader.control_stress(node, gather(reader, rows, node).1);
            *matrix = L::matrix(change, control);
            *product = own_force(reader, node, change, control);
            0.0
        },
    );
    mean.controls = changes;
    mean.ratios = ratios;
    mean.pressure_changes = pressures;
    body.dilatation = Some(mean);
}
