//! What factors and cuts hold, and that the search behind it finds the same in any order of nodes.

use glam::DVec3;
use testkit::cloud::{Random, lattice, lattice_rows};

use super::slow::{Cloud, inside};
use super::space_cases::cut;
use crate::{CutSettings, Cuts, FactorSettings, Graph, PairFactors};

/// A straight strip of `captures` steps of a spacing in a corner of a lattice of spacing 1.
fn strip(captures: u32) -> Cuts {
    let at = |k: u32, z: f64| DVec3::new(f64::from(k) + 0.6, 2.4, z);
    let blade = |k: u32| vec![at(k, 1.2), at(k, 4.9)];
    let strokes = vec![(0..=captures).map(blade).collect()];
    cut(&strokes, &CutSettings::for_spacing(1.0))
}

/// Factors of a lattice body before the strip, and after.
fn cut_lattice(size: [usize; 3], cuts: &Cuts) -> [PairFactors; 2] {
    let x = lattice(size, 1.0, 0.2, 3);
    let (offsets, indices) = lattice_rows(size);
    let graph = Graph::new(&x, &offsets, &indices).unwrap();
    let whole = PairFactors::new(&graph, &FactorSettings::default());
    let mut factors = whole.clone();
    factors.update(&graph, cuts, 0..cuts.triangle_count(), &|_| true);
    [whole, factors]
}

#[test]
fn factors_take_memory_for_pairs_that_are_cut_and_next_to_none_for_others() {
    // Nodes of one body begin as those of the other: the strip cuts the same pairs of both.
    for captures in [2, 8, 20] {
        let cuts = strip(captures);
        let small = cut_lattice([24, 6, 7], &cuts);
        let large = cut_lattice([24, 60, 70], &cuts);
        let held = |[whole, cut]: &[PairFactors; 2]| cut.bytes() - whole.bytes();
        for factors in [&small, &large] {
            let pairs = 2 * factors[1].crossed_count();
            assert!(pairs > 30 * captures as usize, "{pairs}");
            let bent = 2 * (factors[1].crossed_count() - factors[1].severed_count());
            let most = pairs * PairFactors::BYTES_PER_PAIR + bent * PairFactors::BYTES_PER_CONORMAL;
            assert!(bent > 0 && held(factors) <= most, "{bent} pairs");
            assert!(held(factors) > pairs * PairFactors::BYTES_PER_PAIR);
        }
        assert_eq!([small[0].bytes(), large[0].bytes()], [0, 0], "uncut");
    }
}

#[test]
fn a_cut_takes_the_same_memory_per_triangle_however_long_it_is() {
    let per_triangle = |captures| {
        let cuts = strip(captures);
        cuts.bytes() as f64 / cuts.triangle_count() as f64
    };
    let (short, long) = (per_triangle(2), per_triangle(200));
    assert!(long < 2.0 * short && long < 2000.0, "{short} and {long}");
}

#[test]
fn nodes_in_any_order_have_the_same_factors() {
    let cloud = Cloud::lattice(12, 12, 0.25, 2.2);
    let mut random = Random::new(8);
    let mut place: Vec<usize> = (0..cloud.x.len()).collect();
    for k in (1..place.len()).rev() {
        place.swap(k, (random.bits() % (k as u64 + 1)) as usize);
    }
    let mut moved = vec![DVec3::ZERO; place.len()];
    for (old, &new) in place.iter().enumerate() {
        moved[new] = cloud.x[old];
    }
    let shuffled = Cloud::joined(moved, cloud.radius);
    let blade = |x: f64, y: f64| vec![DVec3::new(x, y, -0.3), DVec3::new(x, y + 0.1, 0.7)];
    let strokes = vec![vec![blade(-0.3, 0.45), blade(0.3, 0.55), blade(0.7, 0.4)]];
    let cuts = cut(&strokes, &super::space_cases::settings(&cloud));
    let of = |cloud: &Cloud| {
        let mut factors = cloud.factors();
        factors.update(&cloud.graph(), &cuts, 0..cuts.triangle_count(), &inside);
        factors
    };
    let (found, reordered) = (of(&cloud), of(&shuffled));
    assert!(found.crossed_count() > 300 && found.severed_count() > 100);
    assert_eq!(found.crossed_count(), reordered.crossed_count());
    let graph = shuffled.graph();
    for (pair, &(i, j)) in cloud.pairs().iter().enumerate() {
        let other = graph.pair(place[i] as u32, place[j] as u32);
        let (a, b) = (found.factor(pair), reordered.factor(other));
        assert_eq!(a.to_bits(), b.to_bits(), "pair ({i}, {j}): {a} and {b}");
    }
}
