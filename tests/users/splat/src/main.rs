//! Points and normals to a lit picture.

use std::fs::File;

use phyxel_splat::{Camera, RenderSettings, Renderer, SplatView, Splats, Surfels};
use phyxel_splat::glam::{DVec3, Vec3};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Points along a spiral on a ball, whose normals they are too.
    let turn = |i: i32| (f64::from(i) * 2.399_963, 1.0 - f64::from(2 * i + 1) / 4000.0);
    let points: Vec<DVec3> = (0..4000).map(turn).map(|(a, z)| (DVec3::new(a.cos(), a.sin(), 0.0) * (1.0 - z * z).sqrt()).with_z(z)).collect();

    let surfels = Surfels::covering(&points, &points)?;
    let colors = vec![Vec3::new(0.5, 0.1, 0.08); points.len()];
    let camera = Camera::around(&points, DVec3::new(-1.0, 0.6, -0.4), 16.0 / 9.0);
    let view = (Splats::at_rest(&surfels), colors);
    let frame = Renderer::new(RenderSettings::default()).draw(&SplatView::new(&view.0, &surfels, &view.1), &[], &camera);
    frame.write_png(File::create(std::env::temp_dir().join("ball.png"))?)?;

    // The ball's outline is a disk: as many pixels as it must have, no hole in it.
    let seen = frame.depth.iter().filter(|depth| depth.is_finite()).count();
    println!("{seen} pixels of {}", frame.depth.len());
    assert!((0.25..0.45).contains(&(seen as f64 / frame.depth.len() as f64)));
    Ok(())
}
