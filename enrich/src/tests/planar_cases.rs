//! Every plane case against the visibility graph.

use glam::DVec2;

use super::shapes::{Lines, plane};
use super::slow::{Cloud, VisibilityGraph, kernel};
use super::space_cases::{factors, jitter};
use crate::{CutSettings, Cuts};

/// Upright strips over plane polylines, welded but not joined to faces.
pub(crate) fn cut(lines: &Lines, weld_tolerance: f64) -> Cuts {
    let mut cuts = Cuts::new(&CutSettings {
        weld_tolerance,
        influence_radius: 0.1,
    });
    for line in lines {
        let points: Vec<_> = line
            .iter()
            .flat_map(|p| [p.extend(-1.0), p.extend(1.0)])
            .collect();
        let pieces = (0..line.len() as u32 - 1).flat_map(|k| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|corner| 2 * k + corner);
            [[a, b, c], [c, b, d]]
        });
        let pieces: Vec<_> = pieces.collect();
        cuts.add_surface(&points, &pieces).unwrap();
    }
    cuts
}

/// The segments in the plane of upright strips.
pub(crate) fn segments(cuts: &Cuts) -> Vec<[DVec2; 2]> {
    let pieces = (0..cuts.triangle_count()).step_by(2);
    let ends = pieces.map(|triangle| {
        let [p, _, q] = cuts.triangle(triangle);
        [p.truncate(), q.truncate()]
    });
    ends.collect()
}

#[test]
fn no_leak_and_no_over_cut_in_any_case() {
    let mut failures = Vec::new();
    for (name, lines, wanted) in plane() {
        let cloud = Cloud::lattice(24, 1, jitter(name), 2.5);
        let cuts = cut(&lines, 0.05 * cloud.radius);
        let found = factors(&cloud, &cuts);
        let segments = segments(&cuts);
        let oracle = VisibilityGraph::new(&segments);
        let (mut crossing, mut severed, mut squares, mut worst_leak) = (0, 0, 0.0, 0.0_f64);
        for (pair, &(i, j)) in cloud.pairs().iter().enumerate() {
            let f = found[pair];
            let crossed = (0..cuts.triangle_count())
                .any(|t| cuts.triangle_crosses(t, cloud.x[i], cloud.x[j]));
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
        // A path that is found is there: no factor is above the true path's but for round-off.
        if worst_leak > 1e-6 {
            failures.push(format!("{name}: above the true way's by {worst_leak}"));
        }
        if rms > 1e-3 {
            failures.push(format!("{name}: rms {rms}"));
        }
        let sizes = cloud.piece_sizes(&found);
        let large = sizes.iter().filter(|&&s| s > 3).count();
        if large != wanted {
            failures.push(format!("{name}: pieces {sizes:?}"));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
