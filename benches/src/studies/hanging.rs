//! The dissertation's chapter 6: a block and a liver hang, are cut once and cut again.

use std::env;
use std::path::PathBuf;
use std::time::Instant;

use glam::DVec3;
use phyxel_discretize::read_mesh;

use super::cut::{columns, middle};
use super::nearest;
use crate::report::{Axis, Cell, Plot, Scale, Series, Table};
use crate::{Effort, StudyError};
use phyxel::picture::Painter;
use phyxel::scene::{MeshExtent, Motion, Override, Region, Scene, Shape, Support};
use phyxel::world::World;

/// Times (s) at which the blades start, and how long they take.
const BLADES: [f64; 2] = [0.5, 0.9];
const PASSING: f64 = 0.1;
/// Frames per second that Aras 2014, chapter 6, reports.
pub(crate) const THEN: [f64; 3] = [80.0, 125.0, 120.0];

/// A body in one state.
#[derive(Debug, Clone, Default)]
pub(crate) struct State {
    pub(crate) body: &'static str,
    pub(crate) state: &'static str,
    pub(crate) nodes: usize,
    pub(crate) pairs: usize,
    /// Step (s simulated).
    pub(crate) step: f64,
    /// Median wall time (s) of a step.
    pub(crate) seconds: f64,
    /// Median wall time (s) of carrying the surfels and drawing; `None` where nothing is drawn.
    pub(crate) drawing: Option<f64>,
    /// Pairs without any coupling.
    pub(crate) severed: usize,
    /// Lowest node (m) below its lowest place at rest.
    pub(crate) sag: f64,
    /// Frames per second in the dissertation.
    pub(crate) then: f64,
}

pub(crate) const STATES: [&str; 3] = ["hanging", "cut once", "cut twice"];

/// How a state is measured: steps, pictures, surfels, width and height of a picture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Care {
    pub(crate) steps: u32,
    pictures: u32,
    surfels: u32,
    size: [u32; 2],
}

impl Care {
    fn of(effort: Effort) -> Self {
        match effort {
            Effort::Full => Self {
                steps: 150,
                pictures: 11,
                surfels: 30_000,
                size: [960, 540],
            },
            Effort::Quick => Self {
                steps: 10,
                pictures: 1,
                surfels: 3_000,
                size: [320, 240],
            },
        }
    }
}

pub(crate) fn measure(effort: Effort) -> Result<Vec<State>, StudyError> {
    let care = Care::of(effort);
    let mut found = nearest::measure(care)?;
    let block = |nodes: u32| -> Result<Scene, StudyError> {
        let overrides = [
            Override::parse(&format!("bodies[0].sampling.target=Nodes({nodes})"))?,
            Override::parse("integration.settle=None")?,
            Override::parse("gravity=(ramp: 0.1)")?,
            Override::parse("bodies[0].damping=10")?,
            cuts([
                [
                    "(0, -0.06, 0)",
                    "(0, 0.06, 0)",
                    "(-0.06, 0, 0.0213)",
                    "(0, 0, 0.0213)",
                ],
                [
                    "(0, -0.06, 0)",
                    "(0, 0.06, 0)",
                    "(0.07, 0, -0.0613)",
                    "(-0.07, 0, -0.0613)",
                ],
            ])?,
        ];
        drawn(Scene::embedded("block", &overrides)?, care)
    };
    found.extend(run(block(1_408)?, "block, sampled", THEN[0], care)?);
    found.extend(run(block(436)?, "block, sampled coarsely", THEN[1], care)?);
    found.extend(run(drawn(liver()?, care)?, "liver", THEN[2], care)?);
    Ok(found)
}

/// Two cuts: ends of the edge, start and end of the path.
fn cuts(blades: [[&str; 4]; 2]) -> Result<Override, StudyError> {
    let mut text = String::from("cuts=[");
    for ([from, to, start, end], (name, time)) in blades
        .into_iter()
        .zip(["first", "second"].into_iter().zip(BLADES))
    {
        text.push_str(&format!(
            "(name: \"{name}\", edge: [{from}, {to}], path: [(time: {time}, position: {start}), \
             (time: {}, position: {end})]),",
            time + PASSING
        ));
    }
    text.push(']');
    Ok(Override::parse(&text)?)
}

