//! Splats against exact pictures of surfaces that rays can be traced to.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use phyxel_discretize::{Bounds, Primitive, Solid, SurfaceSamples, sample_surfels, surface_mesh};
use phyxel_splat::{
    Camera, Lens, Measure, RadiusRule, RenderSettings, Renderer, Splat, Surfel, Tissue,
};
use rayon::prelude::*;
use testkit::picture::{Difference, Hit, RIM, compare};

use super::{at_rest, implicit};
use crate::report::{Plot, Report, Table, median_time, plots, row};
use crate::{Effort, StudyError};

/// Radii of the torus (m).
const RING: f64 = 0.7;
const TUBE: f64 = 0.3;
/// Distance (m) at which a ray counts as at the surface; bodies are about 2 m large.
const TOUCH: f64 = 1e-7;
/// Pictures of which the median time is taken.
const PICTURES: usize = 5;

/// Bodies whose signed distances are exact.
fn bodies() -> [(&'static str, Solid); 3] {
    let semi_axes = DVec3::ONE;
    let half = DVec3::new(RING + TUBE, RING + TUBE, TUBE);
    let ring = |p: DVec3| (p.truncate().length() - RING).hypot(p.z) - TUBE;
    let half_extents = DVec3::new(0.8, 0.6, 0.7);
    [
        ("ball", implicit(Primitive::Ellipsoid { semi_axes })),
        ("torus", Solid::implicit(Bounds::new(-half, half), ring)),
        ("box", implicit(Primitive::Box { half_extents })),
    ]
}

/// The exact picture: a hit per pixel, row-major.
pub(crate) struct Exact {
    width: u32,
    height: u32,
    hits: Vec<Option<Hit>>,
}

impl Exact {
    /// A solid in a frame of `width` x `height` pixels, and the camera that sees it.
    pub(crate) fn framed(solid: &Solid, width: u32, height: u32) -> (Camera, Self) {
        let bounds = solid.bounds();
        let view = DVec3::new(-0.5, 0.8, -0.7);
        let aspect = f64::from(width) / f64::from(height);
        let camera = Camera::framing(bounds.min, bounds.max, view, DVec3::Z, aspect);
        let (w, h) = (f64::from(width), f64::from(height));
        let focal = focal(&camera);
        let ray = |pixel: u32| {
            let (x, y) = (f64::from(pixel % width), f64::from(pixel / width));
            let across = (x + 0.5 - 0.5 * w) / (focal * h);
            let up = (0.5 * h - (y + 0.5)) / (focal * h);
            (camera.forward + camera.right * across + camera.up * up).normalize()
        };
        let hits = (0..width * height).into_par_iter().map(|pixel| {
            let along = ray(pixel);
            let at = trace(solid, camera.eye, along)?;
            Some(Hit {
                depth: (at - camera.eye).dot(camera.forward),
                normal: solid.normal(at),
            })
        });
        let hits = hits.collect();
        let exact = Self {
            width,
            height,
            hits,
        };
        (camera, exact)
    }

    /// How far the picture of a tissue at rest is off, one sample a pixel, and the median time (s) of so many.
    pub(crate) fn drawn(
        &self,
        tissue: &Tissue,
        camera: &Camera,
        times: usize,
    ) -> (Difference, f64) {
        let splats: Vec<Splat> = tissue.surfels().iter().map(Surfel::at_rest).collect();
        let colors = vec![Vec3::splat(0.5); splats.len()];
        let mut renderer = Renderer::new(RenderSettings {
            width: self.width,
            height: self.height,
            samples: 1,
            keep_normals: true,
            ..RenderSettings::default()
        });
        let (frame, seconds) = median_time(times, || {
            renderer.draw(&tissue.view(&splats, &colors), &[], camera)
        });
        let found = compare(self.width as usize, &self.hits, &frame.depth, |pixel| {
            let n = frame.normals[pixel].as_dvec3();
            camera.right * n.x + camera.up * n.y - camera.forward * n.z
        });
        (found, seconds)
    }
}

fn focal(camera: &Camera) -> f64 {
    let Lens::Perspective { focal } = camera.lens else {
        unreachable!("the study's camera is one with perspective");
    };
    focal
}

/// Follows a ray by the signed distance.
fn trace(solid: &Solid, from: DVec3, along: DVec3) -> Option<DVec3> {
    let far = from.length() + 4.0;
    let mut gone = 0.0;
    while gone < far {
        let at = from + along * gone;
        let distance = solid.signed_distance(at);
        if distance < TOUCH {
            return Some(at);
        }
        gone += distance;
    }
    None
}

/// How far disks stand out over the outline (pixels): those that are drawn, and at the least those of
/// the tissue's number that cover its area.
///
/// A disk of radius r that touches a surface with a radius of curvature R reaches √(R² + r²) from the
/// centre of curvature. No plane is covered by fewer disks than in the hexagonal arrangement, each of
/// which covers 3√3/2 r² alone.
fn standing_out(tissue: &Tissue, area: f64, camera: &Camera, height: u32) -> [f64; 2] {
    let surfels = tissue.surfels();
    let least = (2.0 * area / (27.0_f64.sqrt() * surfels.len().max(1) as f64)).sqrt();
    let mut most = [0.0_f64; 2];
    for surfel in surfels {
        let shape = surfel.shape;
        let curvature = 0.5 * (shape.x + shape.z) + (0.5 * (shape.x - shape.z)).hypot(shape.y);
        if curvature <= 0.0 {
            continue;
        }
        let round = 1.0 / curvature;
        let away = (surfel.position - camera.eye).dot(camera.forward);
        let per_metre = focal(camera) * f64::from(height) / away;
        for (most, radius) in most.iter_mut().zip([surfel.radius, least]) {
            *most = most.max((round.hypot(radius) - round) * per_metre);
        }
    }
    most
}

/// The radius rules; all but the default and the largest draw as much as the default does: the mean
/// square of their radii is the same.
fn rules(surfels: &SurfaceSamples) -> Vec<(&'static str, RadiusRule)> {
    let of = |rule: RadiusRule| rule.radii(&surfels.positions, &surfels.normals);
    let covering = of(RadiusRule::Covering);
    let mean = mean_square(&covering).sqrt();
    let largest = covering.iter().copied().fold(0.0, f64::max);
    let mapped = |measure| {
        let scaled = |scale: f64| RadiusRule::Mapped {
            measure,
            neighbors: 12,
            least: 0.8 * mean * scale,
            most: 1.2 * mean * scale,
            at_cuts: false,
        };
        scaled(mean / mean_square(&of(scaled(1.0))).sqrt())
    };
    vec![
        ("covering (default)", RadiusRule::Covering),
        ("one radius", RadiusRule::Constant(mean)),
        ("one radius, the largest", RadiusRule::Constant(largest)),
        ("density, eq. (52)", mapped(Measure::Density)),
        ("curvature, eqs (53)-(56)", mapped(Measure::Curvature)),
        ("variation, eq. (57)", mapped(Measure::Variation)),
    ]
}

pub(crate) fn mean_square(radii: &[f64]) -> f64 {
    let count = radii.len().max(1) as f64;
    radii.iter().map(|r| r * r).sum::<f64>() / count
}

/// Radius rules, surfel counts, bodies: how far off each picture is.
pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let (counts, width, height): (&[usize], u32, u32) = effort.choose(
        (&[1_000, 3_000, 10_000, 30_000, 100_000], 640, 480),
        (&[1_000, 5_000], 320, 240),
    );
    let mut rows = Vec::new();
    for (body, solid) in bodies() {
        let (camera, exact) = Exact::framed(&solid, width, height);
        let mesh = surface_mesh(&solid, 0.06)?;
        for &count in counts {
            let surfels = sample_surfels(&mesh, count, Some(&solid));
            let area: f64 = surfels.areas.iter().sum();
            for (rule, radius) in rules(&surfels) {
                let tissue = at_rest(&surfels, radius)?;
                let (found, seconds) = exact.drawn(&tissue, &camera, PICTURES);
                let [drawn, least] = standing_out(&tissue, area, &camera, height);
                let disks = tissue.surfels().iter().map(|s| PI * s.radius * s.radius);
                let disks: f64 = disks.sum();
                rows.push(row![
                    body,
                    rule,
                    surfels.positions.len(),
                    disks / area,
                    found.holes,
                    found.strays,
                    100.0 * found.outline,
                    1e3 * found.depth,
                    found.normal,
                    1e3 * seconds,
                    drawn,
                    least
                ]);
            }
        }
    }
    let table = Table::new(
        "rules",
        "Pictures of splats against exact ones",
        "body; radii; surfels (1); overdraw (1); holes (pixels); strays (pixels); \
         outline (%); depth (mm); normal (degrees); picture (ms); standing out (pixels); \
         at least (pixels)",
        rows,
    );
    let plots = of_ball(&table);
    let words = format!(
        "Bodies about 2 m large, their surfels sampled as a scene's are, drawn with {width} x {height} pixels and \
         compared with pictures of rays traced by the signed distance. Holes and strays are pixels more than one \
         pixel inside or outside the exact outline; the outline's error counts every pixel that one picture \
         covers and the other does not. Depth (root mean square) and normal (mean) are compared more than {RIM} \
         pixels from edges."
    );
    let words = [&words, OF_RULES, OF_FLAT_DISKS];
    Ok(Report::new(&words, vec![table], plots))
}

