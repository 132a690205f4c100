//! Cuts and mechanics together: cracks with a known answer.
//! `cargo run --release -p benches -- crack` prints all forms on all problems.

use super::Proof;
use crate::problems::cracks::{self, Form, PLACES, Ratios};
use phyxel_enrich::Rule;

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
