//! A penny-shaped crack in space.

use std::f64::consts::PI;

use glam::DVec3;

use super::cut_body::{CutBody, Form};
use super::plate::Plate;
use super::problems::Ratios;
use super::{POISSON, YOUNG};
use crate::StudyError;

/// Radii (spacings) over which the displacement field is read. A larger one smears the opening's fall
/// towards the edge and gives less, by up to 0.08 of the face; over 1.8 some points see too few nodes for
/// an answer.
pub const READINGS: [f64; 3] = [2.2, 2.6, 3.0];

/// Openings of a penny-shaped cut relative to the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Penny {
    /// Mean over the face within 0.9 of the radius, and at the middle, of the displacement field, for
    /// each of [`READINGS`].
    pub faces: [Ratios; 3],
    /// Mean over the whole face by the work of the loads (what the cut adds to it is the stress times
    /// the opened volume), and mean at the nodes beside the cut, each by its own gradient.
    pub others: Ratios,
}

/// Penny-shaped cut of radius 0.35 in a cube of half width 1 under tension, `shift` spacings beside
/// the middle: opening against 1.0455 times Sneddon's half-space value (fine finite elements of the
/// cube). `None` if the form refuses.
///
/// # Errors
/// [`StudyError`] if the displacements are not found.
pub fn penny(
    cells: u32,
    jitter: f64,
    shift: DVec3,
    form: Form,
) -> Result<Option<Penny>, StudyError> {
    let body = Plate::new([cells; 3], -DVec3::ONE, DVec3::ONE, jitter)?;
    let a = 0.35;
    let between = if cells.is_multiple_of(2) { 0.5 } else { 0.0 };
    let middle = body.spacing * (shift + between * DVec3::Z);
    let (mut vertices, mut triangles) = (vec![middle], Vec::new());
    let count = 64_u32;
    for k in 0..count {
        let (s, c) = (2.0 * PI * f64::from(k) / f64::from(count)).sin_cos();
        vertices.push(middle + a * DVec3::new(c, s, 0.0));
        triangles.push([0, 1 + k, 1 + (k + 1) % count]);
    }
    let mut cuts = body.cuts();
    cuts.add_surface(&vertices, &triangles)?;
    // A blade that sweeps a lens of the same disc, for the grid.
    let blades: Vec<[DVec3; 2]> = (0..=24)
        .map(|k| {
            let x = a * (-1.0 + f64::from(k) / 12.0) * 0.999;
            let y = (a * a - x * x).sqrt();
            [-y, y].map(|y| middle + DVec3::new(x, y, 0.0))
        })
        .collect();
    let Some(cut) = CutBody::new(&body, &cuts, &blades, form)? else {
        return Ok(None);
    };
    let forces = body.tension(DVec3::Z);
    let u = cut.solve(&forces, |_| DVec3::ONE)?;
    let stiff = 8.0 * (1.0 - POISSON * POISSON) / (PI * YOUNG);
    let sneddon = |r: f64| 1.0455 * stiff * (a * a - r * r).sqrt();
    let ratio = |sums: (f64, f64)| sums.0 / sums.1;
    // Points of the face in 18 rings, each with its fraction of the area.
    let face = |reading: f64| {
        let mut face = (0.0, 0.0);
        for ring in 0..18_u32 {
            let r = a * (f64::from(ring) + 0.5) / 20.0;
            let points = 2 * ring + 4;
            let share = r / f64::from(points);
            for k in 0..points {
                let (s, c) = (2.0 * PI * (f64::from(k) + 0.3) / f64::from(points)).sin_cos();
                let at = middle + r * DVec3::new(c, s, 0.0);
                face.0 += share * cut.field_opening(&cuts, &u, at, DVec3::Z, reading);
                face.1 += share * sneddon(r);
            }
        }
        ratio(face)
    };
    let gradients = cut.gradients(&u);
    let mut at_nodes = (0.0, 0.0);
    for x in &body.block.rest {
        let (above, r) = (x.z - middle.z, (*x - middle).truncate().length());
        if above > 0.0 && above < 0.99 * body.spacing && r < 0.9 * a {
            let at = x.with_z(middle.z);
            at_nodes.0 += cut.opening(&cuts, &u, &gradients, at, DVec3::Z);
            at_nodes.1 += sneddon(r);
        }
    }
    let work: f64 = forces.iter().zip(&u).map(|(f, u)| f.dot(*u)).sum();
    let volume = (work - 8.0 / YOUNG, 2.0 / 3.0 * PI * a * a * sneddon(0.0));
    let pair = |first, second| Ratios {
        first,
        second,
        seconds: cut.seconds,
        nodes: u.len(),
    };
    let faces = READINGS.map(|reading| {
        let at_middle = cut.field_opening(&cuts, &u, middle, DVec3::Z, reading);
        pair(face(reading), at_middle / sneddon(0.0))
    });
    Ok(Some(Penny {
        faces,
        others: pair(ratio(volume), ratio(at_nodes)),
    }))
}
