//! Ligaments thinner than a node spacing, against the rule by loops over everything.

use std::collections::BTreeSet;

use glam::DVec3;
use testkit::cloud::Random;

use super::slow::{Cloud, inside};
use crate::{CutSettings, Cuts, PairFactors, connected_pieces};

const SMALLEST: usize = 12;

/// Parts by pairs that no cut crosses.
fn parts(cloud: &Cloud, factors: &[f64]) -> crate::Pieces {
    let whole: Vec<f64> = factors.iter().map(|f| f64::from(*f >= 1.0)).collect();
    connected_pieces(&cloud.offsets, &cloud.indices, &whole)
}

/// What `after` must be, given what the update left; the number of directed pairs that were severed.
fn check(cloud: &Cloud, before: &[f64], after: &PairFactors) -> usize {
    let (after, parts) = (after.to_vec(), parts(cloud, before));
    let large = |node: usize| parts.sizes[parts.piece[node] as usize] >= SMALLEST as u32;
    let joined = connected_pieces(&cloud.offsets, &cloud.indices, &after);
    // Nothing holds two large parts together any more, by way of small ones neither.
    let mut part_of = vec![None; joined.sizes.len()];
    for node in (0..cloud.x.len()).filter(|&node| large(node)) {
        let part = *part_of[joined.piece[node] as usize].get_or_insert(parts.piece[node]);
        assert_eq!(part, parts.piece[node], "node {node}");
    }
    let mut severed = 0;
    let mut ties = vec![(false, false); parts.sizes.len()];
    for (pair, (i, j)) in cloud.pairs().into_iter().enumerate() {
        let [i, j] = [i, j].map(|node| parts.piece[node] as usize);
        if before[pair] != after[pair] {
            assert!(after[pair] == 0.0 && i != j, "pair {pair} of one part");
            severed += 1;
        }
        if i != j {
            ties[i].0 |= before[pair] > 0.0;
            ties[i].1 |= after[pair] > 0.0;
        }
    }
    // A small part hangs on as it did.
    for (part, (before, after)) in ties.into_iter().enumerate() {
        let small = parts.sizes[part] < SMALLEST as u32;
        assert!(after || !before || !small, "part {part}");
    }
    severed
}

/// Grows blades through the cloud, piece by piece, and severs ligaments after each.
fn grow(cloud: &Cloud, strokes: &[Vec<[DVec3; 2]>]) -> (PairFactors, usize) {
    let graph = cloud.graph();
    let mut cuts = Cuts::new(&CutSettings::for_spacing(0.1));
    let mut factors = cloud.factors();
    let mut severed = 0;
    for stroke in strokes {
        let number = cuts.start(&stroke[0]).unwrap();
        for blade in &stroke[1..] {
            let new = cuts.append(number, blade).unwrap();
            let start = factors.clone();
            let mut touched = factors.update(&graph, &cuts, new, &inside);
            let before = factors.to_vec();
            factors.sever_ligaments(&graph, &mut touched, SMALLEST);
            severed += check(cloud, &before, &factors);
            let pairs = cloud.pairs().into_iter().enumerate();
            let fell = pairs.filter(|(pair, _)| start.factor(*pair) != factors.factor(*pair));
            let changed: BTreeSet<u32> = fell.map(|(_, (i, _))| i as u32).collect();
            assert!(changed.into_iter().eq(touched), "nodes of pairs that fell");
        }
        cuts.end(number).unwrap();
    }
    (factors, severed)
}

/// An upright blade across all of the unit square's lattice, from its left up to `ends`.
fn across(ends: &[f64]) -> Vec<[DVec3; 2]> {
    let blade = |x: &f64| [-0.3, 0.3].map(|z| DVec3::new(*x, 0.5, z));
    [-0.2].iter().chain(ends).map(blade).collect()
}

#[test]
fn a_ligament_that_no_pair_passes_is_severed_and_a_thicker_one_is_not() {
    // Twelve nodes along each side; the last is half a distance before the end.
    let cloud = Cloud::lattice(12, 1, 0.0, 2.2);
    for (end, parted) in [(0.80, false), (0.90, false), (0.97, true), (0.99, true)] {
        let (factors, severed) = grow(&cloud, &[across(&[0.3, 0.6, end])]);
        let sizes = cloud.piece_sizes(&factors.to_vec());
        assert_eq!(sizes.len(), if parted { 2 } else { 1 }, "{end}: {sizes:?}");
        assert_eq!(severed > 0, parted, "{end}");
        for node in 0..cloud.x.len() {
            let front = factors.front_matrix(&cloud.graph(), node);
            assert!(!parted || front == glam::DMat3::ZERO, "{end}: {node}");
        }
    }
}

#[test]
fn a_large_part_may_hang_on_small_ones_alone() {
    // Two cuts, one node apart, that end short of each other: the nodes between hang on one side.
    let cloud = Cloud::lattice(12, 1, 0.0, 2.2);
    let back: Vec<[DVec3; 2]> = [1.2, 0.54]
        .map(|x| [-0.3, 0.3].map(|z| DVec3::new(x, 0.5, z)))
        .to_vec();
    let (factors, severed) = grow(&cloud, &[across(&[0.3, 0.52]), back]);
    let sizes = cloud.piece_sizes(&factors.to_vec());
    assert!(severed > 0 && sizes.len() == 2, "{severed}: {sizes:?}");
}

#[test]
fn random_strokes_leave_what_the_rule_says() {
    let mut random = Random::new(23);
    let mut severed = 0;
    for round in 0..40 {
        let depth = if round % 2 == 0 { 1 } else { 6 };
        let n = if depth == 1 { 14 } else { 6 };
        let cloud = Cloud::lattice(n, depth, 0.25, 2.2);
        let strokes: Vec<Vec<[DVec3; 2]>> = (0..3)
            .map(|_| {
                let middle = DVec3::splat(0.5) + random.vector(0.5);
                let along = random.vector(1.0).with_z(0.0).normalize();
                let side = match depth {
                    1 => DVec3::Z,
                    _ => random.vector(1.0).normalize().cross(along),
                };
                let blade = |at: f64| [-1.5, 1.5].map(|s| middle + along * at + side * s);
                [-1.2, -0.5, -0.3, -0.1, 0.1, 0.25, 0.4].map(blade).to_vec()
            })
            .collect();
        severed += grow(&cloud, &strokes).1;
    }
    assert!(severed > 40, "{severed}");
}
