//! `phyxel check`.

use std::ffi::OsString;
use std::io::{self, Write};
use std::time::Instant;

use clap::Args;
use phyxel_discretize::Bounds;
use serde::Serialize;

use super::source::Source;
use super::{CliError, Overrides, printable};
use crate::picture::Painter;
use crate::run::{RunError, pool};
use crate::warnings;
use phyxel::scene::Scene;
use phyxel::{Body, Phase, World};

#[derive(Debug, Args)]
pub(super) struct CheckArguments {
    /// Embedded scene, scene file (.ron) or mesh file.
    #[arg(value_name = "SCENE|MESH")]
    scene: OsString,
    #[command(flatten)]
    overrides: Overrides,
    /// Print the costs as one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// What a scene would cost.
#[derive(Debug, Serialize)]
struct Costs {
    scene: String,
    bodies: Vec<BodyCosts>,
    parts: Vec<PartCosts>,
    /// Step (s), and the fraction of the largest stable one that it is.
    step: f64,
    step_factor: f64,
    /// Steps after settling, and of settling at most.
    steps: f64,
    settling_steps: f64,
    strokes: usize,
    captures: usize,
    /// Frames after settling.
    frames: f64,
    /// Wall time (s) of a run, by what was timed: from its shortest, where bodies are at rest at once, to its longest,
    /// where they settle to the limit and their weight shrinks the steps.
    seconds: [f64; 2],
    /// What the scene asks for without effect, or is of another size than its bodies.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    warnings: Vec<String>,
}

#[derive(Debug, Serialize)]
struct BodyCosts {
    name: String,
    nodes: usize,
    pairs: usize,
    tetrahedra: usize,
    /// Nodes that supports hold or drive.
    held: usize,
    /// Corners of the box around the nodes (m).
    low: [f64; 3],
    high: [f64; 3],
    spacing: f64,
    volume: f64,
    mass: f64,
}

/// A part of the model, over all bodies.
#[derive(Debug, Serialize)]
struct PartCosts {
    name: &'static str,
    /// Heap bytes before the first cut; 0 where the scene does not need it.
    bytes: usize,
    /// Milliseconds of a step; 0 where it is off, `null` where it is counted with another part.
    milliseconds: Option<f64>,
}

/// Steps that are timed.
const TIMED_STEPS: u32 = 40;
/// Steps that a capture takes as long as where none was timed: the median of 57 random scenes, half of which have 14 to 36.
/// With 25, estimates of 6 scenes of 199 are off more than three times, of as many others 15 were with 10.
const STEPS_OF_A_CAPTURE: f64 = 25.0;
/// Steps shrink at most in this proportion to `ρ g L / E`, as bodies are crushed: of 12 random scenes above 0.4, by 0.5 to 2.
const SHRINK_BY_LOAD: f64 = 2.0;

/// Reads and validates a scene, builds its bodies, takes a few steps and prints what it would cost.
pub(super) fn check(arguments: &CheckArguments) -> Result<(), CliError> {
    let overrides = arguments.overrides.parse()?;
    let source = Source::of(Some(&arguments.scene))?;
    let (scene, note) = source.scene(&overrides)?;
    let mut out = io::stdout().lock();
    // As a run does: what is timed is timed on as many threads.
    let costs = pool(None).and_then(|pool| pool.install(|| costs(&scene)));
    let costs = costs.map_err(|error| source.locate(&scene, &overrides, error))?;
    if arguments.json {
        writeln!(out, "{}", serde_json::to_string(&costs)?)?;
        return Ok(());
    }
    if let Some(note) = note {
        writeln!(out, "{}", printable(&note))?;
    }
    let mut text = Vec::new();
    print(&mut text, &costs)?;
    write!(out, "{}", printable(&String::from_utf8_lossy(&text)))?;
    Ok(())
}

/// Wall time (s) that a run of the scene is estimated to take on the threads there are, its shortest and its longest, and
/// pictures included.
///
/// # Errors
/// [`RunError`] if the scene cannot be built, drawn or stepped.
pub fn run_time(scene: &Scene) -> Result<[f64; 2], RunError> {
    Ok(costs(scene)?.seconds)
}

fn costs(scene: &Scene) -> Result<Costs, RunError> {
    let integration = scene.integration;
    let strokes = scene.cuts.len();
    let frames = scene.pictures.as_ref().map_or(0.0, |pictures| {
        (pictures.rate * integration.duration).floor() + 1.0
    });
    let name = scene.name.clone();
    let begun = Instant::now();
    let mut world = World::new(scene.clone())?;
    let built = begun.elapsed().as_secs_f64();
    let captures = world.capture_count();
    let step = world.step_size();
    let steps = (integration.duration / step).ceil();
    let settling_steps = integration
        .settle
        .map_or(0.0, |settle| (settle.limit / step).ceil());
    let (parts, covered) = parts(&mut world)?;
    let mut warnings = warnings::warnings(&world);
    warnings.extend(warnings::misses(&world));
    warnings.extend_from_slice(world.alarms());
    let of_steps = parts.iter().filter(|part| part.name != "cuts");
    let a_step: f64 = 1e-3 * of_steps.filter_map(|part| part.milliseconds).sum::<f64>();
    let cut = world.phases().of(Phase::Cut);
    let cutting = match cut.calls {
        0 => STEPS_OF_A_CAPTURE * a_step * captures as f64,
        calls => cut.seconds / calls as f64 * captures as f64,
    };
    let fixed = built + covered + cutting;
    // Steps of a given size do not shrink.
    let step_given = integration.scheme.step();
    let load = step_given.map_or_else(|| load(&world), |_| 0.0);
    let most_steps = (steps + settling_steps) * (1.0 + SHRINK_BY_LOAD * load);
    Ok(Costs {
        seconds: [steps, most_steps].map(|steps| fixed + a_step * steps),
        parts,
        scene: name,
        bodies: world.bodies().iter().map(body_costs).collect(),
        step,
        step_factor: integration.step_factor,
        steps,
        settling_steps,
        strokes,
        captures,
        frames,
        warnings,
    })
}

/// Largest `ρ g L / E` of the bodies, `L` the longest side of a body's box at rest.
#[must_use]
pub fn load(world: &World) -> f64 {
    let gravity = world.scene().gravity;
    let gravity = gravity.map_or(0.0, |gravity| gravity.acceleration.length());
    let loads = world.bodies().iter().zip(&world.scene().bodies);
    let loads = loads.map(|(body, description)| {
        let length = Bounds::of(body.rest.iter().copied()).size().max_element();
        description.material.density * gravity * length / description.material.youngs_modulus
    });
    loads.fold(0.0, f64::max)
}

fn body_costs(body: &Body) -> BodyCosts {
    let bounds = Bounds::of(body.rest.iter().copied());
    BodyCosts {
        name: body.name.clone(),
        nodes: body.rest.len(),
        pairs: body.neighborhoods.pair_count(),
        tetrahedra: body.tetrahedra.len(),
        held: body.motion().supports().entries().len(),
        low: bounds.min.to_array(),
        high: bounds.max.to_array(),
        spacing: body.spacing,
        volume: body.volumes.iter().sum(),
        mass: body.masses.iter().sum(),
    }
}

/// Takes the first steps of the scene, and draws a frame if it has pictures; also how long (s) covering the bodies took.
fn parts(world: &mut World) -> Result<(Vec<PartCosts>, f64), RunError> {
    for _ in 0..TIMED_STEPS {
        if world.has_settled() {
            world.start_scene()?;
        }
        world.step()?;
    }
    let mut parts: Vec<PartCosts> = Vec::new();
    for part in world.parts() {
        let spent = part.phase.map(|phase| world.phases().of(phase).seconds);
        let spent = spent.map(|seconds| 1e3 * seconds / f64::from(TIMED_STEPS));
        parts.push(PartCosts {
            name: part.name,
            bytes: part.bytes,
            milliseconds: spent.or((part.bytes == 0).then_some(0.0)),
        });
    }
    let (mut bytes, mut milliseconds, mut covered) = (0, 0.0, 0.0);
    if let Some(spec) = &world.scene().pictures {
        let start = Instant::now();
        let mut painter = Painter::new(world, spec)?;
        covered = start.elapsed().as_secs_f64();
        let start = Instant::now();
        painter.carry(world);
        painter.draw(world);
        let frames_per_step = spec.rate * world.step_size();
        bytes = painter.bytes();
        milliseconds = 1e3 * start.elapsed().as_secs_f64() * frames_per_step;
    }
    parts.push(PartCosts {
        name: "pictures",
        bytes,
        milliseconds: Some(milliseconds),
    });
    Ok((parts, covered))
}

fn print(out: &mut impl Write, costs: &Costs) -> io::Result<()> {
    writeln!(out, "{}", costs.scene)?;
    for body in &costs.bodies {
        let (name, nodes, pairs) = (&body.name, body.nodes, body.pairs);
        let (tetrahedra, held, mass) = (body.tetrahedra, body.held, body.mass);
        let (apart, volume) = (1e3 * body.spacing, 1e3 * body.volume);
        writeln!(
            out,
            "  {name}: {nodes} nodes {apart:.2} mm apart, {pairs} pairs, {tetrahedra} tetrahedra; {volume:.4} l, {mass:.4} kg"
        )?;
        let corner = |[x, y, z]: [f64; 3]| format!("({x:.4}, {y:.4}, {z:.4})");
        let [low, high] = [body.low, body.high].map(corner);
        writeln!(
            out,
            "  {name}: lies from {low} to {high} m; supports hold {held} nodes"
        )?;
    }
    print_parts(out, &costs.parts)?;
    let (step, factor) = (1e3 * costs.step, costs.step_factor);
    let (steps, settling) = (costs.steps, costs.settling_steps);
    writeln!(
        out,
        "  step: {step:.4} ms, {factor} of the largest stable one; {steps:.0} steps after at most {settling:.0} of settling"
    )?;
    let (strokes, captures, frames) = (costs.strokes, costs.captures, costs.frames);
    writeln!(
        out,
        "  cuts: {strokes} strokes, {captures} captures; nothing is kept for them before the first"
    )?;
    if frames > 0.0 {
        writeln!(out, "  pictures: {frames:.0} frames and those of settling")?;
    } else {
        writeln!(out, "  pictures: off, so no surfels either")?;
    }
    let [least, most] = costs.seconds;
    writeln!(
        out,
        "  time: about {least:.1} to {most:.1} s, the more, the longer bodies settle and the farther weight crushes them"
    )?;
    for warning in &costs.warnings {
        writeln!(out, "  warning: {warning}")?;
    }
    Ok(())
}

fn print_parts(out: &mut impl Write, parts: &[PartCosts]) -> io::Result<()> {
    let mebibytes = |bytes: usize| bytes as f64 / f64::from(1 << 20);
    let memory: f64 = parts.iter().map(|part| mebibytes(part.bytes)).sum();
    let time: f64 = parts.iter().filter_map(|part| part.milliseconds).sum();
    writeln!(
        out,
        "  {:<16}{:>10}{:>8}{:>12}{:>8}",
        "part", "MiB", "share", "ms a step", "share"
    )?;
    for part in parts {
        let bytes = mebibytes(part.bytes);
        write!(
            out,
            "  {:<16}{bytes:>10.3}{:>6.1} %",
            part.name,
            1e2 * bytes / memory
        )?;
        match part.milliseconds {
            Some(own) => writeln!(out, "{own:>12.4}{:>6.1} %", 1e2 * own / time)?,
            None => writeln!(out, "{:>12}{:>8}", "*", "")?,
        }
    }
    writeln!(
        out,
        "  {:<16}{memory:>10.3}{:>8}{time:>12.4}   mean of the first {TIMED_STEPS} steps; * counted in motion and elasticity",
        "all", ""
    )
}