/// The scene with pictures of the study's size.
fn drawn(mut scene: Scene, care: Care) -> Result<Scene, StudyError> {
    for body in &mut scene.bodies {
        body.surfels.target = phyxel::scene::SurfelTarget::Count(care.surfels);
    }
    let pictures = scene.pictures.get_or_insert_default();
    [pictures.width, pictures.height] = care.size;
    Ok(Scene::from_text(
        &scene.to_ron(),
        "cut study",
        "".as_ref(),
        &[],
    )?)
}

/// The liver of the dissertation where the folder of meshes is named, else the built-in one, sampled
/// at 181 nodes; cut down into its upper side and then through.
fn liver() -> Result<Scene, StudyError> {
    let wish = [
        Override::parse("bodies[0].sampling.target=Nodes(181)")?,
        Override::parse("integration.settle=None")?,
        Override::parse("gravity=(ramp: 0.1)")?,
        Override::parse("bodies[0].damping=10")?,
        Override::parse("cuts=[]")?,
    ];
    let file = env::var_os("PHYXEL_MESHES").map(|folder| PathBuf::from(folder).join("liver.obj"));
    let mut scene = match file.filter(|file| file.exists()) {
        Some(file) => {
            let bounds = read_mesh(&file)?.mesh.compacted().bounds();
            let extent = MeshExtent {
                min: bounds.min,
                max: bounds.max,
            };
            Scene::for_mesh(&file, &extent, &wish)?.0
        }
        None => Scene::embedded("liver", &wish)?,
    };
    let rest = World::new(scene.clone())?.members()[0].body.rest.clone();
    let low = rest.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = rest.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let at = |x: f64, y: f64, z: f64| {
        let p = low + (high - low) * DVec3::new(x, y, z);
        format!("({}, {}, {})", p.x, p.y, p.z)
    };
    if matches!(scene.bodies[0].shape, Shape::Mesh { .. }) {
        // Held at its back, so that it hangs.
        scene.supports = vec![Support {
            body: None,
            region: Region::HalfSpace {
                point: low + (high - low) * DVec3::new(0.5, 0.75, 0.5),
                normal: DVec3::Y,
            },
            motion: Motion::Fixed,
        }];
    }
    let deep = 1.5 * (high.z - low.z);
    let wide = 1.5 * (high.y - low.y);
    let ends = [
        [format!("(0, {}, 0)", -wide), format!("(0, {wide}, 0)")],
        [format!("(0, 0, {})", -deep), format!("(0, 0, {deep})")],
    ];
    let paths = [
        [at(0.31, 0.4, 1.1), at(0.31, 0.4, 0.6)],
        [at(0.73, -0.2, 0.5), at(0.73, 1.2, 0.5)],
    ];
    let cuts = cuts([
        [&ends[0][0], &ends[0][1], &paths[0][0], &paths[0][1]],
        [&ends[1][0], &ends[1][1], &paths[1][0], &paths[1][1]],
    ])?;
    scene.integration.settle = None;
    Ok(Scene::from_text(
        &scene.to_ron(),
        "cut study",
        "".as_ref(),
        &[cuts],
    )?)
}

/// Hangs a body, cuts it twice, and measures it in each state.
fn run(scene: Scene, name: &'static str, then: f64, care: Care) -> Result<Vec<State>, StudyError> {
    let pictures = scene.pictures.unwrap_or_default();
    let mut world = World::new(scene)?;
    let mut painter = Painter::new(&world, &pictures)?;
    let mut found = Vec::new();
    let ends = [BLADES[0], BLADES[1], f64::INFINITY];
    for (state, end) in STATES.into_iter().zip(ends) {
        // The measured steps end before the next blade starts; the last state's after the last.
        let window = 1.1 * f64::from(care.steps) * world.step_size();
        let end = (end - window).min(BLADES[1] + PASSING + 0.05);
        while world.scene_time().is_some_and(|now| now < end) {
            world.step()?;
            let pieces = world.take_new_pieces();
            painter.grow(&world, &pieces)?;
        }
        found.push(measured(&mut world, &mut painter, name, state, then, care)?);
    }
    Ok(found)
}

