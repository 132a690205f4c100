//! The dissertation's figures of chapters 4 and 6 re-made on a block, a ring and an organ, ways of
//! drawing side by side: writes `ways.png` (figs 41-42, 47-48), `measures.png` (50, 53-54),
//! `radii.png` (55) and `cuts.png` (76-80).
//!
//! `cargo run --release -p phyxel-splat --example figures -- OUT_DIR`
#![allow(clippy::print_stdout, reason = "an example speaks to its reader")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    dead_code,
    missing_docs,
    reason = "the oracle is shared with a test"
)]

#[path = "../tests/oracle/mod.rs"]
mod oracle;

use glam::{DMat3, DVec3, Vec3};
use oracle::Shape;
use phyxel_splat::{
    Camera, ColorScale, DrawMode, Frame, Measure, Overlay, RadiusRule, RenderSettings, Renderer,
    SplatView, Splats, Tissue, TissueSettings, TissueTexture, measures,
};

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

const WIDTH: u32 = 480;
const HEIGHT: u32 = 360;

/// A body on the stage.
struct Actor {
    tissue: Tissue,
    splats: Splats,
    colors: Vec<Vec3>,
    /// Share of their radius at which disks are drawn.
    size: f64,
    mode: DrawMode,
}

impl Actor {
    fn new(shape: Shape, count: u32, radius: RadiusRule) -> Outcome<Self> {
        let (x, n, a) = shape.samples(count);
        let settings = TissueSettings {
            radius,
            ..TissueSettings::default()
        };
        let tissue = Tissue::new(&x, &n, &a, &[DVec3::ZERO], &settings)?;
        let splats = Splats::at_rest(tissue.surfels());
        let colors = TissueTexture::liver(2.0).colors(tissue.surfels());
        Ok(Self {
            tissue,
            splats,
            colors,
            size: 1.0,
            mode: DrawMode::ThreePass,
        })
    }

    fn draw(&self, caption: &str) -> Frame {
        let mut splats = self.splats.clone();
        let scaled = splats.axes_u.iter_mut().chain(&mut splats.axes_v);
        scaled.for_each(|a| *a *= self.size);
        let radii: Vec<f64> = self
            .tissue
            .surfels()
            .radii
            .iter()
            .map(|r| r * self.size)
            .collect();
        let mut renderer = Renderer::new(RenderSettings {
            width: WIDTH,
            height: HEIGHT,
            mode: self.mode,
            ..RenderSettings::default()
        });
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &p in &splats.positions {
            (low, high) = (low.min(p), high.max(p));
        }
        let aspect = f64::from(WIDTH) / f64::from(HEIGHT);
        let direction = DVec3::new(-0.45, -0.75, -0.9);
        let camera = Camera::framing(low, high, direction, DVec3::Y, aspect);
        let view = SplatView {
            radii: &radii,
            ..self.tissue.view(&splats, &self.colors)
        };
        let mut frame = renderer.draw(&view, &[], &camera);
        Overlay::new(&mut frame).text(12, 12, 2, caption);
        frame
    }
}

/// Frames side by side, `columns` to a row.
fn sheet(frames: &[Frame], columns: u32) -> Frame {
    let rows = (frames.len() as u32).div_ceil(columns);
    let (width, height) = (WIDTH * columns, HEIGHT * rows);
    let area = (width * height) as usize;
    let mut out = Frame {
        width,
        height,
        pixels: vec![[0, 0, 0, 255]; area],
        depth: vec![f32::INFINITY; area],
        normals: Vec::new(),
    };
    for (k, frame) in (0..).zip(frames) {
        Overlay::new(&mut out).place(k % columns * WIDTH, k / columns * HEIGHT, frame);
    }
    out
}

fn ways() -> Outcome<Frame> {
    let mut frames = Vec::new();
    for shape in [Shape::Block, Shape::Torus] {
        for (mode, caption) in [
            (DrawMode::Squares, "squares (fig 41)"),
            (DrawMode::Disks, "disks (fig 42)"),
            (DrawMode::SinglePass, "single pass (fig 47)"),
            (DrawMode::ThreePass, "three passes"),
        ] {
            let mut actor = Actor::new(shape, 3_000, RadiusRule::Covering)?;
            actor.mode = mode;
            frames.push(actor.draw(caption));
        }
    }
    Ok(sheet(&frames, 4))
}

fn measured() -> Outcome<Frame> {
    let mut frames = Vec::new();
    for shape in [Shape::Block, Shape::UnevenSphere] {
        for (measure, caption) in [
            (Measure::Density, "density (fig 50)"),
            (Measure::Curvature, "curvature (fig 53)"),
            (Measure::Variation, "variation (fig 54)"),
        ] {
            let mut actor = Actor::new(shape, 3_000, RadiusRule::Covering)?;
            let values = measures(&actor.tissue.surfels().positions, measure, 12);
            let scale = ColorScale::of(&values);
            actor.colors = scale.colors(&values);
            actor.size = 0.6;
            let mut frame = actor.draw(caption);
            Overlay::new(&mut frame).legend(&scale, "");
            frames.push(frame);
        }
    }
    Ok(sheet(&frames, 3))
}

