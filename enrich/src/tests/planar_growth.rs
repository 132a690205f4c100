//! Cuts in the plane: prefixes, order of arrival, repetition, subdivision, and the slow twin.

use glam::{DVec2, DVec3};
use testkit::cloud::Random;

use super::planar_cases::{cut, factors};
use super::shapes::plane;
use super::slow::{Cloud, cross2, inside, kernel};
use crate::{CutSettings, PlanarCuts};

fn body(name: &str) -> Cloud {
    let jitter = if name.contains("through nodes") {
        0.0
    } else {
        0.25
    };
    Cloud::lattice(24, 1, jitter, 2.5)
}

fn segments(cuts: &PlanarCuts) -> Vec<[DVec2; 2]> {
    (0..cuts.segment_count()).map(|s| cuts.segment(s)).collect()
}

fn from_segments(segments: &[[DVec2; 2]], weld_tolerance: f64) -> PlanarCuts {
    let mut cuts = PlanarCuts::new(&CutSettings {
        weld_tolerance,
        index_cell: 0.1,
    });
    for ends in segments {
        cuts.add_polyline(ends).unwrap();
    }
    cuts
}

#[test]
fn factors_never_rise_in_any_prefix() {
    for (name, lines, _) in plane() {
        let cloud = body(name);
        let mut cuts = PlanarCuts::new(&CutSettings {
            weld_tolerance: 0.05 * cloud.reach,
            index_cell: 0.1,
        });
        let mut growing = cloud.factors();
        for line in &lines {
            let stroke = cuts.start(line[0]).unwrap();
            for &point in &line[1..] {
                let before = growing.to_vec();
                if let Some(new) = cuts.append(stroke, point).unwrap() {
                    growing.update(&cloud.graph(), &cuts, new..new + 1, &inside);
                }
                for (pair, (old, new)) in before.iter().zip(&growing.to_vec()).enumerate() {
                    assert!(new <= old, "{name}: pair {pair} rises from {old} to {new}");
                }
            }
        }
        let at_once = factors(&cloud, &cuts);
        for (grown, once) in growing.to_vec().iter().zip(&at_once) {
            assert!(grown <= once, "{name}: grown {grown}, at once {once}");
            assert_eq!(*grown < 1.0, *once < 1.0, "{name}");
        }
    }
}

#[test]
fn order_direction_repetition_and_subdivision_of_segments_do_not_matter() {
    let mut random = Random::new(78);
    for (name, lines, _) in plane() {
        let cloud = body(name);
        let mut all = segments(&cut(&lines, 0.05 * cloud.reach));
        let reference = factors(&cloud, &from_segments(&all, 0.0));
        // Halves, where no node is on the cut: rounding moves their middle off the line.
        if !name.contains("through nodes") {
            let halves: Vec<[DVec2; 2]> = all
                .iter()
                .flat_map(|&[p, q]| [[p, p.midpoint(q)], [p.midpoint(q), q]])
                .collect();
            let found = factors(&cloud, &from_segments(&halves, 0.0));
            for (a, b) in reference.iter().zip(&found) {
                assert!((a - b).abs() <= 1e-12, "{name}: {a} and {b} in halves");
            }
        }
        let count = all.len();
        for k in (1..count).rev() {
            all.swap(k, (random.bits() % (k as u64 + 1)) as usize);
        }
        for ends in &mut all {
            if random.bits().is_multiple_of(2) {
                ends.reverse();
            }
        }
        let again: Vec<[DVec2; 2]> = all.iter().step_by(3).map(|&[p, q]| [q, p]).collect();
        all.extend(&again);
        all.push([all[0][0]; 2]);
        let shuffled = from_segments(&all, 0.0);
        assert_eq!(shuffled.segment_count(), count);
        assert_eq!(shuffled.dropped().duplicate, again.len());
        assert_eq!(shuffled.dropped().zero_area, 1);
        let found = factors(&cloud, &shuffled);
        for (a, b) in reference.iter().zip(&found) {
            assert_eq!(a.to_bits(), b.to_bits(), "{name}: {a} and {b}");
        }
    }
}

/// The rule by loops over all segments and corners, in plain floating point.
fn twin(segments: &[[DVec2; 2]], a: DVec3, b: DVec3, h: f64) -> f64 {
    let crosses = |a: DVec3, b: DVec3| {
        segments
            .iter()
            .any(|&[p, q]| cross2(a.truncate(), b.truncate(), p, q))
    };
    if !crosses(a, b) {
        return 1.0;
    }
    let mut best = h;
    for corner in segments.iter().flatten() {
        let inward: DVec2 = segments
            .iter()
            .filter_map(|[p, q]| {
                (p == corner)
                    .then(|| *q - *p)
                    .or((q == corner).then(|| *p - *q))
            })
            .map(DVec2::normalize)
            .sum();
        let at = corner.extend(0.0);
        let length = a.distance(at) + at.distance(b);
        if inward.length() < 0.05 || length >= best {
            continue;
        }
        let free = at - 0.05 * h * inward.normalize().extend(0.0);
        if inside(free) && !crosses(a, free) && !crosses(free, b) {
            best = length;
        }
    }
    kernel(best / h) / kernel(a.distance(b) / h)
}

#[test]
fn equal_to_brute_force_in_any_plane_case() {
    for (name, lines, _) in plane() {
        if name.contains("through nodes") {
            continue; // plain floating point has no rule for ties
        }
        let cloud = body(name);
        let cuts = cut(&lines, 0.05 * cloud.reach);
        let found = factors(&cloud, &cuts);
        let segments = segments(&cuts);
        for (pair, &(i, j)) in cloud.pairs().iter().enumerate() {
            let (f, far) = (found[pair], pair % 7 != 0);
            if i > j || (f >= 1.0 && far) {
                continue;
            }
            let expected = twin(&segments, cloud.x[i], cloud.x[j], cloud.reach);
            assert!(
                (f - expected).abs() < 1e-9,
                "{name}: {i} {j} {f} {expected}"
            );
        }
    }
}
