//! Bodies at rest: methods of drawing, measures of detail, radii, textures.

use std::io::Cursor;
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use phyxel_discretize::{Primitive, Solid, SurfaceSamples, sample_surfels, surface_mesh};
use phyxel_splat::{
    Camera, ColorScale, DrawMode, Frame, Image, ImageCoat, Measure, Overlay, RadiusRule,
    RenderSettings, Renderer, SplatView, Splats, Surface, Tissue, TissueTexture, fractal_noise,
    measures,
};

use super::exact::mean_square;
use super::sheet::{Panel, sheet};
use super::{at_rest, implicit};
use crate::report::Picture;
use crate::{Effort, StudyError};

/// A body of about one length unit, its size (m), the edges of its mesh (m), and where up is.
struct Model {
    solid: Solid,
    size: f64,
    edge: f64,
    turn: DMat3,
}

fn models() -> [Model; 2] {
    [
        Model {
            solid: implicit(Primitive::Liver),
            size: 0.166,
            edge: 0.003,
            turn: DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y),
        },
        Model {
            solid: implicit(Primitive::Box {
                half_extents: DVec3::new(0.05, 0.04, 0.045),
            }),
            size: 0.1,
            edge: 0.003,
            turn: DMat3::IDENTITY,
        },
    ]
}

impl Model {
    /// Surfels in the upright frame.
    fn surfels(&self, count: usize) -> Result<SurfaceSamples, StudyError> {
        let mesh = surface_mesh(&self.solid, self.edge)?;
        let mut surfels = sample_surfels(&mesh, count, Some(&self.solid));
        for vector in surfels.positions.iter_mut().chain(&mut surfels.normals) {
            *vector = self.turn * *vector;
        }
        Ok(surfels)
    }
}

/// A body on the stage.
struct Actor {
    tissue: Tissue,
    splats: Splats,
    colors: Vec<Vec3>,
    surfaces: Vec<Surface>,
    /// Fraction of their radius at which disks are drawn.
    share: f64,
    mode: DrawMode,
    size: [u32; 2],
}

impl Actor {
    fn new(
        model: &Model,
        count: usize,
        radius: RadiusRule,
        size: [u32; 2],
    ) -> Result<Self, StudyError> {
        let surfels = model.surfels(count)?;
        let tissue = at_rest(&surfels, radius)?;
        let splats = Splats::at_rest(tissue.surfels());
        let texture = TissueTexture::liver(model.size);
        Ok(Self {
            colors: texture.colors(tissue.surfels()),
            surfaces: texture.surfaces(),
            tissue,
            splats,
            share: 1.0,
            mode: DrawMode::ThreePass,
            size,
        })
    }

    fn draw(&self) -> Frame {
        let mut splats = self.splats.clone();
        let axes = splats.axes_u.iter_mut().chain(&mut splats.axes_v);
        axes.for_each(|axis| *axis *= self.share);
        let surfels = self.tissue.surfels();
        let radii: Vec<f64> = surfels.radii.iter().map(|r| r * self.share).collect();
        let [width, height] = self.size;
        let mut renderer = Renderer::new(RenderSettings {
            width,
            height,
            mode: self.mode,
            surfaces: self.surfaces.clone(),
            ..RenderSettings::default()
        });
        let bounds = |low: DVec3, high: DVec3, p: &DVec3| (low.min(*p), high.max(*p));
        let (low, high) = splats
            .positions
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
                bounds(low, high, p)
            });
        let aspect = f64::from(width) / f64::from(height);
        let view = DVec3::new(-0.35, 0.8, -0.45);
        let camera = Camera::framing(low, high, view, DVec3::Z, aspect);
        let view = SplatView {
            radii: &radii,
            ..self.tissue.view(&splats, &self.colors)
        };
        renderer.draw(&view, &[], &camera)
    }
}

/// Surfels of the body that radii and measures are shown with, and all pictures' size.
struct Sizes {
    few: usize,
    many: usize,
    frame: [u32; 2],
}

pub(crate) fn pictures(effort: Effort) -> Result<Vec<Picture>, StudyError> {
    let sizes = effort.choose(
        Sizes {
            few: 3_000,
            many: 30_000,
            frame: [480, 360],
        },
        Sizes {
            few: 600,
            many: 2_000,
            frame: [240, 180],
        },
    );
    let picture = |name: &str, title: &str, frame| Picture {
        name: name.to_owned(),
        title: title.to_owned(),
        frame,
    };
    Ok(vec![
        picture(
            "ways",
            "Ways of drawing the same surfels: squares (fig. 41), disks (figs 42 and 48a), one pass with \
             eq. (50) (figs 47 and 48b) and, not in the dissertation, three passes with a normal per pixel",
            ways(&sizes)?,
        ),
        picture(
            "measures",
            "What the neighbourhoods of surfels measure: density (fig. 50), curvature (fig. 53), \
             variation (fig. 54), which the radii drawn there are linear in; the 2 % of least and greatest values have the colours of the ends",
            measured(&sizes)?,
        ),
        picture(
            "radii",
            "Radii (figs 48c and 55): one size with the default's overdraw, one size without a hole, by \
             curvature, and the covering radii of the default; disks at a third of their radius, then \
             as drawn",
            radii(&sizes)?,
        ),
        picture(
            "textures",
            "Textures: noise in the volume, an image laid on from six sides, an image with the surfels \
             of an eighth of the number",
            textures(&sizes)?,
        ),
    ])
}

