//! Splats against exact pictures: holes, strays, depth and normal error, overdraw and time, for a
//! sphere, a torus and a box, each radius rule and three surfel counts.
//!
//! `cargo run --release -p phyxel-splat --example exact`
#![allow(clippy::print_stdout, reason = "an example speaks to its reader")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    missing_docs,
    reason = "counts of an example are small"
)]

#[path = "../tests/oracle/mod.rs"]
mod oracle;

use glam::{DVec3, Vec3};
use oracle::{Shape, compare};
use phyxel_splat::{
    Camera, Measure, RadiusRule, RenderSettings, Renderer, Splats, Tissue, TissueSettings,
};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "{:8} {:>7} {:22} {:>8} {:>7} {:>7} {:>9} {:>9} {:>8}",
        "shape", "surfels", "radii", "overdraw", "holes", "strays", "depth", "normal", "ms"
    );
    println!(
        "{:48} {:>7} {:>7} {:>7} {:>9} {:>9}",
        "", "1", "px", "px", "rms/size", "degrees"
    );
    for shape in Shape::ALL {
        for n in [1_000, 10_000, 100_000] {
            let (x, normals, areas) = shape.samples(n);
            let area: f64 = areas.iter().sum();
            let covering = RadiusRule::Covering.radii(&x, &normals);
            let squares: f64 = covering.iter().map(|r| r * r).sum();
            let mean = (squares / x.len() as f64).sqrt();
            let mapped = |measure| RadiusRule::Mapped {
                measure,
                neighbors: 12,
                least: 0.8 * mean,
                most: 1.2 * mean,
            };
            let rules = [
                ("covering", RadiusRule::Covering),
                ("constant, same overdraw", RadiusRule::Constant(mean)),
                ("density, eq. 52", mapped(Measure::Density)),
                ("curvature, eqs 53-56", mapped(Measure::Curvature)),
                ("variation, eq. 57", mapped(Measure::Variation)),
            ];
            for (name, radius) in rules {
                let settings = TissueSettings {
                    radius,
                    ..TissueSettings::default()
                };
                let tissue = Tissue::new(&x, &normals, &areas, &[DVec3::ZERO], &settings)?;
                let splats = Splats::at_rest(tissue.surfels());
                let colors = vec![Vec3::splat(0.5); x.len()];
                let mut renderer = Renderer::new(RenderSettings {
                    width: 640,
                    height: 480,
                    samples: 1,
                    keep_normals: true,
                    ..RenderSettings::default()
                });
                let low = DVec3::splat(-1.0);
                let view = DVec3::new(-0.5, -0.7, -1.0);
                let camera = Camera::framing(low, -low, view, DVec3::Y, 4.0 / 3.0);
                let frame = renderer.draw(&tissue.view(&splats, &colors), &[], &camera);
                let start = Instant::now();
                for _ in 0..5 {
                    renderer.draw(&tissue.view(&splats, &colors), &[], &camera);
                }
                let ms = start.elapsed().as_secs_f64() * 200.0;
                let d = compare(shape, &camera, &frame);
                let disks: f64 = tissue.surfels().radii.iter().map(|r| r * r).sum();
                println!(
                    "{:8} {:7} {:23} {:7.2} {:7} {:7} {:9.2e} {:9.3} {:8.1}",
                    format!("{shape:?}"),
                    x.len(),
                    name,
                    disks * std::f64::consts::PI / area,
                    d.holes,
                    d.strays,
                    d.depth / 2.0,
                    d.normal,
                    ms
                );
            }
        }
    }
    Ok(())
}
