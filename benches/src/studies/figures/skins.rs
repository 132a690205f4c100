//! Figures 43 to 46, 62, 64 and 65: splats by their weight, and samples on a cut; and eq. (59).

use glam::{DMat3, DVec2, DVec3, Vec3};
use phyxel_discretize::{Primitive, Solid, SurfaceSamples, sample_surfels, surface_mesh};
use phyxel_splat::{
    Camera, CutSampler, DrawMode, Frame, RadiusRule, RenderSettings, Renderer, SplatView, Splats,
    Surfels, Tissue, TissueSettings,
};

use super::Drawn;
use super::canvas::{Image, View};
use crate::StudyError;
use crate::studies::splat::{at_rest, implicit};

/// Splats (m) in a plane, each of its colour.
fn flat(places: &[DVec2], colors: &[Vec3], mode: DrawMode) -> Result<Frame, StudyError> {
    let surfels = SurfaceSamples {
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
    let three = [at(-0.5, -0.3), at(0.5, -0.3), at(0.0, 0.5)];
    let colors = [red, green, blue];
    let one = (43, &[DVec2::ZERO][..], &colors[..1]);
    let three = (45, &three[..], &colors[..]);
    let mut drawn = Vec::new();
    for ((number, places, colors), mode, caption) in [
        (one, DrawMode::SinglePass, "one splat, weighted"),
        (one, DrawMode::Disks, "the same, not weighted"),
        (three, DrawMode::Disks, "three disks"),
        (three, DrawMode::SinglePass, "blended from back to front"),
        (three, DrawMode::ThreePass, "blended in three passes"),
    ] {
        drawn.push(Drawn {
            number,
            caption: caption.to_owned(),
            frame: flat(places, colors, mode)?,
        });
    }
    drawn.extend(twisted()?);
    drawn.extend(samples()?);
    drawn.extend(insides()?);
    Ok(drawn)
}

/// Samples on two pairs of triangles that reach out of a ball, and those of them that lie in it.
fn samples() -> Result<Vec<Drawn>, StudyError> {
    let ball = Primitive::Ellipsoid {
        semi_axes: DVec3::splat(0.36),
    };
    let solid = implicit(ball);
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

/// A bar whose nodes are twisted about its axis, carried by eq. (59) and by the default.
fn twisted() -> Result<Vec<Drawn>, StudyError> {
    let half = DVec3::new(0.035, 0.035, 0.105);
    let bar = Primitive::Box { half_extents: half };
    let solid = implicit(bar);
    let surfels = sample_surfels(&surface_mesh(&solid, 0.004)?, 6_000, Some(&solid));
    // Nodes 17.5 mm apart, those of the surface half of it below.
    let along =
        |n: u32, half: f64, k: u32| half * ((2.0 * f64::from(k) + 1.0) / f64::from(n) - 1.0);
    let nodes: Vec<DVec3> = (0..4 * 4 * 12)
        .map(|k| {
            let (x, y) = (along(4, half.x, k % 4), along(4, half.y, k / 4 % 4));
            DVec3::new(x, y, along(12, half.z, k / 16))
        })
        .collect();
    let rate = 150.0_f64.to_radians() / (2.0 * half.z);
    let moved: Vec<DVec3> = nodes
        .iter()
        .map(|&p| DMat3::from_rotation_z(rate * p.z) * p)
        .collect();
    let gradients: Vec<DMat3> = nodes
        .iter()
        .zip(&moved)
        .map(|(p, x)| {
            let turn = DMat3::from_rotation_z(rate * p.z);
            DMat3::from_cols(
                turn.x_axis,
                turn.y_axis,
                DVec3::Z + rate * DVec3::Z.cross(*x),
            )
        })
        .collect();
    let tissue = Tissue::new(
        &surfels.positions,
        &surfels.normals,
        &surfels.areas,
        &nodes,
        &TissueSettings::default(),
    )?;
    let colors: Vec<Vec3> = tissue
        .surfels()
        .positions
        .iter()
        .map(|p| {
            let odd = [p.x, p.y, p.z].map(|x| (x / 0.0175).floor().rem_euclid(2.0));
            if odd.iter().sum::<f64>().rem_euclid(2.0) < 0.5 {
                Vec3::new(0.35, 0.07, 0.05)
            } else {
                Vec3::new(0.55, 0.30, 0.22)
            }
        })
        .collect();
    let theirs = averaged_displacements(&tissue, &nodes, &moved);
    let mut ours = Splats::default();
    tissue.carry_into(&moved, &gradients, &mut ours);
    let forward = DVec3::new(-0.5, 1.0, -0.35);
    let camera = Camera::framing(-1.2 * half, 1.2 * half, forward, DVec3::Z, 1.0);
    let mut renderer = Renderer::new(RenderSettings {
        width: 480,
        height: 480,
        ..RenderSettings::default()
    });
    let panels = [("eq. (59)", &theirs), ("affine average (default)", &ours)];
    let drawn = panels.map(|(caption, splats)| Drawn {
        number: 59,
        caption: caption.to_owned(),
        frame: renderer.draw(&tissue.view(splats, &colors), &[], &camera),
    });
    Ok(drawn.into())
}

/// Surfels moved by the displacements of their nodes alone, Aras 2014, eq. (59) with the sum that its numerator lacks
/// in print: `x = X + Σ w_i u_i / Σ w_i`. The disks' axes are the derivative of that map.
fn averaged_displacements(tissue: &Tissue, rest: &[DVec3], moved: &[DVec3]) -> Splats {
    let (surfels, binding) = (tissue.surfels(), tissue.binding());
    let mut splats = Splats::at_rest(surfels);
    for (i, radius) in surfels.radii.iter().enumerate() {
        let (row, weights) = binding.row(i);
        let (mut u, mut v) = Surfels::tangents(surfels.normals[i]);
        for ((&node, &weight), slope) in row.iter().zip(weights).zip(binding.slopes(i)) {
            let displacement = moved[node as usize] - rest[node as usize];
            splats.positions[i] += displacement * weight;
            u += displacement * slope[0];
            v += displacement * slope[1];
        }
        splats.normals[i] = u.cross(v).normalize_or(surfels.normals[i]);
        (splats.axes_u[i], splats.axes_v[i]) = (u * *radius, v * *radius);
        // All that displacements know of a normal is one for the whole disk.
        (
            splats.normal_derivatives_u[i],
            splats.normal_derivatives_v[i],
        ) = (DVec3::ZERO, DVec3::ZERO);
    }
    splats
}

/// What the test of the two nearest surfels says in a section of three bodies.
fn insides() -> Result<Vec<Drawn>, StudyError> {
    /// A field that is negative inside.
    type Field = fn(DVec3) -> f64;
    let cuboid: Field = |p| (p.abs() - DVec3::new(0.35, 0.3, 0.3)).max_element();
    let notched: Field = |p| {
        let whole = (p.abs() - DVec3::new(0.35, 0.35, 0.3)).max_element();
        // A corner is missing.
        whole.max((-p.x).min(-p.y))
    };
    let plate: Field = |p| (p.abs() - DVec3::new(0.4, 0.015, 0.3)).max_element();
    let mut drawn = Vec::new();
    for (caption, value) in [
        ("convex rims", cuboid),
        ("a concave rim", notched),
        ("a thin plate", plate),
    ] {
        let bounds = phyxel_discretize::Bounds::new(DVec3::splat(-0.42), DVec3::splat(0.42));
        let solid = Solid::implicit(bounds, value);
        let surfels = sample_surfels(&surface_mesh(&solid, 0.012)?, 500, Some(&solid));
        let tissue = at_rest(&surfels, RadiusRule::Covering)?;
        let image = Image::painted(|p| {
            let p = (p - 0.5).extend(0.02);
            let inside = value(p) < 0.0;
            match (inside, tissue.is_behind_surfels(p) == inside) {
                (_, false) => [200.0, 60.0, 50.0],
                (true, true) => [40.0, 150.0, 60.0],
                (false, true) => [126.0, 134.0, 142.0],
            }
        });
        drawn.push(Drawn::new(65, caption, &image));
    }
    Ok(drawn)
}
