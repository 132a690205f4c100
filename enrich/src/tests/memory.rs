//! What cuts hold, and that factors are the same in any order of nodes.

use glam::DVec3;
use testkit::cloud::Random;

use super::slow::{Cloud, inside};
use super::space_cases::cut;
use crate::{CutSettings, Cuts};

/// A straight strip of `captures` steps of a spacing in a corner of a lattice of spacing 1.
fn strip(captures: u32) -> Cuts {
    let at = |k: u32, z: f64| DVec3::new(f64::from(k) + 0.6, 2.4, z);
    let blade = |k: u32| vec![at(k, 1.2), at(k, 4.9)];
    let strokes = vec![(0..=captures).map(blade).collect()];
    cut(&strokes, &CutSettings::for_spacing(1.0))
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
