//! Degenerate and extreme cuts.

use glam::DVec3;
use proptest::prelude::*;
use testkit::assert_matches;
use testkit::cloud::Random;
use testkit::strategies::vector;

use super::shapes::{Strokes, space};
use super::slow::{Cloud, inside};
use super::space_cases::{self, body, cut, factors};
use crate::{
    CutError, CutSettings, Cuts, FactorSettings, Graph, InfluenceRadius, PairFactors, Rule,
};

fn blade(y: f64, x: f64) -> Vec<DVec3> {
    vec![DVec3::new(x, y, -0.3), DVec3::new(x, y, 1.3)]
}

fn bent() -> Strokes {
    vec![vec![blade(0.45, -0.3), blade(0.55, 0.6), blade(0.4, 0.9)]]
}

fn cloud() -> Cloud {
    Cloud::lattice(12, 12, 0.25, 2.2)
}

fn settings(cloud: &Cloud) -> CutSettings {
    CutSettings {
        weld_tolerance: 0.05 * cloud.radius,
        influence_radius: cloud.radius,
    }
}

#[test]
fn bad_captures_are_refused_and_change_nothing() {
    let mut cuts = Cuts::new(&CutSettings::for_spacing(0.1));
    let stroke = cuts.start(&blade(0.5, 0.0)).unwrap();
    cuts.append(stroke, &blade(0.5, 0.3)).unwrap();
    let bad = [DVec3::ZERO, DVec3::new(0.0, f64::NAN, 1.0)];
    let refused = cuts.append(stroke, &bad);
    assert_matches!(refused, Err(CutError::NotFinite { point: 1, .. }));
    let refused = cuts.append(stroke, &bad[..1]);
    assert_eq!(refused, Err(CutError::TooFewPoints { found: 1 }));
    assert!(matches!(cuts.start(&bad), Err(CutError::NotFinite { .. })));
    let (stroke_5, started) = (cuts.append(5, &blade(0.5, 0.6)), 1);
    let unknown = CutError::UnknownStroke { stroke: 5, started };
    assert_eq!(stroke_5, Err(unknown));
    let out = CutError::VertexOutOfRange {
        triangle: 0,
        vertex: 7,
        vertices: 2,
    };
    let refused = cuts.add_surface(&bad[..1].repeat(2), &[[0, 1, 7]]);
    assert_eq!(refused, Err(out));
    assert_eq!(cuts.triangle_count(), 2);
    assert_eq!(cuts.append(stroke, &blade(0.5, 0.6)), Ok(2..4));
    cuts.end(stroke).unwrap();
    let ended = CutError::StrokeEnded { stroke };
    assert_eq!(cuts.end(stroke), Err(ended.clone()));
    assert_eq!(cuts.append(stroke, &blade(0.5, 0.9)), Err(ended));
}

#[test]
fn pen_lifted_and_put_back() {
    let cloud = cloud();
    // Two coplanar strips with a gap between them: below the tolerance it closes, above it is open.
    for (gap, parts) in [(0.02, 2), (0.04, 2), (0.5, 1)] {
        let gap = gap * cloud.radius;
        let strokes = vec![
            vec![blade(0.503, -0.3), blade(0.503, 0.5)],
            vec![blade(0.503, 0.5 + gap), blade(0.503, 1.3)],
        ];
        let cuts = cut(&strokes, &settings(&cloud));
        let sizes = cloud.piece_sizes(&factors(&cloud, &cuts));
        assert_eq!(sizes.len(), parts, "gap {gap}: {sizes:?}");
    }
}

#[test]
fn blade_that_stands_still_or_trembles_makes_nothing() {
    let cloud = cloud();
    let mut cuts = Cuts::new(&settings(&cloud));
    let mut random = Random::new(4);
    let stroke = cuts.start(&blade(0.5, 0.3)).unwrap();
    for _ in 0..1000 {
        let tremor = random.vector(0.3 * 0.05 * cloud.radius);
        let points: Vec<DVec3> = blade(0.5, 0.3).iter().map(|&p| p + tremor).collect();
        assert_eq!(cuts.append(stroke, &points).unwrap(), 0..0);
    }
}

