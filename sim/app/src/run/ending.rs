//! The summary of a world when its run ends.

use super::Begun;
use super::kept::Course;
use super::records::{Extremes, Records};
use super::summary::{
    BodySummary, ContactSummary, CutSummary, EnergySummary, PictureSummary, SteppingSummary,
    StrokeSummary, Summary, Timings, ToolSummary,
};
use crate::picture::Painter;
use phyxel::scene::Tool;
use phyxel::{Body, World};

/// What only the run loop knows.
pub(super) struct Ending {
    pub(super) begun: Begun,
    pub(super) threads: usize,
    pub(super) course: Course,
    pub(super) files: Vec<String>,
}

/// The summary of a world at the end of its run.
pub(super) fn of(
    world: &mut World,
    painter: Option<&Painter>,
    records: &Records,
    ending: &Ending,
) -> Summary {
    let bodies = world.bodies().iter().zip(&records.worst);
    let bodies = bodies.map(|(body, worst)| body_summary(body, worst));
    let bodies: Vec<BodySummary> = bodies.collect();
    let stepping = stepping_summary(world, &ending.course);
    let phases = world.phases().clone();
    let scene = world.scene();
    let begun = &ending.begun;
    Summary {
        scene: scene.name.clone(),
        version: env!("CARGO_PKG_VERSION"),
        bodies,
        tools: tool_summaries(world, records),
        warnings: warnings(world, records),
        cuts: (!scene.cuts.is_empty()).then(|| cut_summary(world)),
        contact: world.body_contact().map(|(between, state)| ContactSummary {
            // Not -0 where there is none.
            force: 0.0 + between.iter().map(|sum| sum.normal).sum::<f64>(),
            area: 0.0 + between.iter().map(|sum| sum.area).sum::<f64>(),
            penetration: (between.iter().map(|sum| sum.penetration)).fold(0.0, f64::max),
            energy: state.energy,
            dissipated: state.dissipated,
            offset_work: state.offset_work,
        }),
        pictures: painter.zip(scene.pictures.as_ref()).map(|(painter, spec)| {
            let (surfels, skin_surfels) = painter.surfel_counts();
            PictureSummary {
                frames: painter.frames(),
                width: spec.width,
                height: spec.height,
                surfels,
                skin_surfels,
            }
        }),
        timings: Timings::new(
            &phases,
            begun.clock.elapsed().as_secs_f64(),
            ending.threads,
            stepping.steps - begun.steps,
            stepping.simulated - begun.time,
            world.latencies(),
        ),
        stepping,
        files: ending.files.clone(),
    }
}

/// Fraction of the elastic energy above which energy added by an update of a cut is reported.
const LARGEST_CUT_ADDITION: f64 = 0.01;

/// Unexplained energy of an end, relative, above which it is reported.
const LARGEST_IMBALANCE: f64 = 0.01;

/// Whether anything moved, and [`Audit::unexplained`](phyxel_integrate::Audit::unexplained) but for round-off.
fn imbalance(body: &Body) -> (bool, f64) {
    let audit = body.motion().audit();
    let round_off = body.elastic().energy_round_off(body.motion().positions());
    let moved = audit.scale() > round_off;
    // Of what moved, this much is round-off.
    if !moved || audit.energy_error().abs() <= (1e-12 * audit.scale()).max(round_off) {
        return (moved, 0.0);
    }
    (moved, audit.unexplained())
}

fn body_summary(body: &Body, worst: &Extremes) -> BodySummary {
    let cutting = body.cutting.as_ref();
    let cuts = cutting.map(|cutting| cutting.energy).unwrap_or_default();
    let audit = body.motion().audit();
    let graph = &body.neighborhoods;
    let solved = body.stencils.report;
    let pieces = body.pieces();
    let volume: f64 = body.volumes.iter().sum();
    let (moved, imbalance) = imbalance(body);
    BodySummary {
        name: body.name.clone(),
        nodes: body.rest.len(),
        pairs: graph.pair_count(),
        tetrahedra: body.tetrahedra.len(),
        supported: body.motion().supports().entries().len(),
        spacing: body.spacing,
        volume,
        volume_error: body.volume_error,
        mass_before: body.mass,
        mass_after: body.motion().masses().iter().sum(),
        volume_before: body.volume,
        volume_after: volume,
        stencil_residual: solved.map(|solved| solved.residual),
        stencil_iterations: solved.map(|solved| solved.iterations),
        pieces: pieces.sizes.len(),
        energy: EnergySummary {
            kinetic: audit.kinetic,
            elastic: audit.elastic,
            external_work: audit.external_work(),
            dissipated: audit.dissipated,
            numerical: audit.numerical,
            viscous: body.elastic().viscous_energy(),
            relaxed: body.relaxed,
            // Not -0 where there was nothing.
            released_by_cuts: 0.0 - audit.energy_correction - body.relaxed,
            added_by_cuts: cuts.added + cuts.decay.max(0.0),
            largest_cut_addition: cuts.largest_addition,
            moved,
            imbalance,
        },
        momentum_error: worst.momentum_error,
        smallest_determinant: body.smallest_ratio,
        largest_speed: worst.largest_speed,
    }
}

