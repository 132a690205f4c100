//! Problems without a reference: stress along a finished cut, set-ups after a cut, pieces.

use crate::problems::cracks::{CutBody, Form, Plate, stress, upright};
use glam::{DMat3, DVec3};
use phyxel_mls::{ConservativeSettings, ConservativeStencils, inverse_square_weights};

const IN_PLANE: DVec3 = DVec3::new(1.0, 1.0, 0.0);

/// A cut by the default rule.
fn cut_by_default<'a>(body: &'a Plate, cuts: &phyxel_enrich::Cuts) -> CutBody<'a> {
    CutBody::new(body, cuts, &[], Form::DIFFRACTION)
        .unwrap()
        .unwrap()
}

/// Bar with a cut along half its length under uniform stress parallel to the cut, after the stroke is
/// finished: largest error of the stress at any node, relative. `finish` says whether it is.
pub(super) fn parallel_stress(jitter: f64, finish: bool) -> f64 {
    let size = DVec3::new(2.0, 1.0, 0.25);
    let body = Plate::new([16, 8, 2], DVec3::ZERO, size, jitter).unwrap();
    let at = |x: f64| DVec3::new(x, 0.53, 0.125);
    let (cuts, _) = upright(&body, at(-0.3), at(1.03)).unwrap();
    let mut cut = cut_by_default(&body, &cuts);
    if finish {
        let report = cut.finish(&cuts);
        assert!(
            report.accepted && report.moved > 0 && report.solve.residual < 1e-9,
            "{report:?}"
        );
    }
    let u = cut.solve(&body.tension(DVec3::X), |_| DVec3::ONE).unwrap();
    let exact = DMat3::from_cols(DVec3::X, DVec3::ZERO, DVec3::ZERO);
    cut.gradients(&u)
        .iter()
        .map(|g| {
            let error = (stress(*g) - exact).to_cols_array();
            error.iter().map(|e| e * e).sum::<f64>().sqrt()
        })
        .fold(0.0, f64::max)
}

/// Mouth opening of an edge crack (m) with the stencils of the cut, of a set-up from the start that
/// then takes the finished cut's factors, and of a set-up with the cut's weights and the old boundary
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

/// Largest change of a force by moving the nodes of one piece of a body after a through cut, before
/// and after the strokes are finished: on that piece, and on the rest.
pub(super) fn force_across(strips: &[&[[DVec3; 2]]], piece: impl Fn(DVec3) -> bool) -> [f64; 2] {
    let body = Plate::new([8; 3], DVec3::ZERO, DVec3::ONE, 0.2).unwrap();
    let mut cuts = body.cuts();
    for strip in strips {
        let stroke = cuts.start(&strip[0]).unwrap();
        for blade in &strip[1..] {
            cuts.append(stroke, blade).unwrap();
        }
        cuts.end(stroke).unwrap();
    }
    let mut cut = cut_by_default(&body, &cuts);
    let mut most = [0.0_f64; 2];
    for finished in [false, true] {
        if finished {
            cut.finish(&cuts);
        }
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
    }
    most
}

/// Setting up the whole body anew with the weights of a cut and the old boundary vectors: what glues.
fn glued(cut: &CutBody<'_>) -> ConservativeStencils {
    let body = &cut.body.block;
    let weights: Vec<f64> = inverse_square_weights(&body.rest, &body.graph)
        .iter()
        .zip(&cut.factors)
        .map(|(w, f)| w * f)
        .collect();
    ConservativeStencils::new(
        &body.rest,
        &body.volumes,
        &body.boundary,
        &body.graph,
        weights,
        &ConservativeSettings::default(),
    )
    .unwrap()
}
