//! Points and normals to a lit picture.

use phyxel_splat::glam::{DVec3, Vec3};
use phyxel_splat::{Camera, RenderSettings, Renderer, Splat, SplatView, Surfel};

/// Points along a spiral on a ball, whose normals they are too.
fn ball(count: i32) -> Vec<DVec3> {
    let height = |i| 1.0 - f64::from(2 * i + 1) / f64::from(count);
    let around = |i| DVec3::new((2.4 * f64::from(i)).cos(), (2.4 * f64::from(i)).sin(), 0.0);
    let at = |i| around(i) * (1.0 - height(i).powi(2)).sqrt() + DVec3::Z * height(i);
    (0..count).map(at).collect()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let points = ball(4000);
    let surfels = Surfel::covering(&points, &points)?;
    let splats: Vec<Splat> = surfels.iter().map(Surfel::at_rest).collect();
    let colors = vec![Vec3::new(0.5, 0.1, 0.08); points.len()];
    let camera = Camera::around(&points, DVec3::new(-1.0, 0.6, -0.4), 16.0 / 9.0);
    let view = SplatView::new(&splats, &surfels, &colors);
    let frame = Renderer::new(RenderSettings::default()).draw(&view, &[], &camera);
    let file = std::env::temp_dir().join("ball.png");
    frame.write_png(std::fs::File::create(file)?)?;
    // As many pixels as the ball's outline holds, which stands out a little over the half axes.
    let seen = frame.depth.iter().filter(|d| d.is_finite()).count();
    let radius = camera.project(DVec3::ZERO, 1280, 720).1 - camera.project(camera.up, 1280, 720).1;
    let ratio = seen as f64 / (std::f64::consts::PI * radius * radius);
    assert!((1.0..1.1).contains(&ratio), "{ratio}");
    Ok(())
}
