//! What factors know of a cut's front: its conormals beside nodes.

use glam::{DMat3, DVec3};

use super::slow::{Cloud, inside};
use super::space_cases::{cut, settings};
use crate::{CutSettings, Cuts, FactorSettings, Graph, PairFactors, Rule};

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

/// A blade across all of the cloud, upright, `at` from its middle along a direction.
fn blade(along: DVec3, at: f64) -> [DVec3; 2] {
    let middle = DVec3::new(0.5, 0.5, 0.0) + along * at;
    [-4.0, 4.0].map(|z| middle + z * DVec3::Z)
}

#[test]
fn beside_a_growing_front_it_is_its_conormal_at_nodes_with_bent_pairs_alone() {
    let cloud = Cloud::lattice(12, 12, 0.25, 2.2);
    let graph = cloud.graph();
    for angle in [0.0, 0.4, 1.1] {
        let along = DVec3::new(f64::cos(angle), f64::sin(angle), 0.0);
        let expected = square(along);
        let mut cuts = Cuts::new(&CutSettings::for_spacing(0.1));
        let stroke = cuts.start(&blade(along, -3.0)).unwrap();
        let mut factors = cloud.factors();
        let (mut seen, mut left) = (0, 0);
        for at in [-0.4, -0.23, -0.2, 0.0, 0.11, 0.3] {
            let new = cuts.append(stroke, &blade(along, at)).unwrap();
            let before = matrices(&cloud, &factors);
            let touched = factors.update(&graph, &cuts, new, &|_| true);
            let found = matrices(&cloud, &factors);
            for (node, (found, before)) in found.iter().zip(&before).enumerate() {
                let known = touched.binary_search(&(node as u32)).is_ok();
                assert!(known || found == before, "{node}");
                if is_bent(&graph, &factors, node) {
                    assert!(off(*found, expected) < 1e-9, "{node}: {found}");
                    seen += 1;
                } else {
                    assert_eq!(*found, DMat3::ZERO, "{node}");
                    left += usize::from(*before != DMat3::ZERO);
                }
            }
        }
        assert!(seen > 36 && left > 10, "{seen} seen, the front left {left}");
    }
}

#[test]
fn what_a_cut_parts_has_no_front_any_more_and_a_rule_without_paths_never() {
    let cloud = Cloud::lattice(12, 12, 0.25, 2.2);
    for (rule, end) in [(Rule::Diffraction, 3.0), (Rule::Visibility, 0.03)] {
        let stroke = [-3.0, end].map(|at| blade(DVec3::X, at).to_vec());
        let cuts = cut(&vec![stroke.to_vec()], &CutSettings::for_spacing(0.1));
        let settings = FactorSettings {
            rule,
            ..FactorSettings::default()
        };
        let mut factors = PairFactors::new(&cloud.graph(), &settings);
        let all = 0..cuts.triangle_count();
        factors.update(&cloud.graph(), &cuts, all, &inside);
        assert!(factors.severed_count() > 20, "{rule:?}");
        let found = matrices(&cloud, &factors);
        assert!(found.iter().all(|m| *m == DMat3::ZERO), "{rule:?}");
    }
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
    let all = 0..cuts.triangle_count();
    factors.update(&cloud.graph(), &cuts, all, &|_| true);
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
