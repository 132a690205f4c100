//! Draws a ball of 100,000 points with normals at 1280 x 720, and says how long it takes and how far off it is.
//!
//! `cargo run --release -p phyxel-splat --example ball`; the same with pyvista is `python3 benches/peers/pictures.py`.
//! Fails if the ball has a hole.

#![allow(clippy::print_stdout, reason = "it says what it measured")]

use std::error::Error;
use std::time::Instant;

use phyxel_splat::glam::{DVec3, Vec3};
use phyxel_splat::{Camera, Lens, RenderSettings, Renderer, SplatView, Splats, Surfels};

const COUNT: u32 = 100_000;
/// Eye's distance from the middle of the ball (radii).
const AWAY: f64 = 4.0;
/// Half the height of what is seen, at distance 1: 35 degrees from bottom to top.
const HALF_HEIGHT: f64 = 0.315_298_788_878_983_9;

fn main() -> Result<(), Box<dyn Error>> {
    let at = |i: u32| {
        let (height, around) = (
            1.0 - f64::from(2 * i + 1) / f64::from(COUNT),
            2.399_963_229_728_653 * f64::from(i),
        );
        let (sin, cos) = around.sin_cos();
        DVec3::new(cos, sin, 0.0) * (1.0 - height * height).sqrt() + DVec3::Z * height
    };
    let ball: Vec<DVec3> = (0..COUNT).map(at).collect();
    let start = Instant::now();
    let surfels = Surfels::covering(&ball, &ball)?;
    let splats = Splats::at_rest(&surfels);
    let colors = vec![Vec3::new(0.5, 0.1, 0.08); ball.len()];
    let view = SplatView::new(&splats, &surfels, &colors);
    let made = start.elapsed();
    let camera = Camera {
        eye: DVec3::NEG_Y * AWAY,
        right: DVec3::X,
        up: DVec3::Z,
        forward: DVec3::Y,
        lens: Lens::Perspective {
            focal: 0.5 / HALF_HEIGHT,
        },
    };
    let mut renderer = Renderer::new(RenderSettings::default());
    let first = Instant::now();
    let mut frame = renderer.draw(&view, &[], &camera);
    let first = made + first.elapsed();
    let mut times: Vec<f64> = Vec::new();
    for _ in 0..5 {
        let start = Instant::now();
        frame = renderer.draw(&view, &[], &camera);
        times.push(1e3 * start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    let (width, height) = (f64::from(frame.width), f64::from(frame.height));
    let scale = HALF_HEIGHT / (0.5 * height);
    let (mut holes, mut outside, mut squares, mut count) = (0, 0, 0.0, 0.0);
    for (row, depths) in (0_u32..).zip(frame.depth.chunks_exact(frame.width as usize)) {
        for (column, depth) in (0_u32..).zip(depths) {
            let x = (f64::from(column) + 0.5 - 0.5 * width) * scale;
            let y = (f64::from(row) + 0.5 - 0.5 * height) * scale;
            let square = 1.0 + x * x + y * y;
            let inside = AWAY * AWAY - (AWAY * AWAY - 1.0) * square;
            let seen = depth.is_finite();
            if inside <= 0.0 {
                outside += u32::from(seen);
            } else if !seen {
                holes += 1;
            } else {
                let exact = (AWAY - inside.sqrt()) / square;
                squares += (f64::from(*depth) - exact).powi(2);
                count += 1.0;
            }
        }
    }
    println!(
        "phyxel-splat: {:.0} ms a picture ({:.0} the first, radii included), {holes} holes, {outside} pixels outside, \
         depth {:.1e}",
        times[2],
        1e3 * first.as_secs_f64(),
        (squares / f64::max(count, 1.0)).sqrt()
    );
    assert_eq!(holes, 0, "the disks do not cover");
    Ok(())
}