/// The rows of the ball as plots.
fn of_ball(table: &Table) -> Vec<Plot> {
    let mut ball = table.clone();
    ball.rows.retain(|row| row[0].word() == "ball");
    let lines = |x, y| ball.lines("radii", x, y);
    plots![
        "normal" "Ball: error of the normals against surfels",
            log "surfels", log "mean angle between normals (degrees)" => lines("surfels", "normal");
        "depth" "Ball: error of the depth against surfels",
            log "surfels", log "RMS error of the depth (mm)" => lines("surfels", "depth");
        "outline" "Ball: error of the outline against surfels",
            log "surfels",
            log "pixels covered by one picture only (%), none not shown" => lines("surfels", "outline");
        "time" "Ball: error of the normals against the time of a picture",
            linear "time of a picture (ms)",
            log "mean angle between normals (degrees)" => lines("picture", "normal");
    ]
}

const OF_RULES: &str = "One radius and the dissertation's rules (a range of 2 to 3) are scaled to the overdraw of the default, \
     the disks' area over the body's, so that all of them draw as much; one radius as large as the default's largest \
     shows what it takes to leave no hole with one size. Creases of the box are compared: a pixel on the wrong side of \
     one counts as 90 degrees. Times are medians, all threads; plots are of the ball.";

const OF_FLAT_DISKS: &str = "A flat disk stands out where it touches the outline of a curved body: by sqrt(R^2 + r^2) - R for a \
     radius r and a radius of curvature R. The last columns give the most that any of the disks drawn can, and what \
     the smallest disks would that cover the body with as many (arranged in hexagons): where that is above one pixel, \
     no choice of radii keeps the outline within one.";
