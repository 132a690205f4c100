//! A block and a liver before a cut, after one and after two, in three styles.

use phyxel_splat::{DrawMode, InsideTest, Measure, RadiusRule, TissueSettings, WeightLaw};

use super::sheet::{Panel, sheet};
use super::spacing;
use crate::report::Picture;
use crate::studies::chapter6::overrides;
use crate::{Effort, StudyError};
use phyxel::World;
use phyxel::scene::{Pictures, View};
use phyxel_cli::picture::{Painter, Style};

/// An embedded scene and when its first cut is done (s).
struct Play {
    scene: &'static str,
    name: &'static str,
    between: f64,
    /// Size in the frame.
    zoom: f64,
    /// The frame's width over its height.
    aspect: f64,
    title: &'static str,
    figures: [&'static str; 3],
}

const PLAYS: [Play; 2] = [
    Play {
        scene: "block",
        name: "block",
        between: 1.1,
        zoom: 0.56,
        aspect: 0.75,
        title: "A hanging block before its cuts (fig. 77), cut once (as in 78) and twice (as in 79, 80), with splats of full size",
        figures: ["fig. 77", "cut as in 78", "as in 79, 80"],
    },
    Play {
        scene: "liver",
        name: "liver",
        between: 1.65,
        zoom: 1.75,
        aspect: 4.0 / 3.0,
        title: "A hanging liver before its cuts (fig. 83), cut once (84b) and twice (not in the dissertation)",
        figures: ["fig. 83", "fig. 84b", "cut twice"],
    },
];

/// Styles side by side: the default, without clipping, and the dissertation's chapters 4 and 5, for
/// surfels so far apart (m).
fn styles(spacing: f64) -> [(&'static str, Style); 3] {
    let plain = TissueSettings {
        clip: false,
        ..TissueSettings::default()
    };
    let dissertation = TissueSettings {
        weights: WeightLaw::Gaussian,
        radius: RadiusRule::Mapped {
            measure: Measure::Curvature,
            neighbors: 12,
            least: 0.8 * spacing,
            most: 1.2 * spacing,
            at_cuts: true,
        },
        inside: InsideTest::TwoNearest,
        ..plain.clone()
    };
    let style = |tissue, mode| Style {
        tissue,
        mode,
        bare: true,
    };
    [
        (
            "default",
            style(TissueSettings::default(), DrawMode::ThreePass),
        ),
        ("not clipped", style(plain, DrawMode::ThreePass)),
        ("as in 2014", style(dissertation, DrawMode::SinglePass)),
    ]
}

pub(crate) fn pictures(effort: Effort) -> Result<Vec<Picture>, StudyError> {
    PLAYS.iter().map(|play| played(play, effort)).collect()
}

fn played(play: &Play, effort: Effort) -> Result<Picture, StudyError> {
    let (changes, height): (&[&str], u32) = effort.choose(
        (&[], 480),
        (
            &[
                "bodies[0].sampling.target=Nodes(500)",
                "bodies[0].surfels.target=Count(3000)",
                "integration.settle.limit=0.4",
            ],
            180,
        ),
    );
    let width = (f64::from(height) * play.aspect) as u32;
    let scene = phyxel_scene::embedded(play.scene, &overrides(changes)?)?;
    let mut view = scene
        .pictures
        .as_ref()
        .map(|pictures| pictures.view)
        .unwrap_or_default();
    if let View::Around { zoom, .. } = &mut view {
        *zoom = play.zoom;
    }
    let pictures = Pictures {
        width,
        height,
        view,
        ..Pictures::default()
    };
    let duration = scene.integration.duration;
    let mut world = World::new(scene)?;
    let spacing = spacing(&Painter::new(&world, &pictures)?);
    let styles = styles(spacing);
    let mut painters = styles
        .iter()
        .map(|(_, style)| Painter::styled(&world, &pictures, style))
        .collect::<Result<Vec<_>, _>>()?;
    let mut columns = Vec::new();
    while world.is_settling() {
        step(&mut world, &mut painters)?;
    }
    world.start_scene()?;
    for until in [0.0, play.between, duration] {
        while world.scene_time().is_some_and(|time| time < until) {
            step(&mut world, &mut painters)?;
        }
        grow(&mut world, &mut painters)?;
        let frames = painters.iter_mut().map(|painter| {
            painter.carry(&world);
            painter.draw(&world)
        });
        columns.push(frames.collect::<Vec<_>>());
    }
    let mut panels = Vec::new();
    for (row, (name, _)) in styles.iter().enumerate() {
        for (column, figure) in columns.iter().zip(play.figures) {
            panels.push(Panel::new(format!("{figure}: {name}"), column[row].clone()));
        }
    }
    Ok(Picture {
        name: play.name.to_owned(),
        title: format!(
            "{}: clipped and blended in three passes (default), not clipped, and by the dissertation's \
             own rules (radii by curvature, Gaussian weights, fig. 65's inside test, one pass)",
            play.title
        ),
        frame: sheet(panels, 3),
    })
}

/// Grows skin on what was cut and takes a step.
fn step(world: &mut World, painters: &mut [Painter]) -> Result<(), StudyError> {
    grow(world, painters)?;
    Ok(world.step()?)
}

fn grow(world: &mut World, painters: &mut [Painter]) -> Result<(), StudyError> {
    let pieces = world.take_new_pieces();
    for painter in painters {
        painter.grow(world, &pieces)?;
    }
    Ok(())
}
