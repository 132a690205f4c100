//! Figures 43 to 46, 62 and 64: splats by their weight, and samples on a cut.

use glam::{DVec2, DVec3, Vec3};
use phyxel_discretize::{Shape, Solid, Surfels, sample_surfels, surface_mesh};
use phyxel_splat::{
    Camera, CutSampler, DrawMode, Frame, RadiusRule, RenderSettings, Renderer, SplatView, Splats,
};

use super::Drawn;
use super::canvas::{Image, View};
use crate::StudyError;
use crate::studies::splat::at_rest;

/// Splats (m) in a plane, each of its colour.
fn flat(places: &[DVec2], colors: &[Vec3], mode: DrawMode) -> Result<Frame, StudyError> {
    let surfels = Surfels {
        positions: places.iter().map(|p| p.extend(0.0)).collect(),
        normals: vec![DVec3::Z; places.len()],
        areas: vec![1.0; places.len()],
    };
    let tissue = at_rest(&surfels, RadiusRule::Constant(1.0))?;
    let splats = Splats::at_rest(tissue.surfels());
    let settings = RenderSettings {
        width: 360,
        height: 360,
        mode,
        ..RenderSettings::default()
    };
    let size = DVec3::new(1.6, 1.6, 0.0);
    let camera = Camera::framing(-size, size, DVec3::NEG_Z, DVec3::Y, 1.0);
    let view = SplatView {
        radii: &tissue.surfels().radii,
        ..tissue.view(&splats, colors)
    };
    Ok(Renderer::new(settings).draw(&view, &[], &camera))
}

pub(super) fn draw() -> Result<Vec<Drawn>, StudyError> {
    let (red, green, blue) = (
        Vec3::new(0.7, 0.1, 0.1),
        Vec3::new(0.1, 0.6, 0.15),
        Vec3::new(0.1, 0.2, 0.7),
    );
    let at = DVec2::new;
    let one = ([at(0.0, 0.0)], [red]);
    let three = (
        [at(-0.5, -0.3), at(0.5, -0.3), at(0.0, 0.5)],
        [red, green, blue],
    );
    let mut drawn = Vec::new();
    for (number, mode, caption) in [
        (43, DrawMode::SinglePass, "one splat, weighted"),
        (43, DrawMode::Disks, "the same, not weighted"),
    ] {
        drawn.push(Drawn {
            number,
            caption: caption.to_owned(),
            frame: flat(&one.0, &one.1, mode)?,
        });
    }
    for (mode, caption) in [
        (DrawMode::Disks, "three disks"),
        (DrawMode::SinglePass, "blended from back to front"),
        (DrawMode::ThreePass, "blended in three passes"),
    ] {
        drawn.push(Drawn {
            number: 45,
            caption: caption.to_owned(),
            frame: flat(&three.0, &three.1, mode)?,
        });
    }
    drawn.extend(samples()?);
    Ok(drawn)
}

/// Samples on two pairs of triangles that reach out of a ball, and those of them that lie in it.
fn samples() -> Result<Vec<Drawn>, StudyError> {
    let ball = Shape::Ellipsoid {
        semi_axes: DVec3::splat(0.36),
    };
    let solid = Solid::implicit(ball.bounds(), move |p| ball.value(p));
    let surfels = sample_surfels(&surface_mesh(&solid, 0.03)?, 2_500, Some(&solid));
    let tissue = at_rest(&surfels, RadiusRule::Covering)?;
    let edge = |x: f64, y: f64| [DVec3::new(x, y, -0.5), DVec3::new(x, y + 0.06, 0.5)];
    let edges = [edge(-0.5, -0.1), edge(-0.1, 0.05), edge(0.3, 0.02)];
    let pieces: Vec<[DVec3; 3]> = edges
        .windows(2)
        .flat_map(|w| {
            let ([a, b], [c, d]) = (w[0], w[1]);
            [[a, b, c], [c, b, d]]
        })
        .collect();
    let view = View::from(DVec3::new(-0.3, -1.0, 0.35));
    let middle = DVec3::splat(0.5);
    let mut drawn = Vec::new();
    for density in [400.0, 1_600.0] {
        let points = CutSampler::new(density).points(&pieces);
        for test in [false, true] {
            let mut image = Image::new();
            for w in edges.windows(2) {
                for (from, to) in [
                    (w[0][0], w[0][1]),
                    (w[0][0], w[1][0]),
                    (w[0][1], w[1][1]),
                    (w[0][1], w[1][0]),
                    (w[1][0], w[1][1]),
                ] {
                    view.line(&mut image, middle + from, middle + to, [0.0; 3]);
                }
            }
            for &point in &points {
                let colour = match test {
                    true if tissue.is_behind_surfels(point) => [40.0, 150.0, 60.0],
                    true => [200.0, 60.0, 50.0],
                    false => [70.0, 110.0, 220.0],
                };
                for axis in DVec3::AXES {
                    let reach = 0.006 * axis;
                    view.line(
                        &mut image,
                        middle + point - reach,
                        middle + point + reach,
                        colour,
                    );
                }
            }
            let (number, what) = if test {
                (64, "inside (green)")
            } else {
                (62, "samples")
            };
            drawn.push(Drawn::new(
                number,
                format!("{what}, {density} a unit of area"),
                &image,
            ));
        }
    }
    Ok(drawn)
}
