//! The dissertation's inside test beside the default.

use glam::{DMat3, DVec3};
use phyxel_discretize::{Bounds, Primitive, Solid, sample_surfels, surface_mesh};
use phyxel_splat::RadiusRule;

use super::{at_rest, implicit};
use crate::report::{Cell, Table, median_time, row};
use crate::{Effort, StudyError};
use testkit::cloud::Random;

/// Solids with the longest edge of their surface mesh (m).
fn bodies() -> Vec<(&'static str, Solid, f64)> {
    let cuboid = |half_extents| implicit(Primitive::Box { half_extents });
    let plate = cuboid(DVec3::new(1.0, 1.0, 0.02));
    let semi_axes = DVec3::ONE;
    vec![
        ("ball", implicit(Primitive::Ellipsoid { semi_axes }), 0.06),
        ("box", cuboid(DVec3::new(0.8, 0.6, 0.7)), 0.06),
        ("plate, 1/50 thick", plate, 0.03),
        ("liver", implicit(Primitive::Liver), 0.004),
    ]
}

/// Points on three oblique planes through a solid's middle, in its bounds and a little outside.
fn points(bounds: Bounds, count: usize) -> Vec<DVec3> {
    let (middle, half) = (0.5 * (bounds.min + bounds.max), 0.55 * bounds.size());
    let mut random = Random::new(7);
    (0..count)
        .map(|k| {
            let turn = DMat3::from_axis_angle(DVec3::ONE.normalize(), 0.4 + 2.1 * (k % 3) as f64);
            let mut at = random.vector(1.0);
            at[k % 3] = 0.0;
            middle + (turn * at).clamp(DVec3::NEG_ONE, DVec3::ONE) * half
        })
        .collect()
}

pub(crate) fn table(effort: Effort) -> Result<Table, StudyError> {
    let (surfels, count) = effort.choose((10_000, 20_000), (2_000, 2_000));
    let mut rows = Vec::new();
    for (name, solid, edge) in bodies() {
        let mesh = surface_mesh(&solid, edge)?;
        let samples = sample_surfels(&mesh, surfels, Some(&solid));
        let tissue = at_rest(&samples, RadiusRule::default())?;
        let spacing = (mesh.area() / samples.positions.len() as f64).sqrt();
        let points = points(solid.bounds(), count);
        let near: Vec<bool> = points
            .iter()
            .map(|&x| solid.signed_distance(x).abs() < spacing)
            .collect();
        let (given, time) = median_time(3, || test(&points, |x| solid.contains(x)));
        let (two, two_time) = median_time(3, || test(&points, |x| tissue.is_behind_surfels(x)));
        let wrong: Vec<bool> = given.iter().zip(&two).map(|(a, b)| a != b).collect();
        let share = |of: &dyn Fn(usize) -> bool| {
            let chosen: Vec<usize> = (0..points.len()).filter(|&k| of(k)).collect();
            let bad = chosen.iter().filter(|&&k| wrong[k]).count();
            Cell::Number(100.0 * bad as f64 / chosen.len().max(1) as f64)
        };
        let each = 1e6 / points.len() as f64;
        rows.push(row![
            name,
            samples.positions.len(),
            share(&|_| true),
            share(&|k| near[k]),
            share(&|k| !near[k]),
            each * two_time,
            each * time
        ]);
    }
    Ok(Table::new(
        "inside",
        "Points of cuts that the dissertation's inside test (two nearest surfels, fig. 65) \
                misjudges against the default (the solid's own); near: within a spacing of the surface",
        "body; surfels (1); wrong (%); wrong near (%); wrong far (%); two nearest (us a point); \
         default (us a point)",
        rows,
    ))
}

fn test(points: &[DVec3], inside: impl Fn(DVec3) -> bool) -> Vec<bool> {
    points.iter().map(|&x| inside(x)).collect()
}
