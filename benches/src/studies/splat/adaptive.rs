//! Radii that follow curvature against one radius, at equal number and overdraw.

use std::f64::consts::PI;

use glam::DVec3;
use phyxel_discretize::{Bounds, Primitive, Solid, SurfaceSamples, surface_mesh};
use phyxel_splat::{RadiusRule, covering_radii};

use super::exact::{Exact, mean_square};
use super::{at_rest, implicit};
use crate::report::{Table, row};
use crate::{Effort, StudyError};
use phyxel::scene::SurfelSpacing;
use phyxel_cli::picture::surfels_on_solid;
use testkit::picture::Difference;

/// The widest spacing of surfels over the narrowest.
const RANGE: f64 = 3.0;
/// Length of the edges of the meshes that are sampled (m).
const EDGE: f64 = 0.03;

/// Bodies about 2 m large: one whose curvature is the same everywhere, and others.
fn bodies() -> Vec<(&'static str, Solid)> {
    let ellipsoid = |semi_axes| implicit(Primitive::Ellipsoid { semi_axes });
    let round = |half: DVec3, edge: f64| {
        let bounds = Bounds::new(-half, half);
        Solid::implicit(bounds, move |p| {
            let q = p.abs() - (half - edge);
            q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - edge
        })
    };
    vec![
        ("ball", ellipsoid(DVec3::ONE)),
        ("ellipsoid 4:1:1", ellipsoid(DVec3::new(1.0, 0.25, 0.25))),
        ("ellipsoid 4:4:1", ellipsoid(DVec3::new(1.0, 1.0, 0.25))),
        ("rounded box", round(DVec3::new(0.8, 0.6, 0.7), 0.1)),
        ("rounded plate", round(DVec3::new(0.9, 0.7, 0.1), 0.1)),
    ]
}

/// Surfels of even density, and as many that follow curvature.
fn surfels(solid: &Solid, count: usize) -> Result<[SurfaceSamples; 2], StudyError> {
    let mesh = surface_mesh(solid, EDGE)?;
    let even = surfels_on_solid(solid, &mesh, count, SurfelSpacing::Even);
    let following = SurfelSpacing::Curvature { range: RANGE };
    let following = surfels_on_solid(solid, &mesh, even.positions.len(), following);
    Ok([even, following])
}

pub(crate) fn table(effort: Effort) -> Result<Table, StudyError> {
    let (counts, width, height): (&[usize], u32, u32) = effort.choose(
        (&[1_000, 3_000, 10_000, 30_000], 640, 480),
        (&[1_000, 10_000], 320, 240),
    );
    let mut rows = Vec::new();
    for (body, solid) in bodies() {
        let (camera, exact) = Exact::framed(&solid, width, height);
        let drawn = |surfels: &SurfaceSamples, radius| -> Result<Difference, StudyError> {
            Ok(exact.drawn(&at_rest(surfels, radius)?, &camera, 1).0)
        };
        for &count in counts {
            let [even, following] = surfels(&solid, count)?;
            let n = following.positions.len();
            let radii = covering_radii(&following.positions, &following.normals);
            let square = mean_square(&radii);
            let one = drawn(&even, RadiusRule::Constant(square.sqrt()))?;
            let adaptive = drawn(&following, RadiusRule::Covering)?;
            let disks = PI * square * n as f64;
            rows.push(row![
                body,
                n,
                disks / even.areas.iter().sum::<f64>(),
                one.holes,
                adaptive.holes,
                100.0 * one.outline,
                100.0 * adaptive.outline,
                1e3 * one.depth,
                1e3 * adaptive.depth,
                one.depth / adaptive.depth,
                one.normal,
                adaptive.normal,
                one.normal / adaptive.normal
            ]);
        }
    }
    Ok(Table::new(
        "adaptive",
        format!(
            "SurfaceSamples and radii that follow curvature (spacing as its cube root, up to {RANGE}:1) \
             against as many even surfels of one radius, at equal overdraw: errors of both, and how \
             many times smaller they become"
        ),
        "body; surfels (1); overdraw (1); one: holes (pixels); following: holes (pixels); \
         one: outline (%); following: outline (%); one: depth (mm); following: depth (mm); \
         depth gain (1); one: normal (degrees); following: normal (degrees); normal gain (1)",
        rows,
    ))
}