fn radii() -> Outcome<Frame> {
    let mut frames = Vec::new();
    for shape in [Shape::UnevenSphere, Shape::Block] {
        let covering = Actor::new(shape, 1_500, RadiusRule::Covering)?;
        let r = &covering.tissue.surfels().radii;
        let mean = (r.iter().map(|r| r * r).sum::<f64>() / r.len() as f64).sqrt();
        let largest = r.iter().copied().fold(0.0, f64::max);
        let constant = Actor::new(shape, 1_500, RadiusRule::Constant(mean))?;
        frames.push(constant.draw("constant, same overdraw"));
        let constant = Actor::new(shape, 1_500, RadiusRule::Constant(largest))?;
        frames.push(constant.draw("constant, no hole"));
        frames.push(covering.draw("covering"));
    }
    Ok(sheet(&frames, 3))
}

/// A block cut `cuts` times by oblique planes, pieces drawn apart.
fn cut_block(cuts: usize, clip: bool) -> Outcome<Actor> {
    let (x, n, a) = Shape::Block.samples(6_000);
    let mut nodes = Vec::new();
    for i in 0..12 * 10 * 10 {
        let k = DVec3::new(
            f64::from(i % 12),
            f64::from(i / 12 % 10),
            f64::from(i / 120),
        );
        nodes.push((k - DVec3::new(5.5, 4.5, 4.5)) * 0.15);
    }
    let settings = TissueSettings {
        clip,
        ..TissueSettings::default()
    };
    let mut tissue = Tissue::new(&x, &n, &a, &nodes, &settings)?;
    let planes = [
        (DVec3::new(1.0, 0.15, 0.25).normalize(), -0.2),
        (DVec3::new(1.0, -0.2, -0.35).normalize(), 0.3),
    ];
    let side = |p: DVec3, k: usize| p.dot(planes[k].0) > planes[k].1;
    for (k, &(normal, offset)) in planes.iter().enumerate().take(cuts) {
        let (u, v) = normal.any_orthonormal_pair();
        let corner = |a: f64, b: f64| normal * offset + u * a + v * b;
        let quad = [
            corner(-2.0, -2.0),
            corner(2.0, -2.0),
            corner(2.0, 2.0),
            corner(-2.0, 2.0),
        ];
        let [p, q, r, s] = quad;
        let inside = |p: DVec3| Shape::Block.distance(p) < 0.0;
        let crosses = |a: DVec3, b: DVec3| (0..=k).any(|k| side(a, k) != side(b, k));
        tissue.cut(&[[p, q, r], [p, r, s]], &inside, &crosses)?;
    }
    // Pieces move apart along x and turn a little.
    let moved: Vec<(DVec3, DMat3)> = nodes
        .iter()
        .map(|&p| {
            let pieces = (0..cuts).filter(|&k| side(p, k)).count() as f64;
            let turn = DMat3::from_rotation_y(-0.12 * pieces);
            (turn * p + DVec3::X * (0.3 * pieces), turn)
        })
        .collect();
    let (positions, gradients): (Vec<_>, Vec<_>) = moved.into_iter().unzip();
    let mut splats = Splats::default();
    tissue.carry_into(&positions, &gradients, &mut splats);
    let colors = TissueTexture::liver(2.0).colors(tissue.surfels());
    Ok(Actor {
        tissue,
        splats,
        colors,
        size: 1.0,
        mode: DrawMode::ThreePass,
    })
}

fn cuts() -> Outcome<Frame> {
    let mut frames = Vec::new();
    let mut points = cut_block(0, true)?;
    points.size = 0.4;
    frames.push(points.draw("surfels (fig 76)"));
    frames.push(cut_block(1, true)?.draw("cut once (fig 78)"));
    frames.push(cut_block(2, true)?.draw("cut twice (fig 79)"));
    frames.push(cut_block(0, true)?.draw("uncut (fig 77)"));
    frames.push(cut_block(1, false)?.draw("once, not clipped"));
    frames.push(cut_block(2, false)?.draw("twice, not clipped (fig 80)"));
    Ok(sheet(&frames, 3))
}

fn main() -> Outcome<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "target".into());
    for (name, frame) in [
        ("ways", ways()?),
        ("measures", measured()?),
        ("radii", radii()?),
        ("cuts", cuts()?),
    ] {
        let path = format!("{folder}/{name}.png");
        frame.write_png(std::io::BufWriter::new(std::fs::File::create(&path)?))?;
        println!("wrote {path}");
    }
    Ok(())
}
