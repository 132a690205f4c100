//! What factors know of a cut's front: its conormals beside nodes.

use glam::{DMat3, DVec3};

use super::slow::{Cloud, inside};
use super::space_cases::{cut, settings};
use crate::{CutSettings, Cuts, FactorSettings, Graph, PairFactors, Rule};

/// Factors after the cut's pieces from `first` on.
fn updated(cloud: &Cloud, factors: &mut PairFactors, cuts: &Cuts, first: usize) {
    let graph = cloud.graph();
    factors.update(&graph, cuts, first..cuts.triangle_count(), &|_| true);
}

fn matrices(cloud: &Cloud, factors: &PairFactors) -> Vec<DMat3> {
    let graph = cloud.graph();
    let all = 0..cloud.x.len();
    all.map(|node| factors.front_matrix(&graph, node)).collect()
}

fn off(a: DMat3, b: DMat3) -> f64 {
    let off = (a - b).to_cols_array();
    off.iter().fold(0.0, |most, x| most.max(x.abs()))
}

/// Whether a node has a pair that is bent around a front.
fn is_bent(graph: &Graph<'_>, factors: &PairFactors, node: usize) -> bool {
    let mut found = graph.pairs(node).map(|pair| factors.factor(pair));
    found.any(|factor| factor > 0.0 && factor < 1.0)
}

/// `ν νᵀ`.
fn square(along: DVec3) -> DMat3 {
    DMat3::from_cols(along * along.x, along * along.y, along * along.z)
}

/// A blade across all of the cloud, upright, along a direction, up to the origin's distance `reach`.
fn strip(along: DVec3, reach: f64) -> Cuts {
    let middle = DVec3::new(0.5, 0.5, 0.0);
    let side = DVec3::Z * 4.0;
    let blade = |at: f64| vec![middle + along * at - side, middle + along * at + side];
    let count = 20;
    let stroke = (0..=count).map(|k| blade(-3.0 + (3.0 + reach) * f64::from(k) / f64::from(count)));
    cut(&vec![stroke.collect()], &CutSettings::for_spacing(0.1))
}

#[test]
fn beside_a_straight_front_it_is_its_conormal_at_nodes_with_bent_pairs_alone() {
    let cloud = Cloud::lattice(12, 12, 0.25, 2.2);
    for angle in [0.0, 0.4, 1.1] {
        let along = DVec3::new(f64::cos(angle), f64::sin(angle), 0.0);
        let cuts = strip(along, 0.03);
        let mut factors = cloud.factors();
        updated(&cloud, &mut factors, &cuts, 0);
        let graph = cloud.graph();
        let expected = square(along);
        let mut seen = 0;
        for (node, found) in matrices(&cloud, &factors).into_iter().enumerate() {
            if is_bent(&graph, &factors, node) {
                assert!(off(found, expected) < 1e-9, "{node}: {found}");
                seen += 1;
            } else {
                assert_eq!(found, DMat3::ZERO, "{node}");
            }
        }
        assert!(seen > 6, "{seen}");
    }
}

#[test]
fn it_is_that_of_the_front_after_each_update_of_a_cut_that_grows() {
    let cloud = Cloud::lattice(12, 12, 0.25, 2.2);
    let graph = cloud.graph();
    let along = DVec3::new(0.8, 0.6, 0.0);
    let expected = square(along);
    let middle = DVec3::new(0.5, 0.5, 0.0);
    let blade = |at: f64| [-4.0, 4.0].map(|z| middle + along * at + z * DVec3::Z);
    let mut cuts = Cuts::new(&CutSettings::for_spacing(0.1));
    let stroke = cuts.start(&blade(-3.0)).unwrap();
    let mut factors = cloud.factors();
    let mut left = 0;
    for at in [-0.4, -0.23, -0.2, 0.0, 0.11, 0.3] {
        let new = cuts.append(stroke, &blade(at)).unwrap();
        let before = matrices(&cloud, &factors);
        let touched = factors.update(&graph, &cuts, new, &|_| true);
        let found = matrices(&cloud, &factors);
        for (node, (found, before)) in found.iter().zip(&before).enumerate() {
            let known = touched.nodes.binary_search(&(node as u32)).is_ok();
            assert!(known || found == before, "{node}");
            let bent = is_bent(&graph, &factors, node);
            let expected = if bent { expected } else { DMat3::ZERO };
            assert!(off(*found, expected) < 1e-9, "{node}: {found}");
            left += usize::from(!bent && *before != DMat3::ZERO);
        }
    }
    assert!(left > 10, "{left} nodes that the front has left");
}

#[test]
fn what_a_cut_parts_has_no_front_any_more() {
    let cloud = Cloud::lattice(12, 12, 0.25, 2.2);
    let through = strip(DVec3::X, 3.0);
    let mut factors = cloud.factors();
    let all = 0..through.triangle_count();
    factors.update(&cloud.graph(), &through, all, &inside);
    let left = matrices(&cloud, &factors);
    assert!(left.iter().all(|m| *m == DMat3::ZERO));
    assert!(factors.severed_count() > 20);
}

#[test]
fn a_rule_without_paths_has_no_front() {
    let cloud = Cloud::lattice(12, 12, 0.25, 2.2);
    let cuts = strip(DVec3::X, 0.03);
    let wanted = FactorSettings {
        rule: Rule::Visibility,
        ..FactorSettings::default()
    };
    let mut factors = PairFactors::new(&cloud.graph(), &wanted);
    updated(&cloud, &mut factors, &cuts, 0);
    assert!(factors.crossed_count() > 10);
    let found = matrices(&cloud, &factors);
    assert!(found.iter().all(|m| *m == DMat3::ZERO));
}

#[test]
fn round_a_disc_it_points_outwards() {
    let cloud = Cloud::lattice(12, 12, 0.25, 2.2);
    let mut cuts = Cuts::new(&settings(&cloud));
    let middle = DVec3::new(0.5, 0.52, 0.0);
    let count = 48_u32;
    let mut corners = vec![middle];
    for k in 0..count {
        let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(count)).sin_cos();
        corners.push(middle + 0.3 * DVec3::new(c, 0.0, s));
    }
    let triangles = (0..count).map(|k| [0, 1 + k, 1 + (k + 1) % count]);
    let triangles: Vec<[u32; 3]> = triangles.collect();
    cuts.add_surface(&corners, &triangles).unwrap();
    let mut factors = cloud.factors();
    updated(&cloud, &mut factors, &cuts, 0);
    let mut seen = 0;
    for (x, found) in cloud.x.iter().zip(matrices(&cloud, &factors)) {
        let trace = found.x_axis.x + found.y_axis.y + found.z_axis.z;
        if found == DMat3::ZERO {
            continue;
        }
        seen += 1;
        assert!((trace - 1.0).abs() < 1e-9, "{found}");
        let outward = (*x - middle).with_y(0.0).normalize_or_zero();
        let (share, up) = (outward.dot(found * outward), (found * DVec3::Y).length());
        assert!(share > 0.5 && up < 0.1, "{x}: {found}");
    }
    assert!(seen > 10, "{seen}");
}
