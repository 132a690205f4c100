//! Times carrying and drawing of a sphere of surfels, medians of several frames.
//!
//! `cargo run --release -p phyxel-splat --example speed -- [SURFELS]`
#![allow(clippy::print_stdout, reason = "an example speaks to its reader")]

use glam::{DMat3, DVec3};
use phyxel_splat::{
    Camera, RenderSettings, Renderer, Splats, Tissue, TissueSettings, TissueTexture,
};
use std::time::Instant;

/// Median of `n` timings (ms), after one run that does not count.
fn median(n: usize, mut f: impl FnMut()) -> f64 {
    f();
    let mut times: Vec<f64> = (0..n)
        .map(|_| {
            let start = Instant::now();
            f();
            1e3 * start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[n / 2]
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let count: u32 = std::env::args().nth(1).map_or(Ok(100_000), |a| a.parse())?;
    let (mut x, mut n, mut a) = (vec![], vec![], vec![]);
    for i in 0..count {
        let y = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(count);
        let turn = f64::from(i) * 2.399_963_229_728_653;
        let ring = (1.0 - y * y).sqrt();
        let p = DVec3::new(ring * turn.cos(), y, ring * turn.sin());
        x.push(p * 0.1);
        n.push(p);
        a.push(4.0 * std::f64::consts::PI * 0.01 / f64::from(count));
    }
    let mut nodes = Vec::new();
    for i in 0..20_i32.pow(3) {
        let p = DVec3::new(
            f64::from(i % 20),
            f64::from(i / 20 % 20),
            f64::from(i / 400),
        );
        nodes.push((p - 9.5) * 0.01);
    }
    let start = Instant::now();
    let tissue = Tissue::new(&x, &n, &a, &nodes, &TissueSettings::default())?;
    println!(
        "{count} surfels set up in {:.0} ms",
        1e3 * start.elapsed().as_secs_f64()
    );
    let all: Vec<u32> = (0..count).collect();
    let radii = median(3, || drop(phyxel_splat::covering_radii(&x, &n, &all)));
    println!("radii of all: {radii:.0} ms");

    let gradients = vec![DMat3::IDENTITY; nodes.len()];
    let mut splats = Splats::default();
    let carry = median(15, || tissue.carry_into(&nodes, &gradients, &mut splats));
    println!("carry: {carry:.2} ms");
    let texture = TissueTexture::liver(0.2);
    let colors = texture.colors(tissue.surfels());
    let view = tissue.view(&splats, &colors);
    let half = DVec3::splat(0.1);
    let camera = Camera::framing(
        -half,
        half,
        DVec3::new(-0.3, -0.5, -1.0),
        DVec3::Y,
        16.0 / 9.0,
    );
    for samples in [1, 2] {
        let mut renderer = Renderer::new(RenderSettings {
            samples,
            surfaces: texture.surfaces(),
            ..RenderSettings::default()
        });
        let mut covered = 0;
        let draw = median(9, || {
            let frame = renderer.draw(&view, &[], &camera);
            covered = frame.depth.iter().filter(|d| d.is_finite()).count();
        });
        println!(
            "draw 1280x720, {samples}x{samples} samples: {draw:.1} ms, {:.1} frames/s, {:.2} million \
             splats/s, {covered} pixels covered",
            1e3 / draw,
            f64::from(count) / draw / 1e3
        );
    }
    Ok(())
}
