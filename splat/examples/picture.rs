//! Points and normals to a lit picture: points, their disks and the lit surface side by side, as at the top of the README.
//!
//! `cargo run --release -p phyxel-splat --example picture -- splat/knot.png`. Fails if the surface has a hole.

#![allow(clippy::print_stdout, reason = "it says what it drew")]

use std::f64::consts::TAU;
use std::fs::File;

use phyxel_splat::glam::{DVec3, Vec3};
use phyxel_splat::{Camera, Frame, RenderSettings, Renderer, Splat, SplatView, Surfel};

/// Points on a tube around a trefoil knot, with their normals and colours.
fn knot(along: u32, round: u32) -> (Vec<DVec3>, Vec<DVec3>, Vec<Vec3>) {
    let centre = |t: f64| {
        let (sin, cos) = (2.0 * t).sin_cos();
        DVec3::new(t.sin() + 2.0 * sin, t.cos() - 2.0 * cos, -(3.0 * t).sin())
    };
    let (mut points, mut normals, mut colors) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..along {
        // Every other ring is turned by half a step, so that the points lie like bees' cells.
        let t = TAU * f64::from(i) / f64::from(along);
        let ahead = (centre(t + 1e-4) - centre(t - 1e-4)).normalize();
        let out = (centre(t) * DVec3::new(1.0, 1.0, 0.0)).normalize();
        let side = ahead.cross(out).normalize();
        let up = side.cross(ahead);
        for k in 0..round {
            let (sin, cos) =
                (TAU * (f64::from(k) + 0.5 * f64::from(i % 2)) / f64::from(round)).sin_cos();
            let normal = side * cos + up * sin;
            points.push(centre(t) + normal * 0.55);
            normals.push(normal);
            let hue = t + TAU * f64::from(k) / f64::from(round);
            let share = |shift: f64| 0.5 + 0.5 * (hue + shift).cos();
            colors.push(
                DVec3::new(
                    0.08 + 0.5 * share(0.0),
                    0.05 + 0.16 * share(2.1),
                    0.06 + 0.3 * share(4.2),
                )
                .as_vec3(),
            );
        }
    }
    (points, normals, colors)
}

/// Writes colours alone, packed as far as they can be: the crate's package carries the picture.
fn write_small(frame: &Frame, file: File) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(file, frame.width, frame.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    // Lit noise: every filter makes the file larger, the usual one by 6 %.
    encoder.set_filter(png::Filter::NoFilter);
    let colors: Vec<u8> = (frame.pixels.iter())
        .flat_map(|&[red, green, blue, _]| [red, green, blue])
        .collect();
    encoder.write_header()?.write_image_data(&colors)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = std::env::args().nth(1).ok_or("name the file to write")?;
    let (points, normals, colors) = knot(270, 36);

    let surfels = Surfel::covering(&points, &normals)?;
    let (width, height) = (336, 240);
    let aspect = f64::from(width) / f64::from(height);
    let camera = Camera::around(&points, DVec3::new(0.25, 0.55, -1.0), aspect);
    let settings = RenderSettings {
        width,
        height,
        ..RenderSettings::default()
    };
    let mut renderer = Renderer::new(settings);
    let mut draw = |share: f64| {
        let mut smaller = surfels.clone();
        smaller.iter_mut().for_each(|disk| disk.radius *= share);
        let splats: Vec<Splat> = smaller.iter().map(Surfel::at_rest).collect();
        renderer.draw(&SplatView::new(&splats, &smaller, &colors), &[], &camera)
    };
    // A fifth of the radius is a point; with 0.55 of it disks stand apart; with all of it they just cover.
    let (dots, disks, frame) = (draw(0.22), draw(0.55), draw(1.0));

    let mut row = Frame::blank(3 * width, height);
    let columns = usize::try_from(width)?;
    for (y, line) in row.pixels.chunks_exact_mut(3 * columns).enumerate() {
        for (part, of) in line.chunks_exact_mut(columns).zip([&dots, &disks, &frame]) {
            part.copy_from_slice(&of.pixels[y * columns..(y + 1) * columns]);
        }
    }
    write_small(&row, File::create(&file)?)?;
    // A hole is a pixel of the background with the body on all four sides.
    let (width, depth) = (usize::try_from(frame.width)?, &frame.depth);
    let seen = |at: usize| depth[at].is_finite();
    let inner = width..depth.len() - width;
    let around = |at: usize| [at - 1, at + 1, at - width, at + width];
    let holes = inner
        .filter(|&at| !seen(at) && around(at).into_iter().all(seen))
        .count();
    println!("{} surfels, {holes} holes: {file}", surfels.len());
    assert_eq!(holes, 0, "the disks do not cover");
    Ok(())
}
