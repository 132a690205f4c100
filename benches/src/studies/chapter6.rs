//! The dissertation's chapter 6: a block and a liver hang, are cut once and cut through, in its model
//! and in the default one. The scenes are embedded in the program.

use std::time::Instant;

use glam::DVec3;

use super::embedded;
use super::sag::{self, BODIES, MODELS};
use crate::report::{Cell, Report, Series, Table, add_point, median, plots, row};
use crate::{Effort, StudyError};
use phyxel::scene::Scene;
use phyxel::{Cutting, World};
use phyxel_cli::picture::Painter;

/// States, and the scene times (s) at which the scenes' blades are between two strokes.
const STATES: [(&str, f64); 3] = [("hanging", 0.1), ("cut once", 1.0), ("cut through", 1.9)];

/// A body in one state.
struct Measured {
    nodes: usize,
    /// Neighbours that a node sees, in the mean, before any cut.
    neighbors: f64,
    severed: usize,
    /// Lowest node (m) below its lowest position at rest.
    drop: f64,
    /// Step (s simulated).
    step: f64,
    /// Median wall time (s) of a step, and of carrying and drawing a picture.
    seconds: f64,
    drawing: f64,
    /// Energy (J) that cuts release and that they added, so far.
    released: f64,
    added: f64,
    /// Energy (J) that the audit leaves unexplained.
    unexplained: f64,
}

impl Measured {
    /// Frames (1/s) of a step and a picture each.
    fn frames(&self) -> f64 {
        1.0 / (self.seconds + self.drawing)
    }

    /// What the table says of it, beside the sag's error (%) and the frames (1/s) of 2014.
    fn cells(&self, error: Option<f64>, then: f64) -> Vec<Cell> {
        row![
            self.nodes,
            self.neighbors,
            self.severed,
            error,
            1e3 * self.drop,
            1e3 * self.step,
            1e3 * self.seconds,
            1.0 / self.seconds,
            self.step / self.seconds,
            self.frames(),
            then,
            1e3 * self.released,
            1e3 * self.added,
            1e3 * self.unexplained,
            Cell::Nothing
        ]
    }
}

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let (sags, sag) = sag::measure(effort)?;
    let changes: &[&str] = effort.choose(
        &[],
        &[
            "bodies[0].surfels.target=Count(3000)",
            "pictures.width=320",
            "pictures.height=240",
        ],
    );
    let (mut rows, mut lines) = (Vec::new(), Vec::new());
    for (body, then) in BODIES {
        for (suffix, model) in MODELS {
            let scene = embedded(&format!("{body}{suffix}"), changes)?;
            let mut of_body = sags.iter();
            let of_body = of_body.find(|sag| sag.body == body && sag.model == model);
            let error = of_body.and_then(|sag| sag.error);
            for ((state, found), at) in hang(scene, effort)?.into_iter().zip([1.0, 2.0, 3.0]) {
                let mut row = row![body, model, state];
                match found {
                    Ok(found) => {
                        row.extend(found.cells(error.filter(|_| state == "hanging"), then));
                        let name = format!("{body}, {model}");
                        add_point(&mut lines, &name, (at, found.frames()));
                    }
                    Err(error) => {
                        row.resize(17, Cell::Nothing);
                        row.push(error.into());
                    }
                }
                rows.push(row);
            }
        }
    }
    for (name, then) in BODIES {
        let ends = vec![(1.0, then), (3.0, then)];
        lines.push(Series::line(format!("2014: {name}"), ends));
    }
    let table = Table::new(
        "chapter6",
        "Hanging, cut once, cut through",
        "body; model; state; nodes (1); neighbours (1); severed pairs (1); \
         sag against finite elements (%); drop (mm); step (ms simulated); time of a step (ms); \
         steps (1/s); speed (simulated s per s); frames (1/s); in 2014 (1/s); released (mJ); \
         added (mJ); unexplained (mJ); ended",
        rows,
    );
    let plots = plots![
        "chapter6" "Frames per second, drawn: hanging (1), cut once (2), cut through (3)",
            linear "state of the body", log "frames per second (1/s)" => lines;
    ];
    Ok(Report::new(&[&words()], vec![table, sag], plots))
}

