//! `phyxel check`.

use std::io::{self, Write};
use std::mem::size_of_val;

use clap::Args;
use serde::Serialize;

use super::source::Source;
use super::{CliError, Overrides};
use crate::run::RunError;
use crate::scene::Scene;
use crate::world::{Member, World};

#[derive(Debug, Args)]
pub(super) struct CheckArguments {
    /// Embedded scene, scene file (.ron) or mesh file.
    #[arg(value_name = "SCENE|MESH")]
    scene: String,
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
    /// Step (s), and the share of the largest stable one that it is.
    step: f64,
    step_factor: f64,
    /// Steps after settling, and of settling at most.
    steps: f64,
    settling_steps: f64,
    strokes: usize,
    captures: usize,
    /// Frames after settling.
    frames: f64,
}

#[derive(Debug, Serialize)]
struct BodyCosts {
    name: String,
    nodes: usize,
    pairs: usize,
    tetrahedra: usize,
    spacing: f64,
    volume: f64,
    mass: f64,
    /// Memory (bytes) of each part of the model; 0 where the scene does not need it.
    parts: Vec<(&'static str, usize)>,
}

/// Reads and validates a scene, builds its bodies and prints what it would cost; runs nothing.
pub(super) fn check(arguments: &CheckArguments) -> Result<(), CliError> {
    let overrides = arguments.overrides.parse()?;
    let (scene, note) = Source::of(Some(&arguments.scene))?.scene(&overrides)?;
    let mut out = io::stdout().lock();
    let costs = costs(scene)?;
    if arguments.json {
        writeln!(out, "{}", serde_json::to_string(&costs)?)?;
        return Ok(());
    }
    if let Some(note) = note {
        writeln!(out, "{note}")?;
    }
    print(&mut out, &costs)?;
    Ok(())
}

fn costs(scene: Scene) -> Result<Costs, CliError> {
    let integration = scene.integration;
    let captures = scene.cuts.iter().map(|cut| cut.capture_times().len()).sum();
    let strokes = scene.cuts.len();
    let frames = scene.pictures.map_or(0.0, |pictures| {
        (pictures.rate * integration.duration).floor() + 1.0
    });
    let name = scene.name.clone();
    let world = World::new(scene).map_err(RunError::World)?;
    let step = world.step_size();
    Ok(Costs {
        scene: name,
        bodies: world.members().iter().map(body_costs).collect(),
        step,
        step_factor: integration.step_factor,
        steps: (integration.duration / step).ceil(),
        settling_steps: integration
            .settle
            .map_or(0.0, |settle| (settle.limit / step).ceil()),
        strokes,
        captures,
        frames,
    })
}

fn body_costs(member: &Member) -> BodyCosts {
    let body = &member.body;
    let stencils = &body.stencils;
    let state = body.motion.state();
    BodyCosts {
        name: body.name.clone(),
        nodes: body.rest.len(),
        pairs: body.neighborhoods.pair_count(),
        tetrahedra: body.tetrahedra.len(),
        spacing: body.spacing,
        volume: body.volumes.iter().sum(),
        mass: body.masses.iter().sum(),
        parts: vec![
            (
                "nodes",
                size_of_val(&*body.rest) + size_of_val(&*body.volumes) + size_of_val(&*body.masses),
            ),
            (
                "neighbours",
                size_of_val(body.neighborhoods.offsets())
                    + size_of_val(body.neighborhoods.indices()),
            ),
            (
                "stencils",
                size_of_val(&*stencils.pair_gradients)
                    + size_of_val(&*stencils.weights)
                    + size_of_val(&*stencils.moment_inverses)
                    + size_of_val(&*stencils.multipliers),
            ),
            ("elastic model", body.elastic.bytes()),
            (
                "motion",
                size_of_val(&*state.positions)
                    + size_of_val(&*state.velocities)
                    + size_of_val(&*state.forces)
                    + size_of_val(&*state.applied)
                    + size_of_val(&*state.viscous),
            ),
            ("contact", member.contact_bytes()),
        ],
    }
}

fn print(out: &mut impl Write, costs: &Costs) -> io::Result<()> {
    writeln!(out, "{}", costs.scene)?;
    for body in &costs.bodies {
        writeln!(
            out,
            "  {}: {} nodes {:.2} mm apart, {} pairs, {} tetrahedra; {:.4} l, {:.4} kg",
            body.name,
            body.nodes,
            1e3 * body.spacing,
            body.pairs,
            body.tetrahedra,
            1e3 * body.volume,
            body.mass
        )?;
        for &(part, bytes) in &body.parts {
            #[allow(clippy::cast_precision_loss, reason = "memory is far below 2^53 bytes")]
            let mebibytes = bytes as f64 / f64::from(1 << 20);
            writeln!(out, "    {part:<16}{mebibytes:>10.3} MiB")?;
        }
    }
    writeln!(
        out,
        "  step: {:.4} ms, {} of the largest stable one; {:.0} steps after at most {:.0} of settling",
        1e3 * costs.step,
        costs.step_factor,
        costs.steps,
        costs.settling_steps
    )?;
    writeln!(
        out,
        "  cuts: {} strokes, {} captures; nothing is kept for them before the first",
        costs.strokes, costs.captures
    )?;
    if costs.frames > 0.0 {
        writeln!(
            out,
            "  pictures: {:.0} frames and those of settling",
            costs.frames
        )
    } else {
        writeln!(out, "  pictures: off, so no surfels either")
    }
}
