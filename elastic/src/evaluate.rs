//! The passes over nodes: forces and tangent products, in parallel over fixed chunks.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::body::Body;
use crate::dilatation::MeanDilatation;
use crate::kernel::Lanes;
use crate::law::{cofactor, cofactor_change, double_dot, volume_ratio};
use crate::rows::Rows;

/// Nodes per unit of parallel work, and per partial sum of the energy.
pub(crate) const CHUNK: usize = 256;
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
    parallel: bool,
    (a, b, c): (&mut [A], &mut [B], &mut [C]),
    partial: &mut [f64],
    work: impl Fn(usize, &mut A, &mut B, &mut C) -> f64 + Sync,
) {
    let chunk = |(chunk, (((a, b), c), sum)): Chunk<'_, A, B, C>| {
        for (k, ((a, b), c)) in a.iter_mut().zip(b).zip(c).enumerate() {
            *sum += work(chunk * CHUNK + k, a, b, c);
        }
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
    let parallel = parallel(body);
    body.set_displacements(positions, L::LEAST_DISPLACEMENT);
    let mut deformation = std::mem::take(&mut body.deformation);
    let mut partial = std::mem::take(&mut body.partial_energies);
    partial.fill(0.0);
    if body.dilatation.is_some() {
        mean_stress_pass(body, table, &mut deformation, &mut partial, forces);
    } else {
        let (rows, matrices) = (&table.rows, &mut table.matrices[..]);
        let body = &*body;
        let outputs = (matrices, &mut deformation[..], &mut *forces);
        each(parallel, outputs, &mut partial, |node, matrix, f, force| {
            let (h, s) = gather(body, rows, node);
            let (energy, stress) = if body.is_plain(node) {
                // An isotropic law gives Pᵀ from Fᵀ: rows stay rows.
                let turned = DMat3::IDENTITY + h;
                *f = turned.transpose();
                body.law_shared(node).neo_hookean(turned)
            } else {
                *f = body.deformation_gradient(node, h.transpose());
                let (energy, stress) = body.energy_and_stress(node, *f);
                (energy, body.seen_stress(node, *f, stress).transpose())
            };
            let volume = body.elastic_volumes[node];
            let stress = stress * -volume;
            let control = s * body.control(node);
            *matrix = L::matrix(stress, control);
            *force = own_force(body, node, stress, control);
            volume * energy + 0.5 * double_dot(stress, h)
        });
    }
    body.deformation = deformation;
    let (rows, matrices) = (&table.rows, &table.matrices);
    let (mut a, mut b) = (nothing(body), nothing(body));
    let reader = &*body;
    let outputs = (forces, &mut a[..], &mut b[..]);
    each(parallel, outputs, &mut partial, |node, force, (), ()| {
        *force += gather_force(reader, rows, matrices, node);
        -0.5 * reader.displacement(node).dot(*force)
    });
    let energy = partial.iter().sum();
    body.partial_energies = partial;
    energy
}

/// Tangent product; see [`crate::Elastic::tangent_product_into`].
pub(crate) fn tangent_product<L: Lanes>(
    body: &mut Body,
    table: &mut Table<L>,
    vector: &[DVec3],
    product: &mut [DVec3],
) {
    let parallel = parallel(body);
    body.set_vectors(vector);
    let mut partial = std::mem::take(&mut body.partial_energies);
    let (mut a, mut b) = (nothing(body), nothing(body));
    if body.dilatation.is_some() {
        mean_change_pass(body, table, &mut partial, product);
    } else {
        let (rows, matrices) = (&table.rows, &mut table.matrices[..]);
        let body = &*body;
        let outputs = (matrices, &mut *product, &mut a[..]);
        each(
            parallel,
            outputs,
            &mut partial,
            |node, matrix, product, ()| {
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
                let control = ds * body.control(node);
                *matrix = L::matrix(change, control);
                *product = own_force(body, node, change, control);
                0.0
            },
        );
    }
    let (rows, matrices) = (&table.rows, &table.matrices);
    let reader = &*body;
    let outputs = (product, &mut a[..], &mut b[..]);
    each(parallel, outputs, &mut partial, |node, product, (), ()| {
        *product = -(*product + gather_force(reader, rows, matrices, node));
        0.0
    });
    body.partial_energies = partial;
}

