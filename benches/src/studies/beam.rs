//! A cantilever: error of its deflection.

use glam::DVec3;
use phyxel_integrate::{NewtonSettings, StaticLoad, solve_static};

use crate::problems::model::law;
use crate::report::{Report, Series, Table, plots, row};
use crate::{Effort, StudyError};
use phyxel::Body;
use phyxel::scene::{self, Form, MaterialSettings, Region, Scene, Shape, Support, Target};

/// Length (m); the section is a square of a fifth of it.
const LENGTH: f64 = 1.0;
const DEPTH: f64 = 0.2;
/// Young's modulus (Pa).
const MODULUS: f64 = 1.0e4;
/// Force on the free end (N): the deflection is a hundredth of the length, so that what is not linear
/// in it stays near 1e-4.
const FORCE: f64 = 4.0e-2;
/// Unbalanced force, relative to the load, at which the beam counts as at rest.
const TOLERANCE: f64 = 1e-6;
/// Poisson's ratio and deflection of the free end times E / F (1/m), by 26 x 6 x 6 quadratic
/// hexahedra and extrapolation; certain to 0.05, 0.15 and 0.25 %.
const REFERENCE: [(f64, f64); 3] = [(0.3, 2544.2), (0.45, 2506.8), (0.49, 2491.4)];

struct Measured {
    nodes: usize,
    spacing: f64,
    error: f64,
}

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let cells: &[f64] = effort.choose(&[2.0, 3.0, 4.0, 6.0, 8.0], &[2.0, 4.0]);
    let (mut rows, mut by_spacing) = (Vec::new(), Vec::new());
    let meshed = REFERENCE.map(|known| (known, Form::Tetrahedra));
    let points = [(REFERENCE[0], Form::Points)];
    for ((ratio, reference), form) in meshed.into_iter().chain(points) {
        let (name, nodes) = match form {
            Form::Tetrahedra => (format!("nu = {ratio}"), "of tetrahedra"),
            Form::Points => (format!("nu = {ratio}, points"), "points"),
        };
        let mut errors = Vec::new();
        for &cells in cells {
            let measured = measure(ratio, reference, (DEPTH / cells, form))?;
            rows.push(row![
                ratio,
                nodes,
                measured.nodes,
                measured.spacing,
                100.0 * measured.error
            ]);
            errors.push((measured.spacing, 100.0 * measured.error.abs()));
        }
        by_spacing.push(Series::line(name, errors));
    }
    let table = Table::new(
        "deflection",
        "Error of the deflection",
        "Poisson's ratio (1); kind of nodes; nodes (1); spacing (m); error (%)",
        rows,
    );
    let plots = plots![
        "error" "Cantilever: error against spacing",
            log "spacing (m)", log "error of the deflection (%)" => by_spacing;
    ];
    Ok(Report::new(
        &[
            "A beam of 1 m x 0.2 m x 0.2 m, clamped at one end, its free end pulled down by a small \
             force spread over the face. The static deflection is compared with quadratic finite \
             elements (26 x 6 x 6 cells, extrapolated). E is 10 kPa.",
        ],
        vec![table],
        plots,
    ))
}

/// The beam, from the clamp at -x to the free end at +x.
fn beam(ratio: f64, (spacing, form): (f64, Form)) -> Scene {
    let mut body = scene::Body::new(Shape::Box {
        size: DVec3::new(LENGTH, DEPTH, DEPTH),
    });
    body.sampling.target = Target::Spacing(spacing);
    body.sampling.form = form;
    body.material = MaterialSettings {
        youngs_modulus: MODULUS,
        poissons_ratio: ratio,
        density: 1000.0,
        ..MaterialSettings::default()
    };
    let mut scene = Scene::new("beam", vec![body]);
    scene.supports.push(Support::fixed(Region::HalfSpace {
        point: DVec3::new(-0.499_999 * LENGTH, 0.0, 0.0),
        normal: DVec3::NEG_X,
    }));
    scene.gravity = None;
    scene.integration.settle = None;
    scene
}

fn measure(ratio: f64, reference: f64, nodes: (f64, Form)) -> Result<Measured, StudyError> {
    let scene = beam(ratio, nodes);
    let body = Body::new(&scene, &scene.bodies[0])?;
    let boundary = &body.stencils.boundary_vectors;
    // The fraction of the end face that each of its nodes stands for.
    let at_end = |x: &DVec3| f64::from(u8::from(x.x > 0.499_999 * LENGTH));
    let shares = body.rest.iter().zip(boundary);
    let shares: Vec<f64> = shares.map(|(x, b)| at_end(x) * b.x.max(0.0)).collect();
    let area: f64 = shares.iter().sum();
    let force = |share: &f64| DVec3::new(0.0, 0.0, -FORCE * share / area);
    let forces: Vec<DVec3> = shares.iter().map(force).collect();
    let mut positions = body.rest.clone();
    let mut elastic = body.elastic().clone();
    let (law, supports) = (&mut law(&mut elastic), body.motion().supports());
    let settings = NewtonSettings::with_tolerance(TOLERANCE);
    solve_static(
        law,
        &mut positions,
        supports,
        &StaticLoad::of(&forces),
        &settings,
    )?;
    let moved = positions.iter().zip(&body.rest).zip(&shares);
    let deflection = moved.map(|((x, rest), share)| (rest.z - x.z) * share / area);
    let deflection: f64 = deflection.sum();
    Ok(Measured {
        nodes: body.rest.len(),
        spacing: body.spacing,
        error: deflection / (reference * FORCE / MODULUS) - 1.0,
    })
}
