//! Time of every stage of a frame, as the surfels become more.

use glam::{DMat3, DVec3};
use phyxel_splat::{
    Camera, RenderSettings, Renderer, Tissue, TissueSettings, TissueTexture, covering_radii,
};

use crate::report::{Table, median_time, row};
use crate::{Effort, StudyError};
use testkit::cloud::{golden_sphere, lattice};

/// Radius of the ball (m).
const RADIUS: f64 = 0.1;
/// Nodes along an edge of the cube around the ball, and their distance (m).
const NODES: usize = 20;
const SPACING: f64 = 0.01;

/// Positions, normals and areas.
pub(super) type Samples = (Vec<DVec3>, Vec<DVec3>, Vec<f64>);

/// Evenly spread samples of the ball, on a golden spiral.
pub(super) fn ball(count: u32) -> Samples {
    let area = 4.0 * std::f64::consts::PI * RADIUS * RADIUS / f64::from(count);
    let out = golden_sphere(count);
    let areas = vec![area; out.len()];
    (out.iter().map(|x| *x * RADIUS).collect(), out, areas)
}

pub(crate) fn table(effort: Effort) -> Result<Table, StudyError> {
    let counts: &[u32] = effort.choose(&[10_000, 100_000, 1_000_000], &[10_000]);
    let middle = 0.5 * (NODES - 1) as f64;
    let nodes = lattice([NODES; 3], 1.0, 0.0, 0);
    let nodes: Vec<DVec3> = nodes.iter().map(|at| (*at - middle) * SPACING).collect();
    let turn = DMat3::from_rotation_x(0.1);
    let moved: Vec<DVec3> = nodes.iter().map(|&x| turn * x).collect();
    let gradients = vec![turn; nodes.len()];
    let texture = TissueTexture::liver(2.0 * RADIUS);
    let half = DVec3::splat(RADIUS);
    let view = DVec3::new(-0.3, -0.5, -1.0);
    let camera = Camera::framing(-half, half, view, DVec3::Y, 16.0 / 9.0);
    let mut rows = Vec::new();
    for &count in counts {
        let times = if count > 100_000 { 3 } else { 9 };
        let (x, n, areas) = ball(count);
        let (_, radii) = median_time(times, || covering_radii(&x, &n));
        let settings = TissueSettings::default();
        let (tissue, set_up) = median_time(1, || Tissue::new(&x, &n, &areas, &nodes, &settings));
        let tissue = tissue?;
        let mut splats = Vec::new();
        tissue.carry_into(&moved, &gradients, &mut splats);
        let ((), carry) = median_time(times, || tissue.carry_into(&moved, &gradients, &mut splats));
        let colors = texture.colors(tissue.surfels());
        let mut row = row![count as usize, 1e3 * radii, 1e3 * set_up, 1e3 * carry];
        for samples in [1, 2] {
            let mut renderer = Renderer::new(RenderSettings {
                samples,
                surfaces: texture.surfaces(),
                ..RenderSettings::default()
            });
            let view = tissue.view(&splats, &colors);
            renderer.draw(&view, &[], &camera);
            let (_, draw) = median_time(times, || renderer.draw(&view, &[], &camera));
            let splats = 1e-6 * f64::from(count) / draw;
            row.extend(row![1e3 * draw, 1.0 / draw, splats]);
        }
        rows.push(row);
    }
    Ok(Table::new(
        "speed",
        "Stages of a picture: one sample a pixel, and four as by default",
        "surfels (1); radii (ms); set up (ms); carry (ms); picture (ms); rate (1/s); \
         splats (million/s); 2x2 picture (ms); 2x2 rate (1/s); 2x2 splats (million/s)",
        rows,
    ))
}