#[test]
fn a_thousand_tiny_pieces_cut_as_one_large_triangle_does() {
    let cloud = cloud();
    let mut fine = Cuts::new(&CutSettings {
        weld_tolerance: 0.0,
        influence_radius: cloud.radius,
    });
    let stroke = fine.start(&blade(0.503, -0.3)).unwrap();
    let mut grown = cloud.factors();
    for k in 1..=500 {
        let new = fine
            .append(stroke, &blade(0.503, -0.3 + 3.2e-3 * f64::from(k)))
            .unwrap();
        grown.update(&cloud.graph(), &fine, new, &inside);
    }
    assert_eq!(fine.triangle_count(), 1000);
    let mut huge = Cuts::new(&settings(&cloud));
    let far = [
        DVec3::new(-1e5, 0.503, -1e5),
        DVec3::new(1e5, 0.503, -1e5),
        DVec3::new(0.0, 0.503, 1e5),
    ];
    huge.add_surface(&far, &[[0, 1, 2]]).unwrap();
    let once = factors(&cloud, &huge);
    assert_eq!(grown.to_vec(), once);
    assert_eq!(cloud.piece_sizes(&once).len(), 2);
}

#[test]
fn dice_leave_no_pair_between_cubes() {
    let cloud = cloud();
    let mut strokes = Vec::new();
    for c in [0.27, 0.503, 0.73] {
        for axis in 0..3 {
            let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
            let at = |a: f64, b: f64| c * DVec3::AXES[axis] + a * u + b * v;
            let blade = |a: f64| vec![at(a, -0.2), at(a, 1.2)];
            strokes.push([-0.2, 1.2].map(blade).to_vec());
        }
    }
    let cuts = cut(&strokes, &settings(&cloud));
    let found = factors(&cloud, &cuts);
    let cube = |p: DVec3| {
        p.to_array()
            .map(|v| [0.27, 0.503, 0.73].iter().filter(|c| v > **c).count())
    };
    for (pair, &(i, j)) in cloud.pairs().iter().enumerate() {
        let same = cube(cloud.x[i]) == cube(cloud.x[j]);
        assert_eq!(found[pair], if same { 1.0 } else { 0.0 });
    }
}

/// From either node of a pair the path is the same.
#[test]
fn factors_do_not_depend_on_the_order_of_nodes() {
    for (name, strokes, _) in space() {
        let cloud = body(&name);
        let cuts = cut(&strokes, &space_cases::settings(&cloud));
        for (i, j) in cloud
            .pairs()
            .into_iter()
            .filter(|(i, j)| i < j && (i + j) % 3 == 0)
        {
            let factor = |i: usize, j: usize| {
                Rule::Diffraction.factor(&cuts, cloud.x[i], cloud.x[j], cloud.radius, &inside)
            };
            let [one, other] = [factor(i, j), factor(j, i)];
            assert_eq!(one.to_bits(), other.to_bits(), "{name}: {i} {j}");
        }
    }
}

#[test]
fn cut_through_an_edge_and_a_vertex_of_the_node_lattice() {
    // Nodes on a lattice of whole numbers; the plane x + y = 8 runs through nodes, pair middles and
    // along pairs. No pair between x + y < 8 and x + y > 8 survives, every node has one side.
    let x: Vec<DVec3> = testkit::cloud::lattice([9, 9, 5], 1.0, 0.0, 1);
    let cloud = Cloud::joined(x, 2.3);
    let blade = |x: f64| [-2.0, 2.0, 7.0].map(|z| DVec3::new(x, 8.0 - x, z));
    // Triangles with corners on nodes and edges along pairs.
    let stroke = [-3.0, 0.0, 2.0, 3.0, 4.5, 8.0, 12.0].map(|x| blade(x).to_vec());
    let cuts = cut(&vec![stroke.to_vec()], &CutSettings::for_spacing(1.0));
    let everywhere = |_: DVec3| true;
    let mut factors = cloud.factors();
    factors.update(&cloud.graph(), &cuts, 0..cuts.triangle_count(), &everywhere);
    let factors = factors.to_vec();
    // Tie rule: nodes on the plane belong to the side of larger x, that of x + y > 8.
    let upper = |p: DVec3| p.x + p.y >= 8.0;
    for (pair, &(i, j)) in cloud.pairs().iter().enumerate() {
        let same = upper(cloud.x[i]) == upper(cloud.x[j]);
        assert_eq!(factors[pair], if same { 1.0 } else { 0.0 }, "{i} {j}");
    }
    let (_, distance) = cuts.nearest(DVec3::new(4.0, 4.0, 1.0), 1.0).unwrap();
    assert!(distance < 1e-12);
}

