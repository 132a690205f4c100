//! Cuts and mechanics together: cracks with a known answer, through cuts, and the trap of setting up
//! again. `cargo run --release -p benches -- crack` prints all forms on all problems.

use super::Proof;
use crate::problems::cracks::{self, CutBody, Form, PLACES, Plate, Ratios, add_stroke, upright};
use glam::{DVec2, DVec3};
use phyxel_enrich::{Cuts, Rule};
use phyxel_mls::{ConservativeSettings, GradientStencils, inverse_square_weights};

const IN_PLANE: DVec3 = DVec3::new(1.0, 1.0, 0.0);

fn mean(runs: &[Ratios], of: fn(&Ratios) -> f64) -> f64 {
    runs.iter().map(of).sum::<f64>() / runs.len() as f64
}

pub(super) fn edge_crack(proof: &mut Proof) {
    // Mean over eight positions: 6 % at a = 8 spacings, 3 % at 16.
    for (cells, jitter, allowed) in [(20, 0.0, 0.06), (20, 0.2, 0.06), (40, 0.0, 0.03)] {
        let run = |place| cracks::edge_crack(cells, jitter, place, Form::DIFFRACTION);
        let runs = PLACES.map(|place| run(place).unwrap().unwrap());
        proof.within("K_I", mean(&runs, |r| r.first), 1.0, allowed);
        proof.within("mouth", mean(&runs, |r| r.second), 1.0, allowed);
    }
    // The baseline is worse: the crack acts too long.
    let seen = cracks::edge_crack(20, 0.0, PLACES[1], Form::Rule(Rule::Visibility))
        .unwrap()
        .unwrap();
    proof.above("mouth by visibility alone", seen.second, 1.1);
}

pub(super) fn set_up_after(proof: &mut Proof) {
    let [run, resumed, trap] = mouths();
    let alike = run.to_bits() == resumed.to_bits();
    proof.holds("a set-up after the cut opens alike", alike);
    proof.below("opening with the old boundary vectors", trap, 0.2 * run);
}

pub(super) fn pieces(proof: &mut Proof) {
    let standing = |p: DVec2| [p.extend(-0.2), p.extend(1.2)];
    let level = |x: f64, margin: f64| {
        [
            DVec3::new(x, -margin, 0.53),
            DVec3::new(x, 1.0 + margin, 0.53),
        ]
    };
    // A plane with margin, one that overshoots by 0.01, a wavy one, a closed plug, a T.
    for margin in [0.3, 0.01] {
        let strip = [level(-margin, margin), level(1.0 + margin, margin)];
        across(proof, "plane", &[&strip], |p| p.z > 0.53);
    }
    let wave = |x: f64| DVec2::new(x, 0.53 + 0.1 * (9.0 * x).sin());
    let strip: Vec<[DVec3; 2]> = (0..=24)
        .map(|k| standing(wave(-0.2 + f64::from(k) / 17.0)))
        .collect();
    let points: Vec<DVec2> = strip.iter().map(|b| b[0].truncate()).collect();
    let above = |p: DVec3| {
        let k = points.windows(2).position(|w| p.x <= w[1].x).unwrap();
        (points[k + 1] - points[k]).perp_dot(p.truncate() - points[k]) > 0.0
    };
    across(proof, "wave", &[&strip], above);
    let ring: Vec<[DVec3; 2]> = (0..=24)
        .map(|k| {
            let (s, c) = (std::f64::consts::TAU * f64::from(k % 24) / 24.0).sin_cos();
            standing(DVec2::new(0.5 + 0.33 * c, 0.5 + 0.33 * s))
        })
        .collect();
    let inside = |p: DVec3| {
        ring.windows(2).all(|w| {
            let (a, b) = (w[0][0].truncate(), w[1][0].truncate());
            (b - a).perp_dot(p.truncate() - a) > 0.0
        })
    };
    across(proof, "plug", &[&ring], inside);
    // The stem ends on the bar between two of its captures; each of the three pieces in turn.
    let bar = [-0.3, 0.2, 0.7, 1.3].map(|x| standing(DVec2::new(x, 0.53)));
    let stem = [-0.3, 0.15, 0.53].map(|y| standing(DVec2::new(0.47, y)));
    for piece in [
        |p: DVec3| p.y > 0.53,
        |p: DVec3| p.y < 0.53 && p.x < 0.47,
        |p: DVec3| p.y < 0.53 && p.x > 0.47,
    ] {
        across(proof, "T", &[&bar, &stem], piece);
    }
}

/// A cut by the default rule.
fn cut_by_default<'a>(body: &'a Plate, cuts: &Cuts) -> CutBody<'a> {
    CutBody::new(body, cuts, &[], Form::DIFFRACTION)
        .unwrap()
        .unwrap()
}

/// Mouth opening of an edge crack (m) with the stencils of the cut, of a set-up from the start that
/// then takes the whole cut's factors, and of a set-up with the cut's weights and the old boundary
/// vectors.
fn mouths() -> [f64; 3] {
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
        let u = cut.solve(&forces, IN_PLANE).unwrap();
        cut.opening(&cuts, &u, &cut.gradients(&u), at(0.0), DVec3::Y)
    };
    let cut = cut_by_default(&body, &cuts);
    let again = make();
    let resumed = cut_by_default(&again, &cuts);
    let mut trap = cut_by_default(&body, &cuts);
    trap.stencils = glued(&cut);
    [mouth(&cut), mouth(&resumed), mouth(&trap)]
}

/// Moves the nodes of one piece of a body after a through cut: forces change on that piece, and on the rest by
/// exactly nothing.
fn across(proof: &mut Proof, cut: &str, strips: &[&[[DVec3; 2]]], piece: impl Fn(DVec3) -> bool) {
    let body = Plate::new([8; 3], DVec3::ZERO, DVec3::ONE, 0.2).unwrap();
    let mut cuts = body.cuts();
    for strip in strips {
        add_stroke(&mut cuts, strip).unwrap();
    }
    let factored = cut_by_default(&body, &cuts);
    let mut most = [0.0_f64; 2];
    let mut random = testkit::cloud::Random::new(8);
    let mut elastic = factored.elastic().unwrap();
    let rest = &body.block.rest;
    let mut moved = rest.clone();
    for x in &mut moved {
        let shift = random.vector(0.02);
        *x += if piece(*x) { shift } else { DVec3::ZERO };
    }
    let mut forces = vec![DVec3::ZERO; moved.len()];
    let mut at_rest = forces.clone();
    elastic.forces_into(rest, &mut at_rest);
    elastic.forces_into(&moved, &mut forces);
    for ((f, rest), &x) in forces.iter().zip(&at_rest).zip(rest) {
        let k = usize::from(!piece(x));
        most[k] = most[k].max((*f - *rest).abs().max_element());
    }
    let [moved, other] = most;
    proof.above(format!("{cut}: force on what moves"), moved, 1e-3);
    proof.within(format!("{cut}: force across"), other, 0.0, 0.0);
}

/// Setting up the whole body again with the weights of a cut and the old boundary vectors: what glues.
fn glued(cut: &CutBody<'_>) -> GradientStencils {
    let body = &cut.body.block;
    let (rest, volumes, boundary) = (&body.rest, &body.volumes, &body.boundary);
    let mut weights = inverse_square_weights(rest, &body.graph);
    for (weight, factor) in weights.iter_mut().zip(&cut.factors) {
        *weight *= factor;
    }
    let settings = ConservativeSettings::default();
    GradientStencils::conservative(rest, volumes, boundary, &body.graph, weights, &settings)
        .unwrap()
}