fn measured(
    world: &mut World,
    painter: &mut Painter,
    name: &'static str,
    state: &'static str,
    then: f64,
    care: Care,
) -> Result<State, StudyError> {
    let mut drawing = Vec::new();
    for _ in 0..care.pictures {
        let start = Instant::now();
        painter.carry(world);
        painter.draw(world);
        drawing.push(start.elapsed().as_secs_f64());
    }
    let mut steps = Vec::new();
    for _ in 0..care.steps {
        let start = Instant::now();
        world.step()?;
        steps.push(start.elapsed().as_secs_f64());
        let pieces = world.take_new_pieces();
        painter.grow(world, &pieces)?;
    }
    let member = &world.members()[0];
    let body = &member.body;
    let lowest = |x: &[DVec3]| x.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
    Ok(State {
        body: name,
        state,
        nodes: body.rest.len(),
        pairs: body.neighborhoods.pair_count(),
        step: world.step_size(),
        seconds: middle(&mut steps),
        drawing: Some(middle(&mut drawing)),
        severed: member
            .cutting
            .as_ref()
            .map_or(0, phyxel::world::Cutting::severed_pairs),
        sag: lowest(&body.rest) - lowest(body.motion.positions()),
        then,
    })
}

pub(crate) fn words() -> String {
    format!(
        "Chapter 6: the block of 8 x 8 x 22 nodes 10 mm apart with its 16 nearest neighbours, both ways (E 10 kPa, nu 0.4, \
         hung by its top) by the default model and by the dissertation's, whose cut is left out; the \
         same block as a scene, sampled at that number of nodes and at the 436 of the hierarchical \
         one (vertices of tetrahedra, neighbours not limited); a liver of 181 nodes. The first cut \
         goes half through, the second takes a piece off; drop is how far the lowest node is below its place \
         at rest at the end of a state, in motion. The dissertation ran {} (block, 16 \
         neighbours), {} (436 nodes) and {} (liver) frames a second, one step of 1 ms each, in 2014; \
         steps per second here are for comparison with those, at the step that the program chooses, \
         and frames per second are of one step and one picture each.",
        THEN[0], THEN[1], THEN[2]
    )
}

pub(crate) fn table(states: &[State]) -> Table {
    let rows = states.iter().map(|found| {
        #[allow(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
        let neighbours = found.pairs as f64 / found.nodes as f64;
        vec![
            Cell::Word(found.body.to_owned()),
            Cell::Word(found.state.to_owned()),
            Cell::Count(found.nodes),
            Cell::Number(neighbours),
            Cell::Count(found.severed),
            Cell::Number(1e3 * found.sag),
            Cell::Number(1e3 * found.step),
            Cell::Number(1e3 * found.seconds),
            Cell::Number(1.0 / found.seconds),
            Cell::Number(found.step / found.seconds),
            found.drawing.map_or(Cell::Nothing, |drawing| {
                Cell::Number(1.0 / (found.seconds + drawing))
            }),
            Cell::Number(found.then),
        ]
    });
    Table {
        name: "chapter6",
        title: "Hanging, cut once, cut twice".to_owned(),
        columns: columns(&[
            ("body", ""),
            ("state", ""),
            ("nodes", "1"),
            ("neighbours", "1"),
            ("severed pairs", "1"),
            ("drop", "mm"),
            ("step", "ms simulated"),
            ("time of a step", "ms"),
            ("steps", "1/s"),
            ("speed", "simulated s per s"),
            ("frames", "1/s"),
            ("in 2014", "1/s"),
        ]),
        rows: rows.collect(),
    }
}

pub(crate) fn plot(states: &[State]) -> Plot {
    let mut series: Vec<Series> = Vec::new();
    for found in states {
        let place = STATES.iter().zip([1.0, 2.0, 3.0]);
        let at = place
            .filter(|(state, _)| **state == found.state)
            .map(|(_, x)| x);
        let point = (at.sum(), 1.0 / found.seconds);
        match series.last_mut() {
            Some(last) if last.name == found.body => last.points.push(point),
            _ => series.push(Series {
                dots: false,
                name: found.body.to_owned(),
                points: vec![point],
            }),
        }
    }
    for (name, then) in ["block", "block, 436 nodes", "liver"].iter().zip(THEN) {
        series.push(Series {
            dots: false,
            name: format!("2014: {name}"),
            points: vec![(1.0, then), (3.0, then)],
        });
    }
    Plot {
        name: "chapter6",
        title: "Steps per second: hanging (1), cut once (2), cut twice (3)".to_owned(),
        x: Axis {
            label: "state of the body".to_owned(),
            scale: Scale::Linear,
        },
        y: Axis {
            label: "steps per second (1/s)".to_owned(),
            scale: Scale::Logarithmic,
        },
        series,
    }
}
