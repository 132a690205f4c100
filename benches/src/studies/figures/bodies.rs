//! Figures 74 to 84: the bodies of chapter 6, by the embedded scenes of their names.

use phyxel::World;
use phyxel::scene::{Pictures, Show, View};
use phyxel_cli::picture::{Painter, Style};
use phyxel_splat::{
    Frame, Measure, Overlay, RadiusRule, RenderSettings, Renderer, SplatView, Splats, Surface,
    TissueSettings, measures,
};

use super::Drawn;
use crate::studies::chapter6::{MODELS, STATES, overrides};
use crate::studies::splat::{spacing, stills::middle};
use crate::{Effort, StudyError};

/// Size (pixels) of a picture.
const SIZE: [u32; 2] = [540, 480];
/// How much nearer the pictures of radii are.
const NEAR: f64 = 3.0;
/// Nearest surfels by which curvature is estimated.
const NEIGHBORS: u32 = 12;

/// How a state is drawn.
struct Look {
    figure: u32,
    /// Place in [`STATES`].
    state: usize,
    caption: &'static str,
    scale: f64,
    colored: bool,
    show: Show,
    /// Radii by curvature: whether they are measured again at cuts.
    at_cuts: Option<bool>,
}

const fn look(figure: u32, state: usize, caption: &'static str) -> Look {
    Look {
        figure,
        state,
        caption,
        scale: 1.0,
        colored: false,
        show: Show::Surface,
        at_cuts: None,
    }
}

const fn small(figure: u32, state: usize, caption: &'static str) -> Look {
    Look {
        scale: 0.5,
        colored: true,
        ..look(figure, state, caption)
    }
}

/// With radii by curvature, kept or measured again at cuts.
const fn radii(figure: u32, state: usize, caption: &'static str, at_cuts: bool) -> Look {
    Look {
        scale: 0.4,
        at_cuts: Some(at_cuts),
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
    radii(78, 1, "radii kept", false),
    radii(78, 1, "radii measured again", true),
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
    let changes: &[&str] = effort.choose(
        &["bodies[0].surfels.target=Count(12000)"],
        &[
            "bodies[0].surfels.target=Count(2000)",
            "integration.settle.limit=0.3",
        ],
    );
    let changes = overrides(changes)?;
    let scene = phyxel_scene::embedded(name, &changes)?;
    let mut view = scene.pictures.clone().unwrap_or_default().view;
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
    let spacing = spacing(&Painter::new(&world, &plain)?);
    let painters = looks.iter().map(|look| {
        let mut view = view;
        if let View::Around { zoom, .. } = &mut view {
            if look.colored {
                // The legend has the right of the picture.
                *zoom = zoom.min(0.75);
            }
            if look.at_cuts.is_some() {
                *zoom *= NEAR;
            }
        }
        let pictures = Pictures {
            view,
            splat_scale: look.scale,
            show: look.show,
            ..plain.clone()
        };
        let radius = look.at_cuts.map(|at_cuts| RadiusRule::Mapped {
            measure: Measure::Curvature,
            neighbors: NEIGHBORS,
            least: 0.3 * spacing,
            most: 1.2 * spacing,
            at_cuts,
        });
        // Without the blade, which would stand before the liver.
        let style = Style {
            tissue: TissueSettings {
                radius: radius.unwrap_or_default(),
                ..TissueSettings::default()
            },
            bare: true,
            ..Style::default()
        };
        Painter::styled(&world, &pictures, &style)
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
                        let frame = if look.colored {
                            by_curvature(painter, &world, look.scale)
                        } else {
                            painter.draw(&world)
                        };
                        (look.caption, frame)
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

/// The surface in colours of the curvature of eq. (56), disks at a fraction of their radius.
fn by_curvature(painter: &Painter, world: &World, share: f64) -> Frame {
    let tissue = painter.tissue(0);
    let body = &world.members()[0].body;
    let mut splats = Splats::default();
    let gradients = body.elastic.deformation_gradients();
    tissue.carry_into(&body.smoothed_positions(), &gradients, &mut splats);
    let values = measures(&splats.positions, Measure::Curvature, NEIGHBORS as usize);
    let scale = middle(&values);
    let colors = scale.colors(&values);
    let axes = splats.axes_u.iter_mut().chain(&mut splats.axes_v);
    axes.for_each(|axis| *axis *= share);
    let radii: Vec<f64> = tissue.surfels().radii.iter().map(|r| share * r).collect();
    let dull = Surface {
        specular: 0.0,
        ..Surface::default()
    };
    let (camera, ..) = painter.view();
    let mut renderer = Renderer::new(RenderSettings {
        surfaces: vec![dull; 2],
        ..painter.settings().clone()
    });
    let view = SplatView {
        radii: &radii,
        ..tissue.view(&splats, &colors)
    };
    let mut frame = renderer.draw(&view, &[], &camera);
    Overlay::new(&mut frame).legend(&scale, "curvature (1/m)");
    frame
}
