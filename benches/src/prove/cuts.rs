//! Cuts and mechanics together: cracks with a known answer, and the trap of setting up again.
//! `cargo run --release -p benches -- crack` prints all forms on all problems.

use super::Proof;
use crate::problems::cracks::{self, CutBody, Form, PLACES, Plate, Ratios, upright};
use glam::DVec3;
use phyxel_enrich::{Cuts, Rule};
use phyxel_mls::{ConservativeSettings, GradientStencils, inverse_square_weights};

const IN_PLANE: DVec3 = DVec3::new(1.0, 1.0, 0.0);

fn mean(runs: &[Ratios], of: fn(&Ratios) -> f64) -> f64 {
    runs.iter().map(of).sum::<f64>() / runs.len() as f64
}

fn at_places(cells: u32, jitter: f64, z: f64) -> [Ratios; 8] {
    let run = |place| cracks::edge_crack(cells, jitter, place, z, Form::DIFFRACTION);
    PLACES.map(|place| run(place).unwrap().unwrap())
}

pub(super) fn edge_crack(proof: &mut Proof) {
    // Mean over eight positions: 6 % at a = 8 spacings, 3 % at 16.
    for (cells, jitter, allowed) in [(20, 0.0, 0.06), (20, 0.2, 0.06), (40, 0.0, 0.03)] {
        let runs = at_places(cells, jitter, 0.0);
        proof.within("K_I", mean(&runs, |r| r.first), 1.0, allowed);
        proof.within("mouth", mean(&runs, |r| r.second), 1.0, allowed);
    }
    // Paths bend in the faces: round-off decides nothing there.
    let runs = at_places(20, 0.2, 0.0);
    for z in [0.37, -0.021, 1.0] {
        let pairs = runs.iter().zip(at_places(20, 0.2, z));
        let off = pairs.map(|(r, s)| (r.first - s.first).abs() + (r.second - s.second).abs());
        let off: f64 = off.sum();
        proof.below(format!("K_I and mouths, moved by {z} m: change"), off, 1e-9);
    }
    // The baseline is worse: the crack acts too long.
    let seen = cracks::edge_crack(20, 0.0, PLACES[1], 0.0, Form::Rule(Rule::Visibility))
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
