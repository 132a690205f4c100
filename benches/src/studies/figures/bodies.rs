//! Figures 74 to 84: the bodies of chapter 6, by the embedded scenes of their names.

use phyxel::picture::Painter;
use phyxel::scene::{Coloring, Pictures, Scene, Show, View};
use phyxel::world::World;
use phyxel_splat::Frame;

use super::Drawn;
use crate::studies::hanging::{MODELS, STATES, overrides};
use crate::{Effort, StudyError};

/// Size (pixels) of a picture.
const SIZE: [u32; 2] = [360, 480];
/// Curvature (1/m) of the last colour: an edge of a block that one surfel spans has a few hundred.
const CURVATURE: f64 = 150.0;

/// How a state is drawn.
struct Look {
    figure: u32,
    /// Place in [`STATES`].
    state: usize,
    caption: &'static str,
    scale: f64,
    colored: bool,
    show: Show,
}

const fn look(figure: u32, state: usize, caption: &'static str) -> Look {
    Look {
        figure,
        state,
        caption,
        scale: 1.0,
        colored: false,
        show: Show::Surface,
    }
}

const fn small(figure: u32, state: usize, caption: &'static str) -> Look {
    Look {
        scale: 0.5,
        colored: true,
        ..look(figure, state, caption)
    }
}

const fn nodes(figure: u32) -> Look {
    Look {
        show: Show::Neighbors { node: None },
        ..look(figure, 0, "nodes and pairs")
    }
}

const BLOCK: &[Look] = &[
    nodes(74),
    small(76, 0, "scaled down, by curvature"),
    look(77, 0, "hanging"),
    small(78, 1, "cut once"),
    small(79, 2, "cut through"),
    look(80, 1, "cut once"),
    look(80, 2, "cut through"),
];
const HIERARCHICAL: &[Look] = &[nodes(75)];
const LIVER: &[Look] = &[
    nodes(81),
    small(82, 0, "scaled down, by curvature"),
    look(83, 0, "hanging"),
    small(84, 1, "(a) scaled down"),
    look(84, 1, "(b)"),
];

pub(super) fn draw(effort: Effort) -> Result<Vec<Drawn>, StudyError> {
    let mut drawn = Vec::new();
    for (body, looks) in [
        ("block-1408", BLOCK),
        ("block-436", HIERARCHICAL),
        ("liver-181", LIVER),
    ] {
        for (suffix, model) in MODELS {
            drawn.extend(play(&format!("{body}{suffix}"), model, looks, effort)?);
        }
    }
    Ok(drawn)
}

/// Draws a scene in its states. A body that blows up is drawn no further.
fn play(name: &str, model: &str, looks: &[Look], effort: Effort) -> Result<Vec<Drawn>, StudyError> {
    let changes: &[&str] = match effort {
        Effort::Full => &["bodies[0].surfels.target=Count(12000)"],
        Effort::Quick => &[
            "bodies[0].surfels.target=Count(2000)",
            "integration.settle.limit=0.3",
        ],
    };
    let changes = overrides(changes)?;
    let scene = Scene::embedded(name, &changes)?;
    let mut view = scene.pictures.unwrap_or_default().view;
    if let View::Around { zoom, .. } = &mut view {
        *zoom = if name.starts_with("block") { 0.75 } else { 1.2 };
    }
    let [width, height] = SIZE;
    let plain = Pictures {
        width,
        height,
        view,
        ..Pictures::default()
    };
    let mut world = World::new(scene)?;
    let painters = looks.iter().map(|look| {
        let color = if look.colored {
            Coloring::Curvature { most: CURVATURE }
        } else {
            Coloring::Tissue
        };
        let pictures = Pictures {
            color,
            splat_scale: look.scale,
            show: look.show,
            ..plain
        };
        Painter::new(&world, &pictures)
    });
    let mut painters = painters.collect::<Result<Vec<_>, _>>()?;
    let mut drawn = Vec::new();
    let last = looks.iter().map(|look| look.state).max().unwrap_or(0);
    let mut ended = world.settle().err();
    for (state, (_, time)) in STATES.into_iter().enumerate().take(last + 1) {
        while ended.is_none() && world.scene_time().is_some_and(|now| now < time) {
            ended = world.step().err();
            let pieces = world.take_new_pieces();
            for painter in &mut painters {
                painter.grow(&world, &pieces)?;
            }
        }
        for (look, painter) in looks.iter().zip(&mut painters) {
            if look.state == state {
                let (caption, frame) = match &ended {
                    Some(_) => ("blew up", Frame::blank(width, height)),
                    None => {
                        painter.carry(&world);
                        (look.caption, painter.draw(&world))
                    }
                };
                drawn.push(Drawn {
                    number: look.figure,
                    caption: format!("{caption}: {model}"),
                    frame,
                });
            }
        }
    }
    Ok(drawn)
}
