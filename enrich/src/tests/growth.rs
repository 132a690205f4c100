//! Cuts that grow: prefixes, order of arrival, repetition, subdivision.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use testkit::cloud::Random;

use super::shapes::space;
use super::slow::{inside, kernel};
use super::space_cases::{body, cut, factors, settings, soup};
use crate::{CutError, CutSettings, Cuts};

#[test]
fn factors_never_rise_in_any_prefix_and_touched_says_what_changed() {
    let mut worst = 0.0_f64;
    for (name, strokes, _) in space() {
        let cloud = body(&name);
        let mut cuts = Cuts::new(&settings(&cloud));
        let mut growing = cloud.factors();
        for blades in &strokes {
            let stroke = cuts.start(&blades[0]).unwrap();
            for blade in &blades[1..] {
                let before = growing.to_vec();
                let new = cuts.append(stroke, blade).unwrap();
                let touched = growing.update(&cloud.graph(), &cuts, new, &inside);
                let mut changed = BTreeSet::new();
                for (pair, (&old, &new)) in before.iter().zip(&growing.to_vec()).enumerate() {
                    assert!(new <= old, "{name}: pair {pair} rises from {old} to {new}");
                    if new < old {
                        changed.insert(cloud.indices[pair]);
                    }
                }
                assert!(changed.into_iter().eq(touched), "{name}");
            }
        }
        // At the end no pair knows more than if the cut had come at once, crossed pairs are the
        // same, and weights too.
        let at_once = factors(&cloud, &cuts);
        let (mut lower, mut most) = (0, 0.0_f64);
        let pairs = cloud.pairs();
        for (pair, (&grown, &once)) in growing.to_vec().iter().zip(&at_once).enumerate() {
            let (i, j) = pairs[pair];
            let alike = grown <= once && (grown < 1.0) == (once < 1.0);
            assert!(alike, "{name}: pair {pair} {grown}, at once {once}");
            lower += usize::from(grown < once - 1e-6);
            let uncut = kernel(cloud.x[i].distance(cloud.x[j]) / cloud.radius);
            most = most.max((once - grown) * uncut);
        }
        if testkit::tol::print_residuals() {
            println!("{name}: {lower} pairs lower when grown, weight by {most:.1e} at most");
        }
        worst = worst.max(most);
        let crossed = at_once.iter().filter(|f| **f < 1.0).count();
        assert_eq!(2 * growing.crossed_count(), crossed);
    }
    assert!(worst <= 0.05, "weights differ by {worst}");
}

fn from_soup(soup: &[[DVec3; 3]], settings: &CutSettings) -> Cuts {
    let mut cuts = Cuts::new(settings);
    for triangle in soup {
        cuts.add_surface(triangle, &[[0, 1, 2]]).unwrap();
    }
    cuts
}

#[test]
fn order_direction_and_repetition_of_triangles_do_not_matter() {
    let mut random = Random::new(77);
    for (name, strokes, _) in space() {
        let cloud = body(&name);
        let cuts = cut(&strokes, &settings(&cloud));
        let exact = CutSettings {
            weld_tolerance: 0.0,
            ..settings(&cloud)
        };
        let mut soup = soup(&cuts);
        let reference = factors(&cloud, &from_soup(&soup, &exact));
        let count = soup.len();
        for k in (1..soup.len()).rev() {
            soup.swap(k, (random.bits() % (k as u64 + 1)) as usize);
        }
        for triangle in &mut soup {
            match random.bits() % 4 {
                0 => triangle.reverse(),
                1 => triangle.rotate_left(1),
                2 => triangle.swap(0, 1),
                _ => {}
            }
        }
        // Every third triangle a second time, and some without area.
        let again: Vec<[DVec3; 3]> = soup.iter().step_by(3).map(|&[p, q, r]| [r, p, q]).collect();
        soup.extend(&again);
        let [p, q, _] = soup[0];
        soup.extend([[p, q, p], [p, p, p]]);
        let shuffled = from_soup(&soup, &exact);
        assert_eq!(shuffled.triangle_count(), count);
        let found = factors(&cloud, &shuffled);
        for (pair, (a, b)) in reference.iter().zip(&found).enumerate() {
            assert_eq!(a.to_bits(), b.to_bits(), "{name}: pair {pair}, {a} and {b}");
        }
    }
}

#[test]
fn subdivision_of_plane_strips_moves_factors_by_round_off_only() {
    for (name, strokes, _) in space() {
        if !name.contains("upright") || name.contains("through nodes") {
            continue;
        }
        let cloud = body(&name);
        let cuts = cut(&strokes, &settings(&cloud));
        let exact = CutSettings {
            weld_tolerance: 1e-12,
            ..settings(&cloud)
        };
        let reference = factors(&cloud, &from_soup(&soup(&cuts), &exact));
        let fine: Vec<[DVec3; 3]> = soup(&cuts)
            .into_iter()
            .flat_map(|[p, q, r]| {
                let (a, b, c) = (p.midpoint(q), q.midpoint(r), r.midpoint(p));
                [[p, a, c], [a, q, b], [c, b, r], [a, b, c]]
            })
            .collect();
        let found = factors(&cloud, &from_soup(&fine, &exact));
        for (pair, (a, b)) in reference.iter().zip(&found).enumerate() {
            // Ways of several diffraction points are tightened until a sweep gains no more than 1e-6.
            assert!((a - b).abs() <= 1e-6, "{name}: pair {pair}, {a} and {b}");
        }
    }
}

