//! Cuts and mechanics together: cracks with a known answer, through cuts, and the trap of setting up
//! again. `cargo run --release -p benches -- crack` prints all forms on all problems.

use super::{Proof, traps};
use crate::problems::cracks::{self, Form, PLACES, Ratios};
use glam::{DVec2, DVec3};
use phyxel_enrich::Rule;

const DIFFRACTION: Form = Form::DIFFRACTION;

fn mean(runs: &[Ratios], of: fn(&Ratios) -> f64) -> f64 {
    runs.iter().map(of).sum::<f64>() / runs.len() as f64
}

/// Force on the piece that moves, and on the rest, which must feel exactly nothing.
fn across(proof: &mut Proof, cut: &str, moved: f64, other: f64) {
    proof.above(format!("{cut}: force on what moves"), moved, 1e-3);
    proof.within(format!("{cut}: force across"), other, 0.0, 0.0);
}

pub(super) fn tada_paris_irwin_edge_crack(proof: &mut Proof) {
    // Mean over eight positions: 6 % at a = 8 spacings, 3 % at 16.
    for (cells, jitter, allowed) in [(20, 0.0, 0.06), (20, 0.2, 0.06), (40, 0.0, 0.03)] {
        let runs: Vec<Ratios> = PLACES
            .iter()
            .map(|&s| {
                cracks::edge_crack(cells, jitter, s, DIFFRACTION)
                    .unwrap()
                    .unwrap()
            })
            .collect();
        proof.within("K_I", mean(&runs, |r| r.first), 1.0, allowed);
        proof.within("mouth", mean(&runs, |r| r.second), 1.0, allowed);
    }
    // The baseline is worse: the crack acts too long.
    let seen = cracks::edge_crack(20, 0.0, PLACES[1], Form::Rule(Rule::Visibility))
        .unwrap()
        .unwrap();
    proof.above("mouth by visibility alone", seen.second, 1.1);
}

pub(super) fn a_set_up_after_the_cut_opens_it_and_the_trap_glues_it(proof: &mut Proof) {
    let [run, resumed, trap] = traps::mouths();
    proof.holds(
        "a set-up after the cut opens alike",
        run.to_bits() == resumed.to_bits(),
    );
    proof.below("opening with the old boundary vectors", trap, 0.2 * run);
}

pub(super) fn pieces_of_through_cuts_feel_nothing_of_each_other(proof: &mut Proof) {
    let upright = |p: DVec2| [p.extend(-0.2), p.extend(1.2)];
    let level = |x: f64, margin: f64| {
        [
            DVec3::new(x, -margin, 0.53),
            DVec3::new(x, 1.0 + margin, 0.53),
        ]
    };
    // A plane with margin, one that overshoots by 0.01, a wavy one, a closed plug, a T.
    for margin in [0.3, 0.01] {
        let strip = [level(-margin, margin), level(1.0 + margin, margin)];
        let [moved, other] = traps::force_across(&[&strip], |p| p.z > 0.53);
        across(proof, "plane", moved, other);
    }
    let wave = |x: f64| DVec2::new(x, 0.53 + 0.1 * (9.0 * x).sin());
    let strip: Vec<[DVec3; 2]> = (0..=24)
        .map(|k| upright(wave(-0.2 + f64::from(k) / 17.0)))
        .collect();
    let points: Vec<DVec2> = strip.iter().map(|b| b[0].truncate()).collect();
    let above = |p: DVec3| {
        let k = points.windows(2).position(|w| p.x <= w[1].x).unwrap();
        (points[k + 1] - points[k]).perp_dot(p.truncate() - points[k]) > 0.0
    };
    let [moved, other] = traps::force_across(&[&strip], above);
    across(proof, "wave", moved, other);
    let ring: Vec<[DVec3; 2]> = (0..=24)
        .map(|k| {
            let (s, c) = (std::f64::consts::TAU * f64::from(k % 24) / 24.0).sin_cos();
            upright(DVec2::new(0.5 + 0.33 * c, 0.5 + 0.33 * s))
        })
        .collect();
    let inside = |p: DVec3| {
        ring.windows(2).all(|w| {
            let (a, b) = (w[0][0].truncate(), w[1][0].truncate());
            (b - a).perp_dot(p.truncate() - a) > 0.0
        })
    };
    let [moved, other] = traps::force_across(&[&ring], inside);
    across(proof, "plug", moved, other);
    // The stem ends on the bar between two of its captures; each of the three pieces in turn.
    let bar = [-0.3, 0.2, 0.7, 1.3].map(|x| upright(DVec2::new(x, 0.53)));
    let stem = [-0.3, 0.15, 0.53].map(|y| upright(DVec2::new(0.47, y)));
    for piece in [
        |p: DVec3| p.y > 0.53,
        |p: DVec3| p.y < 0.53 && p.x < 0.47,
        |p: DVec3| p.y < 0.53 && p.x > 0.47,
    ] {
        let [moved, others] = traps::force_across(&[&bar, &stem], piece);
        across(proof, "T", moved, others);
    }
}