#[test]
fn threads_do_not_change_a_bit() {
    let cloud = cloud();
    let cuts = cut(&bent(), &settings(&cloud));
    let on = |threads| testkit::on_threads(threads, || factors(&cloud, &cuts));
    assert_eq!(on(4), on(1));
}

/// A random strip that wanders through the unit cube.
fn strip() -> impl Strategy<Value = Vec<Vec<DVec3>>> {
    let blade = (vector(0.6), vector(0.5)).prop_map(|(at, arm)| {
        let at = at + DVec3::splat(0.5);
        vec![at - arm, at + arm]
    });
    proptest::collection::vec(blade, 2..6)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_strips_keep_the_promises(strip in strip(), seed in 0_u64..1000) {
        let x: Vec<DVec3> = testkit::cloud::uniform(250, 0.5, seed)
            .into_iter().map(|p| p + DVec3::splat(0.5)).collect();
        let cloud = Cloud::joined(x, 0.3);
        let cuts = cut(&vec![strip], &CutSettings { weld_tolerance: 1e-9, influence_radius: 0.2 });
        let found = factors(&cloud, &cuts);
        let graph = cloud.graph();
        for (pair, &(i, j)) in cloud.pairs().iter().enumerate() {
            let f = found[pair];
            let (a, b) = (cloud.x[i], cloud.x[j]);
            prop_assert!((0.0..=1.0).contains(&f));
            let crossed = (0..cuts.triangle_count()).any(|t| super::slow::cross3(a, b, cuts.triangle(t)));
            prop_assert_eq!(crossed, f < 1.0);
            let back = graph.pair(j as u32, i as u32);
            prop_assert_eq!(found[back].to_bits(), f.to_bits());
        }
    }

    #[test]
    fn factors_do_not_depend_on_place_direction_and_size(
        turn in testkit::strategies::rotation(), shift in vector(3.0), scale in testkit::strategies::scale()
    ) {
        let cloud = cloud();
        let strokes = bent();
        let reference = factors(&cloud, &cut(&strokes, &settings(&cloud)));
        let place = |p: DVec3| scale * (turn * p + shift);
        let back = |p: DVec3| turn.inverse() * (p / scale - shift);
        let moved: Vec<DVec3> = cloud.x.iter().map(|&p| place(p)).collect();
        let moved_strokes: Vec<Vec<Vec<DVec3>>> = strokes.iter()
            .map(|s| s.iter().map(|b| b.iter().map(|&p| place(p)).collect()).collect()).collect();
        let cuts = cut(&moved_strokes, &CutSettings {
            weld_tolerance: 0.05 * cloud.radius * scale, influence_radius: cloud.radius * scale });
        let graph = Graph::new(&moved, cloud.graph().offsets(), cloud.graph().indices()).unwrap();
        let mut found = PairFactors::new(&graph, &FactorSettings {
            influence_radius: InfluenceRadius::Length(cloud.radius * scale),
            ..FactorSettings::default()
        });
        found.update(&graph, &cuts, 0..cuts.triangle_count(), &|p| inside(back(p)));
        for (pair, (a, b)) in reference.iter().zip(&found.to_vec()).enumerate() {
            prop_assert!((a - b).abs() < 1e-9, "pair {}: {} and {}", pair, a, b);
        }
    }
}