#[test]
fn an_update_tries_as_many_paths_after_a_thousand_triangles_as_after_ten() {
    // A bar without jitter, so that each step of the blade meets the same nodes again.
    let x = testkit::cloud::lattice([530, 4, 3], 1.0, 0.0, 1);
    let mut indices = Vec::new();
    let mut offsets = vec![0];
    for (i, p) in x.iter().enumerate() {
        let places = i.saturating_sub(1100)..(i + 1100).min(x.len());
        let near = places.filter(|&j| j != i && p.distance(x[j]) < 1.5);
        indices.extend(near.map(|j| j as u32));
        offsets.push(indices.len() as u32);
    }
    let graph = crate::Graph::new(&x, &offsets, &indices).unwrap();
    let mut factors = crate::PairFactors::new(&graph, &crate::FactorSettings::default());
    let blade = |k: usize| [0.3, 1.8].map(|z| DVec3::new(k as f64 + 4.4, 1.6, z));
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
    let stroke = cuts.start(&blade(0)).unwrap();
    let mut asked = Vec::new();
    for k in 1..=510 {
        let new = cuts.append(stroke, &blade(k)).unwrap();
        let tried = AtomicUsize::new(0);
        let touched = factors.update(&graph, &cuts, new, &|_| {
            tried.fetch_add(1, Ordering::Relaxed);
            true
        });
        assert!(touched.len() < 100, "{}", touched.len());
        asked.push(tried.into_inner());
    }
    let sum = |range: std::ops::Range<usize>| asked[range].iter().sum::<usize>();
    let (early, late) = (sum(5..15), sum(500..510));
    if testkit::tol::print_residuals() {
        println!("tried {early} paths in 10 updates after 10 triangles, {late} after 1,000");
    }
    assert!(early > 50 && late * 100 <= early * 101, "{early} {late}");
}

/// A truncated cut is the one of then, in all that it answers and in how it grows.
#[test]
fn a_truncated_cut_is_as_it_was() {
    let settings = CutSettings::for_spacing(0.1);
    let mut random = Random::new(7);
    let mut edge = |x: f64| -> Vec<DVec3> {
        let place = |k: u32| DVec3::new(x, f64::from(k) * 0.1, 0.1);
        let places = (0..12).map(place);
        places.map(|at| at + random.vector(0.02)).collect()
    };
    let edges: Vec<Vec<DVec3>> = (0..20).map(|k| edge(0.1 * f64::from(k))).collect();
    let strip = |cuts: &mut Cuts, from: &[DVec3], to: &[DVec3]| {
        let points: Vec<DVec3> = from.iter().chain(to).copied().collect();
        let triangles: Vec<[u32; 3]> = (0..11).map(|k| [k, k + 1, k + 12]).collect();
        cuts.add_surface(&points, &triangles).unwrap();
    };
    let told = |cuts: &Cuts| {
        let (vertices, triangles) = cuts.surface();
        (vertices.to_vec(), triangles.to_vec())
    };
    let mut cuts = Cuts::new(&settings);
    let stroke = cuts.start(&edges[0]).unwrap();
    for k in 1..8 {
        cuts.append(stroke, &edges[k]).unwrap();
        strip(&mut cuts, &edges[k - 1], &edges[k]);
    }
    let mut before = cuts.clone();
    let (vertices, triangles) = told(&cuts);
    let other = cuts.start(&edges[0]).unwrap();
    for k in 8..16 {
        cuts.append(stroke, &edges[k]).unwrap();
        strip(&mut cuts, &edges[k - 1], &edges[k]);
    }
    assert!(cuts.triangle_count() > triangles.len() + 100);
    cuts.truncate(vertices.len(), triangles.len());
    assert_eq!(told(&cuts), told(&before));
    let ended = cuts.append(stroke, &edges[9]);
    assert_eq!(ended, Err(CutError::StrokeEnded { stroke }), "it has moved");
    assert_eq!(cuts.end(other), Ok(()), "it has not");
    for cuts in [&mut cuts, &mut before] {
        for k in 12..20 {
            strip(cuts, &edges[k - 1], &edges[k]);
        }
    }
    assert_eq!(told(&cuts), told(&before));
    for k in 0..200 {
        let [a, b] = [0.01, 0.009].map(|step| DVec3::new(step * f64::from(k), 0.55, 0.0));
        let (a, b) = (a, b + 0.3 * DVec3::Z);
        assert_eq!(cuts.crosses(a, b), before.crosses(a, b), "{a} to {b}");
        assert_eq!(cuts.nearest(a, 0.4), before.nearest(a, 0.4), "{a}");
    }
}
