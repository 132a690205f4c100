//! Every plane case against the visibility graph.

use glam::DVec2;

use super::shapes::{Expect, Lines, plane};
use super::slow::{Cloud, VisibilityGraph, inside, kernel};
use crate::{CutSettings, Obstacle, PlanarCuts, connected_pieces};

pub(crate) fn cut(lines: &Lines, weld: f64) -> PlanarCuts {
    let mut cuts = PlanarCuts::new(&CutSettings {
        weld_tolerance: weld,
        index_cell: 0.1,
    });
    for line in lines {
        cuts.add_polyline(line).unwrap();
    }
    cuts
}

pub(crate) fn factors(cloud: &Cloud, cuts: &PlanarCuts) -> Vec<f64> {
    let mut factors = cloud.factors();
    factors.update(&cloud.graph(), cuts, 0..cuts.segment_count(), &inside);
    factors.to_vec()
}

#[test]
fn no_leak_and_no_over_cut_in_any_case() {
    let mut failures = Vec::new();
    for (name, lines, expect) in plane() {
        let jitter = if name.starts_with("through nodes") {
            0.0
        } else {
            0.25
        };
        let cloud = Cloud::lattice(24, 1, jitter, 2.5);
        let cuts = cut(&lines, 0.05 * cloud.radius);
        let found = factors(&cloud, &cuts);
        let segments: Vec<[DVec2; 2]> =
            (0..cuts.segment_count()).map(|s| cuts.segment(s)).collect();
        let oracle = VisibilityGraph::new(&segments);
        let (mut crossing, mut severed, mut squares, mut worst_leak) = (0, 0, 0.0, 0.0_f64);
        for (pair, &(i, j)) in cloud.pairs().iter().enumerate() {
            let f = found[pair];
            let crossed =
                (0..segments.len()).any(|s| cuts.piece_crosses(s, cloud.x[i], cloud.x[j]));
            assert_eq!(crossed, f < 1.0, "{name}: {i} {j} over-cut or missed");
            if !crossed {
                continue;
            }
            crossing += 1;
            // A node on the cut may stand on either side for the oracle: it is moved off the cut
            // to the side that the tie rule gives.
            let off = DVec2::new(1e-11, 1e-12);
            let (a, b) = (cloud.x[i].truncate() + off, cloud.x[j].truncate() + off);
            let length = oracle.shortest(a, b, 1.2 * cloud.radius);
            let direct = cloud.x[i].distance(cloud.x[j]);
            let exact =
                kernel(length.min(cloud.radius) / cloud.radius) / kernel(direct / cloud.radius);
            if length >= cloud.radius * (1.0 + 1e-5) {
                severed += 1;
                if f != 0.0 {
                    failures.push(format!("{name}: {i} {j} leaks {f}, way {length}"));
                }
            }
            worst_leak = worst_leak.max(f - exact);
            squares += (f - exact).powi(2);
        }
        let rms = (squares / f64::from(crossing.max(1))).sqrt();
        if testkit::tol::print_residuals() {
            println!(
                "{name}: {crossing} crossing, {severed} severed, rms {rms:.4}, over {worst_leak:.1e}"
            );
        }
        // A way that is found is there: no factor is above the true way's but for round-off.
        if worst_leak > 1e-6 {
            failures.push(format!(
                "{name}: factor above the true way's by {worst_leak}"
            ));
        }
        if rms > 1e-3 {
            failures.push(format!("{name}: rms {rms}"));
        }
        let parts = connected_pieces(&cloud.offsets, &cloud.indices, &found);
        let large = parts.sizes.iter().filter(|&&s| s > 3).count();
        let wanted = if let Expect::Parts(n) = expect { n } else { 1 };
        if large != wanted {
            failures.push(format!("{name}: pieces {:?}", parts.sizes));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
