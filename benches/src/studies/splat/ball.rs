//! A ball of points with normals against its exact picture, as `benches/peers/pictures.py` draws it with pyvista.

use std::time::Instant;

use glam::{DVec3, Vec3};
use phyxel_splat::{Camera, RenderSettings, Renderer, Splat, SplatView, Surfel};

use super::speed;
use crate::report::{Table, median_time, row};
use crate::{Effort, StudyError};

/// Eye's distance from the middle of the ball (radii).
const AWAY: f64 = 4.0;
/// Vertical field of view (degrees).
const VIEW: f64 = 35.0;

pub(crate) fn table(effort: Effort) -> Result<Table, StudyError> {
    let count = effort.choose(100_000, 10_000);
    let (_, ball, _) = speed::ball(count);
    let start = Instant::now();
    let surfels = Surfel::covering(&ball, &ball)?;
    let splats: Vec<Splat> = surfels.iter().map(Surfel::at_rest).collect();
    let colors = vec![Vec3::new(0.5, 0.1, 0.08); ball.len()];
    let view = SplatView::new(&splats, &surfels, &colors);
    let eye = DVec3::NEG_Y * AWAY;
    let camera = Camera::looking_at(eye, DVec3::ZERO, DVec3::Z, VIEW.to_radians());
    let mut renderer = Renderer::new(RenderSettings::default());
    renderer.draw(&view, &[], &camera);
    let first = start.elapsed().as_secs_f64();
    let (frame, time) = median_time(5, || renderer.draw(&view, &[], &camera));
    let (width, height) = (f64::from(frame.width), f64::from(frame.height));
    let scale = (0.5 * VIEW).to_radians().tan() / (0.5 * height);
    let (mut holes, mut outside, mut squares, mut covered) = (0, 0, 0.0, 0.0);
    for (k, depth) in (0_u32..).zip(&frame.depth) {
        let x = (f64::from(k % frame.width) + 0.5 - 0.5 * width) * scale;
        let y = (f64::from(k / frame.width) + 0.5 - 0.5 * height) * scale;
        let square = 1.0 + x * x + y * y;
        let inside = AWAY * AWAY - (AWAY * AWAY - 1.0) * square;
        match (inside > 0.0, depth.is_finite()) {
            (true, true) => {
                let exact = (AWAY - inside.sqrt()) / square;
                squares += (f64::from(*depth) - exact).powi(2);
                covered += 1.0;
            }
            (true, false) => holes += 1,
            (false, seen) => outside += usize::from(seen),
        }
    }
    Ok(Table::new(
        "ball",
        "A ball of points with normals at 1280 x 720, as benches/peers/pictures.py has it",
        "points (1); picture (ms); first picture (ms); holes (px); outside (px); \
         depth, RMS (radii)",
        vec![row![
            count as usize,
            1e3 * time,
            1e3 * first,
            holes,
            outside,
            (squares / f64::max(covered, 1.0)).sqrt()
        ]],
    ))
}