/// `(sum_j u_ij ⊗ g_ij)ᵀ` and `(sum_j u_ij ⊗ y_ij)ᵀ`: the rows of the sums as columns.
#[inline(always)]
fn gather<L: Lanes>(body: &Body, rows: &Rows<L>, node: usize) -> (DMat3, DMat3) {
    let (indices, pairs) = rows.row(node);
    L::gather_gradient(&body.moves[node], indices, pairs, &body.moves)
}

/// What its neighbours give a node.
#[inline(always)]
fn gather_force<L: Lanes>(
    body: &Body,
    rows: &Rows<L>,
    matrices: &[L::Matrix],
    node: usize,
) -> DVec3 {
    let (indices, incoming) = rows.incoming(node);
    L::gather_force(&body.moves[node], indices, incoming, &body.moves, matrices)
}

/// What a node's own row gives itself, from the transposes of `-V P` and `c S`.
#[inline(always)]
fn own_force(body: &Body, node: usize, stress: DMat3, control: DMat3) -> DVec3 {
    let (g, y) = (body.self_gradients[node], body.offsets[node]);
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
    let parallel = parallel(body);
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
    each(parallel, outputs, partial, |node, f, control, ratio| {
        let (h, s) = gather(reader, rows, node);
        *f = reader.deformation_gradient(node, h.transpose());
        *control = s * reader.control(node);
        *ratio = volume_ratio(*f);
        0.0
    });
    let mut means = std::mem::take(&mut mean.means);
    let mut pressures = std::mem::take(&mut mean.pressures);
    let mut none = nothing(reader);
    let outputs = (&mut means[..], &mut pressures[..], &mut none[..]);
    each(parallel, outputs, partial, |node, j, pressure, ()| {
        let (volume, elastic) = (reader.volumes[node], reader.elastic_volumes[node]);
        *j = mean.ratios[node] + mean.spread(rows, node, &mean.ratios) / volume;
        let [u, u1, _] = mean.laws[reader.material_index(node)].at(*j);
        *pressure = elastic / volume * u1;
        elastic * u
    });
    mean.means = means;
    mean.pressures = pressures;
    let outputs = (matrices, forces, &mut none[..]);
    each(parallel, outputs, partial, |node, matrix, force, ()| {
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
        volume * energy + 0.5 * double_dot(stress, h.transpose())
    });
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
    let parallel = parallel(body);
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
    each(parallel, outputs, partial, |node, dh, ratio, ()| {
        let f = reader.deformation[node];
        *dh = gather(reader, rows, node).0.transpose();
        *ratio = double_dot(cofactor(f), reader.deformation_change(node, f, *dh));
        0.0
    });
    let mut pressures = std::mem::take(&mut mean.pressure_changes);
    let mut more = nothing(reader);
    let outputs = (&mut pressures[..], &mut none[..], &mut more[..]);
    each(parallel, outputs, partial, |node, pressure, (), ()| {
        let volume = reader.volumes[node];
        let dj = ratios[node] + mean.spread(rows, node, &ratios) / volume;
        let [_, _, u2] = mean.laws[reader.material_index(node)].at(mean.means[node]);
        *pressure = reader.elastic_volumes[node] / volume * u2 * dj;
        0.0
    });
    let outputs = (matrices, product, &mut none[..]);
    each(parallel, outputs, partial, |node, matrix, product, ()| {
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
        let control = gather(reader, rows, node).1 * reader.control(node);
        *matrix = L::matrix(change, control);
        *product = own_force(reader, node, change, control);
        0.0
    });
    mean.controls = changes;
    mean.ratios = ratios;
    mean.pressure_changes = pressures;
    body.dilatation = Some(mean);
}
