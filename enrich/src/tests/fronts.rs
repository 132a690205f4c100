//! Conormals of a cut's front.

use glam::DVec3;

use super::slow::{Cloud, inside};
use super::space_cases::{cut, settings};
use crate::{Cuts, FactorSettings, PairFactors, Rule};

/// A blade along z that moves from x = −0.2 in the plane of y.
fn strip(y: f64, to: f64) -> Vec<Vec<DVec3>> {
    let at = |x: f64| vec![DVec3::new(x, y, -0.3), DVec3::new(x, y, 1.3)];
    (0..=6)
        .map(|k| at(-0.2 + (to + 0.2) * f64::from(k) / 6.0))
        .collect()
}

fn conormals(cloud: &Cloud, cuts: &Cuts, factors: &mut PairFactors) -> (Vec<u32>, Vec<DVec3>) {
    let graph = cloud.graph();
    factors.update(&graph, cuts, 0..cuts.triangle_count(), &inside);
    let nodes: Vec<u32> = (0..cloud.x.len() as u32).collect();
    factors.front_conormals(&graph, cuts, &nodes, &inside)
}

#[test]
fn a_row_has_one_conormal_for_each_weakened_pair_of_its_node() {
    let cloud = Cloud::lattice(10, 10, 0.25, 2.2);
    let cuts = cut(&vec![strip(0.48, 0.53)], &settings(&cloud));
    let mut factors = cloud.factors();
    let (offsets, found) = conormals(&cloud, &cuts, &mut factors);
    let graph = cloud.graph();
    let mut fronts = 0;
    for i in 0..cloud.x.len() {
        let weakened = graph.pairs(i).filter(|&pair| {
            let factor = factors.factor(pair);
            factor > 0.0 && factor < 1.0
        });
        let row = &found[offsets[i] as usize..offsets[i + 1] as usize];
        assert_eq!(row.len(), weakened.count(), "node {i}");
        fronts += usize::from(!row.is_empty());
        // The front is straight, along z at x = 0.53: the sheet's conormal there is x.
        for conormal in row {
            assert!(conormal.distance(DVec3::X) < 1e-12, "{conormal}");
            assert!((cloud.x[i].x - 0.53).abs() < cloud.reach);
        }
    }
    assert!(fronts > 50, "{fronts} nodes at the front");
    // The same from the other side, and what the visibility rule weakens has no way.
    let backwards = strip(0.48, 0.53);
    let backwards = backwards
        .into_iter()
        .map(|blade| vec![blade[1], blade[0]])
        .collect();
    let turned = cut(&vec![backwards], &settings(&cloud));
    let (same, others) = conormals(&cloud, &turned, &mut cloud.factors());
    assert_eq!(same, offsets);
    for (a, b) in found.iter().zip(&others) {
        assert!(a.distance(*b) < 1e-12, "{a} {b}");
    }
    let seen = FactorSettings {
        rule: Rule::Visibility,
        ..FactorSettings::default()
    };
    let mut seen = PairFactors::new(&graph, &seen);
    assert!(conormals(&cloud, &cuts, &mut seen).1.is_empty());
}

#[test]
fn a_through_cut_has_no_front() {
    let cloud = Cloud::lattice(10, 10, 0.25, 2.2);
    let cuts = cut(&vec![strip(0.48, 1.2)], &settings(&cloud));
    let mut factors = cloud.factors();
    let (offsets, found) = conormals(&cloud, &cuts, &mut factors);
    assert!(factors.severed_count() > 100, "nothing is cut");
    assert!(found.is_empty() && offsets.iter().all(|&at| at == 0));
}