type Found = (&'static str, Result<Measured, String>);

/// Plays a scene and measures it in each state. A body that blows up is measured no more, and the
/// states say so.
fn hang(scene: Scene, effort: Effort) -> Result<Vec<Found>, StudyError> {
    let pictures = scene.pictures.clone().unwrap_or_default();
    let mut world = World::new(scene)?;
    let mut painter = Painter::new(&world, &pictures)?;
    let body = &world.bodies()[0];
    let seen = body.stencils.weights.iter().filter(|w| **w > 0.0).count();
    let neighbors = seen as f64 / body.rest.len() as f64;
    let mut found: Vec<Found> = Vec::new();
    let mut ended: Option<String> = world.settle().err().map(|error| error.to_string());
    for (state, time) in STATES {
        let mut lead = || {
            while world.scene_time().is_none_or(|now| now < time) {
                world.step()?;
                let pieces = world.take_new_pieces();
                painter.grow(&world, &pieces)?;
            }
            measured(&mut world, &mut painter, neighbors, effort)
        };
        let measured = match &ended {
            Some(error) => Err(error.clone()),
            None => lead().map_err(|error| error.to_string()),
        };
        if let Err(error) = &measured {
            ended = Some(error.clone());
        }
        found.push((state, measured));
    }
    Ok(found)
}

fn measured(
    world: &mut World,
    painter: &mut Painter,
    neighbors: f64,
    effort: Effort,
) -> Result<Measured, StudyError> {
    let (steps_timed, pictures) = effort.choose((150, 11), (10, 1));
    let mut drawing = Vec::new();
    for _ in 0..pictures {
        let start = Instant::now();
        painter.carry(world);
        painter.draw(world);
        drawing.push(start.elapsed().as_secs_f64());
    }
    let mut steps = Vec::new();
    for _ in 0..steps_timed {
        let start = Instant::now();
        world.step()?;
        steps.push(start.elapsed().as_secs_f64());
        let pieces = world.take_new_pieces();
        painter.grow(world, &pieces)?;
    }
    let body = &world.bodies()[0];
    let cutting = body.cutting.as_ref();
    let energy = cutting.map(|cutting| cutting.energy).unwrap_or_default();
    let lowest = |x: &[DVec3]| x.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
    Ok(Measured {
        nodes: body.rest.len(),
        neighbors,
        severed: cutting.map_or(0, Cutting::severed_pairs),
        drop: lowest(&body.rest) - lowest(&body.smoothed_positions()),
        step: world.step_size(),
        seconds: median(&steps).unwrap_or(0.0),
        drawing: median(&drawing).unwrap_or(0.0),
        released: energy.released,
        added: energy.added,
        unexplained: body.motion().audit().energy_error(),
    })
}

fn words() -> String {
    let [block, hierarchical, liver] = BODIES.map(|(_, then)| then);
    format!(
        "Chapter 6: the embedded scenes of these names, and those with \"-dissertation\" behind it. A block of \
         8 x 8 x 22 nodes 10 mm apart, one of 436 nodes that are vertices of tetrahedra, and a liver of \
         181 (the program's own) hang, are cut half through and then through, by the default model and by the \
         dissertation's: Saint Venant-Kirchhoff, plain moving least squares of 16 neighbours at most in the first \
         block (neighbours without a limit in the other bodies, as there), nothing against hourglass modes, the \
         enrichment grid. Drop is how far the lowest node is below the lowest place at rest at the end of a \
         state, in motion. The dissertation ran {block}, {hierarchical} and {liver} frames a second, one step of 1 ms each, in \
         2014; frames per second here are of one step and one picture each, drawn by the processor, steps \
         per second of steps alone, at the step that the program chooses. The sag against finite elements is \
         the mean over the mass at small strain, uncut, at rest: triquadratic elements of the blocks, the \
         liver's own tetrahedra divided into eight once and again, extrapolated (the same body, the same part of it \
         held), all computed here; linear tetrahedra on the same nodes stand beside it."
    )
}
