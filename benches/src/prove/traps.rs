//! Problems without a reference: set-ups after a cut, pieces.

use crate::problems::cracks::{CutBody, Form, Plate, add_stroke, upright};
use glam::DVec3;
use phyxel_mls::{ConservativeSettings, GradientStencils, inverse_square_weights};

const IN_PLANE: DVec3 = DVec3::new(1.0, 1.0, 0.0);

/// A cut by the default rule.
fn cut_by_default<'a>(body: &'a Plate, cuts: &phyxel_enrich::Cuts) -> CutBody<'a> {
    CutBody::new(body, cuts, &[], Form::DIFFRACTION)
        .unwrap()
        .unwrap()
}

/// Mouth opening of an edge crack (m) with the stencils of the cut, of a set-up from the start that
/// then takes the whole cut's factors, and of a set-up with the cut's weights and the old boundary
/// vectors.
pub(super) fn mouths() -> [f64; 3] {
    let make = || {
        let size = DVec3::new(1.0, 2.0, 0.05);
        Plate::new([20, 40, 1], DVec3::ZERO, size, 0.2).unwrap()
    };
    let body = make();
    let dx = body.spacing;
    let at = |x: f64| DVec3::new(x, 1.0 + 0.3 * dx, 0.5 * dx);
    let (cuts, _) = upright(&body, at(-2.0 * dx), at(0.41)).unwrap();
    let forces = body.tension(DVec3::Y);
    let mouth = |cut: &CutBody<'_>| {
        let u = cut.solve(&forces, |_| IN_PLANE).unwrap();
        cut.opening(&cuts, &u, &cut.gradients(&u), at(0.0), DVec3::Y)
    };
    let cut = cut_by_default(&body, &cuts);
    let again = make();
    let resumed = cut_by_default(&again, &cuts);
    let mut trap = cut_by_default(&body, &cuts);
    trap.stencils = glued(&cut);
    [mouth(&cut), mouth(&resumed), mouth(&trap)]
}

/// Largest change of a force by moving the nodes of one piece of a body after a through cut: on that
/// piece, and on the rest.
pub(super) fn force_across(strips: &[&[[DVec3; 2]]], piece: impl Fn(DVec3) -> bool) -> [f64; 2] {
    let body = Plate::new([8; 3], DVec3::ZERO, DVec3::ONE, 0.2).unwrap();
    let mut cuts = body.cuts();
    for strip in strips {
        add_stroke(&mut cuts, strip).unwrap();
    }
    let cut = cut_by_default(&body, &cuts);
    let mut most = [0.0_f64; 2];
    let mut random = testkit::cloud::Random::new(8);
    let mut elastic = cut.elastic().unwrap();
    let rest = &body.block.rest;
    let moved: Vec<DVec3> = rest
        .iter()
        .map(|&x| {
            let shift = random.vector(0.02);
            if piece(x) { x + shift } else { x }
        })
        .collect();
    let mut forces = vec![DVec3::ZERO; moved.len()];
    let mut at_rest = forces.clone();
    elastic.forces_into(rest, &mut at_rest);
    elastic.forces_into(&moved, &mut forces);
    for ((f, rest), &x) in forces.iter().zip(&at_rest).zip(rest) {
        let k = usize::from(!piece(x));
        most[k] = most[k].max((*f - *rest).abs().max_element());
    }
    most
}

/// Setting up the whole body again with the weights of a cut and the old boundary vectors: what glues.
fn glued(cut: &CutBody<'_>) -> GradientStencils {
    let body = &cut.body.block;
    let weights: Vec<f64> = inverse_square_weights(&body.rest, &body.graph)
        .iter()
        .zip(&cut.factors)
        .map(|(w, f)| w * f)
        .collect();
    GradientStencils::conservative(
        &body.rest,
        &body.volumes,
        &body.boundary,
        &body.graph,
        weights,
        &ConservativeSettings::default(),
    )
    .unwrap()
}
