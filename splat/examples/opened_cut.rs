//! An ellipsoid cut from above, its halves opened: writes `opened_cut.png` to the folder given.
//!
//! `cargo run --release -p phyxel-splat --example opened_cut -- OUT_DIR`
#![allow(clippy::print_stdout, reason = "an example speaks to its reader")]

use glam::{DMat3, DVec3};
use phyxel_splat::{
    Camera, Mesh, RenderSettings, Renderer, Splats, Tissue, TissueSettings, TissueTexture,
};
use std::time::Instant;

const HALF: DVec3 = DVec3::new(0.09, 0.045, 0.06);
/// The cut: the plane x = 0 above this height (m).
const FLOOR: f64 = -0.008;

/// Evenly spread surfels on an ellipsoid: a golden spiral, areas from the map of the sphere.
fn ellipsoid(n: u32) -> (Vec<DVec3>, Vec<DVec3>, Vec<f64>) {
    let mut out = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..n {
        let y = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(n);
        let turn = f64::from(i) * 2.399_963_229_728_653;
        let ring = (1.0 - y * y).sqrt();
        let p = DVec3::new(ring * turn.cos(), y, ring * turn.sin());
        let scaled = p / HALF * HALF.element_product();
        out.0.push(p * HALF);
        out.1.push(scaled.normalize());
        out.2
            .push(4.0 * std::f64::consts::PI / f64::from(n) * scaled.length());
    }
    out
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "target".into());
    let (positions, normals, areas) = ellipsoid(20_000);
    let inside = |p: DVec3| (p / HALF).length_squared() < 1.0;
    let spacing = 0.009;
    let mut nodes = Vec::new();
    for i in -10..10 {
        for j in -6..6 {
            for k in -7..7 {
                let half = DVec3::splat(0.5);
                let p = (DVec3::new(f64::from(i), f64::from(j), f64::from(k)) + half) * spacing;
                if (p / (HALF * 1.05)).length_squared() < 1.0 {
                    nodes.push(p);
                }
            }
        }
    }
    let mut tissue = Tissue::new(
        &positions,
        &normals,
        &areas,
        &nodes,
        &TissueSettings::default(),
    )?;
    // A blade drawn along z in twelve strips.
    let edge = |step: i32| -0.05 + 0.105 * f64::from(step) / 12.0;
    let start = Instant::now();
    let mut total = 0;
    for step in 0..12 {
        let (z0, z1) = (edge(step), edge(step + 1));
        let (a, b) = (DVec3::new(0.0, FLOOR, z0), DVec3::new(0.0, 0.08, z0));
        let (c, d) = (DVec3::new(0.0, FLOOR, z1), DVec3::new(0.0, 0.08, z1));
        let crosses = |p: DVec3, q: DVec3| {
            let t = p.x / (p.x - q.x);
            let at = p.lerp(q, t);
            (p.x < 0.0) != (q.x < 0.0) && at.y > FLOOR && at.z > -0.05 && at.z < z1
        };
        total += tissue.cut(&[[a, b, c], [c, b, d]], &inside, &crosses)?.skin;
    }
    println!(
        "new skin: {total} surfels in {:.1} ms",
        1e3 * start.elapsed().as_secs_f64()
    );

    // Each side turns about the cut's floor; the turn fades below it and towards the cut's ends.
    let bend = |x: DVec3| {
        let depth = ((x.y - FLOOR) / 0.04).clamp(0.0, 1.0);
        let middle = (1.0 - (x.z / 0.056).powi(2)).max(0.0);
        let side = if x.x < 0.0 { 1.0 } else { -1.0 };
        let near = (-(x.x / 0.05).powi(2)).exp();
        x - DVec3::X * (side * 0.016 * depth * middle * near)
    };
    let moved: Vec<DVec3> = nodes.iter().map(|&x| bend(x)).collect();
    let gradients: Vec<DMat3> = nodes
        .iter()
        .map(|&x| {
            let h = 1e-5;
            let d = |e: DVec3| (bend(x + e * h) - bend(x - e * h)) / (2.0 * h);
            DMat3::from_cols(d(DVec3::X), d(DVec3::Y), d(DVec3::Z))
        })
        .collect();
    let mut splats = Splats::default();
    tissue.carry_into(&moved, &gradients, &mut splats);

    let texture = TissueTexture::liver(0.18);
    let colors = texture.colors(tissue.surfels());
    let mut renderer = Renderer::new(RenderSettings {
        surfaces: texture.surfaces(),
        ..RenderSettings::default()
    });
    let view = tissue.view(&splats, &colors);
    let tools = Mesh::scalpel(
        DVec3::new(0.0, 0.0, 0.05),
        DVec3::new(0.0, 0.035, 0.062),
        DVec3::new(0.0, 0.4, 1.0),
    );
    for (name, direction) in [
        ("opened_cut", DVec3::new(-0.35, -0.8, -0.6)),
        ("opened_cut_low", DVec3::new(-0.5, -0.45, -0.9)),
        ("opened_cut_top", DVec3::new(0.0, -1.0, -0.2)),
    ] {
        let camera = Camera::framing(-HALF, HALF, direction, DVec3::Y, 16.0 / 9.0);
        let start = Instant::now();
        let frame = renderer.draw(&view, &tools, &camera);
        println!(
            "{} surfels drawn in {:.1} ms",
            tissue.surfels().len(),
            1e3 * start.elapsed().as_secs_f64()
        );
        let path = format!("{folder}/{name}.png");
        frame.write_png(std::io::BufWriter::new(std::fs::File::create(&path)?))?;
        println!("wrote {path}");
    }
    Ok(())
}
