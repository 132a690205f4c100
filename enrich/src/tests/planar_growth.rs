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
            weld_tolerance: 0.05 * cloud.radius,
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
        let (mut lower, mut most) = (0, 0.0_f64);
        for (grown, once) in growing.to_vec().iter().zip(&at_once) {
            assert!(grown <= once, "{name}: grown {grown}, at once {once}");
            assert_eq!(*grown < 1.0, *once < 1.0, "{name}");
            lower += usize::from(*grown < once - 1e-6);
            most = most.max(once - grown);
        }
        if testkit::tol::print_residuals() {
            println!("{name}: {lower} pairs lower when grown, by {most:.1e} at most");
        }
        assert!(most <= 0.05, "{name}: {most}");
    }
}

#[test]
fn order_direction_repetition_and_subdivision_of_segments_do_not_matter() {
    let mut random = Random::new(78);
    for (name, lines, _) in plane() {
        let cloud = body(name);
        let mut all = segments(&cut(&lines, 0.05 * cloud.radius));
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
struct Twin<'a> {
    segments: &'a [[DVec2; 2]],
    /// Corners that a way may bend round, with the direction out of the cut there.
    bends: Vec<(DVec2, DVec2)>,
    /// Lengths of the free ways from bend to bend.
    ways: Vec<Vec<f64>>,
    h: f64,
}

impl<'a> Twin<'a> {
    fn new(segments: &'a [[DVec2; 2]], h: f64) -> Self {
        let mut bends: Vec<(DVec2, DVec2)> = Vec::new();
        for corner in segments.as_flattened() {
            let others = segments.iter().filter_map(|[p, q]| {
                let to = |other: &DVec2| *other - *corner;
                (p == corner)
                    .then(|| to(q))
                    .or((q == corner).then(|| to(p)))
            });
            let inward: DVec2 = others.clone().map(DVec2::normalize).sum();
            let farthest = others.map(DVec2::length).fold(0.0, f64::max);
            // The index of these cuts has cells of 0.1.
            let flat = 0.05 * (farthest / (0.125 * 0.1)).min(1.0);
            let outward = -inward.normalize_or_zero();
            if inward.length() >= flat
                && inside((*corner + 0.05 * h * outward).extend(0.0))
                && bends.iter().all(|(at, _)| at != corner)
            {
                bends.push((*corner, outward));
            }
        }
        let mut twin = Self {
            segments,
            bends,
            ways: Vec::new(),
            h,
        };
        let all = || twin.bends.iter().copied();
        twin.ways = all()
            .map(|a| all().map(|b| twin.way(a, b)).collect())
            .collect();
        twin
    }

    fn crosses(&self, a: DVec2, b: DVec2) -> bool {
        self.segments.iter().any(|&[p, q]| cross2(a, b, p, q))
    }

    /// Length of the line between two bends or ends, infinite if it is not free.
    fn way(&self, a: (DVec2, DVec2), b: (DVec2, DVec2)) -> f64 {
        let hidden = [0.05, 5e-6].iter().any(|share| {
            let at = |(point, outward): (DVec2, DVec2)| point + share * self.h * outward;
            self.crosses(at(a), at(b))
        });
        if hidden {
            f64::INFINITY
        } else {
            a.0.distance(b.0)
        }
    }

    fn factor(&self, a: DVec3, b: DVec3) -> f64 {
        let ends = [a, b].map(|p| (p.truncate(), DVec2::ZERO));
        if !self.crosses(ends[0].0, ends[1].0) {
            return 1.0;
        }
        let count = self.bends.len();
        let mut reached: Vec<f64> = (0..count)
            .map(|k| self.way(ends[0], self.bends[k]))
            .collect();
        // Bellman 1958 and Ford 1956: as often as a way within the influence radius has diffraction points.
        for _ in 0..20 {
            for k in 0..count {
                for m in 0..count {
                    reached[m] = reached[m].min(reached[k] + self.ways[k][m]);
                }
            }
        }
        let ways = (0..count).map(|k| reached[k] + self.way(self.bends[k], ends[1]));
        let best = ways.fold(self.h, f64::min);
        kernel(best / self.h) / kernel(a.distance(b) / self.h)
    }
}

#[test]
fn equal_to_brute_force_in_any_plane_case() {
    for (name, lines, _) in plane() {
        if name.contains("through nodes") {
            continue; // plain floating point has no rule for ties
        }
        let cloud = body(name);
        let cuts = cut(&lines, 0.05 * cloud.radius);
        let found = factors(&cloud, &cuts);
        let segments = segments(&cuts);
        let twin = Twin::new(&segments, cloud.radius);
        let (mut crossed, mut borderline) = (0, 0);
        for (pair, &(i, j)) in cloud.pairs().iter().enumerate() {
            let (f, far) = (found[pair], pair % 7 != 0);
            if i > j || (f >= 1.0 && far) {
                continue;
            }
            let expected = twin.factor(cloud.x[i], cloud.x[j]);
            crossed += usize::from(f < 1.0);
            assert_eq!(f < 1.0, expected < 1.0, "{name}: {i} {j} {f} {expected}");
            // A way may be free only farther from its edges than the twin asks.
            borderline += usize::from((f - expected).abs() > 1e-9);
            assert!(f >= expected - 1e-9, "{name}: {i} {j} {f} {expected}");
        }
        if testkit::tol::print_residuals() {
            println!("{name}: {borderline} of {crossed} differ");
        }
        assert!(
            borderline * 100 <= crossed,
            "{name}: {borderline} of {crossed}"
        );
    }
}