/// What the scene asked for without effect, as the run has found.
fn warnings(world: &World, records: &Records) -> Vec<String> {
    let mut warnings = crate::warnings::warnings(world);
    warnings.extend(crate::warnings::vain_cuts(world));
    warnings.extend(doubts(world));
    let largest = &records.largest;
    let tools = world.scene().tools.iter().zip(largest);
    let tools = tools.zip(world.tool_forces()).enumerate();
    // A fast one may have touched within a step alone.
    let idle = tools.filter(|(_, ((_, most), now))| most.force <= 0.0 && now.work == 0.0);
    let told = |(index, ((tool, _), _)): (usize, ((&Tool, _), _))| {
        format!("tools[{index}] '{}' touched nothing", tool.name)
    };
    warnings.extend(idle.map(told));
    warnings
}

/// What a world that looks well hides.
pub(crate) fn doubts(world: &World) -> Vec<String> {
    let of_bodies = world.bodies().iter().flat_map(doubts_of);
    world.alarms().iter().cloned().chain(of_bodies).collect()
}

fn doubts_of(body: &Body) -> Vec<String> {
    let mut doubts = Vec::new();
    let name = &body.name;
    if body.smallest_ratio <= 0.0 {
        doubts.push(format!(
            "body '{name}': a node that carries strain turned inside out (det F down to {:.3}); its \
             material is soft for what pulls it, or nodes are too few there",
            body.smallest_ratio
        ));
    }
    if let Some(doubt) = &body.doubt {
        doubts.push(format!(
            "body '{name}': energies were off by {:+.1} % of what moved, {:.4} s after its first step, most \
             of it at node {}: {}",
            100.0 * doubt.relative,
            doubt.time,
            doubt.node,
            doubt.cause
        ));
    }
    let (_, imbalance) = imbalance(body);
    if imbalance > LARGEST_IMBALANCE {
        doubts.push(format!(
            "body '{name}': {:.1} % of the energy that is stored or was dissipated is unexplained; take a smaller \
             integration.step_factor (or step and tolerance of an implicit scheme), or more nodes where the body is thin",
            100.0 * imbalance
        ));
    }
    let cutting = body.cutting.as_ref();
    let added = cutting.map_or(0.0, |cutting| cutting.energy.largest_addition);
    if added > LARGEST_CUT_ADDITION {
        doubts.push(format!(
            "body '{name}': one update of a cut added {:.1} % of the elastic energy there was",
            100.0 * added
        ));
    }
    doubts
}

fn stepping_summary(world: &World, course: &Course) -> SteppingSummary {
    let bodies = world.bodies().iter();
    let stiffest = bodies.min_by(|a, b| a.step_size().total_cmp(&b.step_size()));
    let (critical_step, largest_eigenvalue, iterations) = stiffest.map_or((0.0, 0.0, 0), |body| {
        let found = &body.eigenvalue;
        (body.critical_step(), found.value, found.iterations)
    });
    let integration = &world.scene().integration;
    let (factor, milliseconds) = (integration.step_factor, 1e3 * critical_step);
    SteppingSummary {
        steps: world.steps(),
        settling_steps: course.settling_steps,
        simulated: world.time(),
        rested: course.rested,
        step: world.first_step(),
        retaken: world.retaken().stretches,
        smallest_step: course.smallest_step,
        critical_step,
        largest_eigenvalue,
        chosen: if integration.scheme.step().is_some() {
            format!("as the implicit scheme has it; critical {milliseconds:.3} ms")
        } else {
            format!(
                "{factor} of the critical {milliseconds:.3} ms, from the largest eigenvalue {largest_eigenvalue:.3e} /s² ({iterations} products)"
            )
        },
    }
}

fn tool_summaries(world: &World, records: &Records) -> Vec<ToolSummary> {
    let largest = &records.largest;
    let tools = world.scene().tools.iter().zip(world.tool_forces());
    tools
        .zip(largest)
        .map(|((tool, now), largest)| ToolSummary {
            name: tool.name.clone(),
            largest_force: largest.force,
            deepest_penetration: largest.penetration,
            force: now.force.length(),
            work: now.work,
        })
        .collect()
}

fn cut_summary(world: &World) -> CutSummary {
    let mut all = CutSummary {
        eigenvalue_growth: 1.0,
        ..CutSummary::default()
    };
    for body in world.bodies() {
        all.weak_nodes += body.elastic().deficient_nodes().len();
        all.loose_nodes += body.elastic().loose_nodes();
        let Some(cutting) = &body.cutting else {
            continue;
        };
        let (captures, updates) = cutting.counts();
        all.captures += captures;
        all.updates += updates;
        all.triangles += cutting.cuts.triangle_count();
        all.weakened_pairs += cutting.factors.crossed_count();
        all.severed_pairs += cutting.severed_pairs();
        all.eigenvalue_growth = all.eigenvalue_growth.max(cutting.growth);
        if let Some((lattices, without)) = cutting.factors.grid_counts() {
            *all.lattices.get_or_insert(0) += lattices;
            *all.pairs_without_lattice.get_or_insert(0) += without;
        }
        let strokes = cutting.by_stroke.iter();
        all.strokes.extend(strokes.map(|stroke| StrokeSummary {
            cut: world.scene().cuts[stroke.cut].name.clone(),
            body: body.name.clone(),
            captures: stroke.captures,
            updates: stroke.updates,
            energy: stroke.energy,
        }));
    }
    all
}