fn ways(sizes: &Sizes) -> Result<Frame, StudyError> {
    let mut panels = Vec::new();
    for model in &models() {
        for (mode, caption) in [
            (DrawMode::Squares, "squares (fig. 41)"),
            (DrawMode::Disks, "disks (figs 42, 48a)"),
            (DrawMode::SinglePass, "one pass (47, 48b)"),
            (DrawMode::ThreePass, "three passes (phyxel)"),
        ] {
            let mut actor = Actor::new(model, sizes.few, RadiusRule::Covering, sizes.frame)?;
            actor.mode = mode;
            panels.push(Panel::new(caption, actor.draw()));
        }
    }
    Ok(sheet(panels, 4))
}

fn measured(sizes: &Sizes) -> Result<Frame, StudyError> {
    let mut panels = Vec::new();
    for model in &models() {
        for (measure, caption, unit) in [
            (Measure::Density, "density (fig. 50)", "m"),
            (Measure::Curvature, "curvature (fig. 53)", "1/m"),
            (Measure::Variation, "variation (fig. 54)", ""),
        ] {
            let mut actor = Actor::new(model, sizes.many / 2, RadiusRule::Covering, sizes.frame)?;
            let values = measures(&actor.tissue.surfels().positions, measure, 12);
            let scale = middle(&values);
            actor.colors = scale.colors(&values);
            actor.surfaces = vec![Surface {
                specular: 0.0,
                ..Surface::default()
            }];
            let mut frame = actor.draw();
            Overlay::new(&mut frame).legend(&scale, unit);
            panels.push(Panel::new(caption, frame));
        }
    }
    Ok(sheet(panels, 3))
}

fn radii(sizes: &Sizes) -> Result<Frame, StudyError> {
    let mut panels = Vec::new();
    let model = &models()[1];
    let covering = Actor::new(model, sizes.few, RadiusRule::Covering, sizes.frame)?;
    let r = &covering.tissue.surfels().radii;
    let mean = mean_square(r).sqrt();
    let largest = r.iter().copied().fold(0.0, f64::max);
    let mapped = RadiusRule::Mapped {
        measure: Measure::Curvature,
        neighbors: 12,
        least: 0.8 * mean,
        most: 1.2 * mean,
        at_cuts: false,
    };
    for (share, note) in [(1.0 / 3.0, ": 1/3"), (1.0, "")] {
        for (rule, caption) in [
            (RadiusRule::Constant(mean), "one size, same overdraw"),
            (RadiusRule::Constant(largest), "one size, no hole"),
            (mapped, "by curvature"),
            (RadiusRule::Covering, "covering (default)"),
        ] {
            let mut actor = Actor::new(model, sizes.few, rule, sizes.frame)?;
            actor.share = share;
            panels.push(Panel::new(format!("{caption}{note}"), actor.draw()));
        }
    }
    Ok(sheet(panels, 4))
}

/// The range of most values: a few at folds and corners would leave one colour to the rest.
pub(crate) fn middle(values: &[f64]) -> ColorScale {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let few = sorted.len() / 50;
    ColorScale::of(&sorted[few..sorted.len() - few])
}

/// An image of vessels on tissue, as a file would hold it.
fn vessels() -> Result<Vec<u8>, StudyError> {
    const SIDE: u32 = 256;
    let mut frame = Frame::blank(SIDE, SIDE);
    let pixels = frame.pixels.iter_mut();
    for (pixel, k) in pixels.zip(0..) {
        // Noise around a torus repeats in both directions.
        let angle = |at: u32| std::f32::consts::TAU * (at as f32) / (SIDE as f32);
        let (u, v) = (angle(k % SIDE), angle(k / SIDE));
        let ring = 2.0 + 0.9 * v.cos();
        let at = Vec3::new(ring * u.cos(), ring * u.sin(), 0.9 * v.sin());
        let vessel = 1.0 - (10.0 * fractal_noise(at, 3).abs()).min(1.0);
        let patch = 0.5 + fractal_noise(at * 3.0 + 9.0, 2);
        let tissue = Vec3::new(0.62, 0.27, 0.20).lerp(Vec3::new(0.48, 0.17, 0.13), patch);
        let color = tissue.lerp(Vec3::new(0.16, 0.10, 0.30), vessel);
        let [r, g, b] = color.to_array().map(|c| (255.0 * c) as u8);
        *pixel = [r, g, b, 255];
    }
    let mut file = Vec::new();
    frame.write_png(&mut file)?;
    Ok(file)
}

fn textures(sizes: &Sizes) -> Result<Frame, StudyError> {
    let image = Arc::new(Image::read_png(Cursor::new(vessels()?))?);
    let mut panels = Vec::new();
    for model in &models() {
        for (count, coated, caption) in [
            (sizes.many, false, "noise in the volume"),
            (sizes.many, true, "image"),
            (sizes.many / 8, true, "image, fewer surfels"),
        ] {
            let mut actor = Actor::new(model, count, RadiusRule::Covering, sizes.frame)?;
            let coat = coated.then(|| ImageCoat {
                image: Arc::clone(&image),
                size: 0.4 * model.size,
            });
            actor.surfaces[0].coat = coat;
            panels.push(Panel::new(caption, actor.draw()));
        }
    }
    Ok(sheet(panels, 3))
}
