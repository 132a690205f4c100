use super::*;
use crate::{NearestSettings, k_nearest, kernel_weights};
use glam::DQuat;
use proptest::prelude::*;
use testkit::assert_matches;
use testkit::cloud;
use testkit::strategies::{rotation, scale, vector};
use testkit::tol::assert_below;

fn build(points: &[DVec3]) -> (Neighborhoods, GradientStencils) {
    let found = k_nearest(points, &NearestSettings::default()).unwrap();
    let graph = found.neighborhoods;
    let weights = kernel_weights(points, &found.support_radii, &graph);
    let stencils = GradientStencils::plain(points, &graph, weights, 1e-3).unwrap();
    (graph, stencils)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn linear_fields_are_exact_at_any_place_scale_and_angle(
        seed in 0_u64..1000, turn in rotation(), size in scale(), shift in vector(5.0),
        row in (vector(1.0), vector(1.0), vector(1.0)),
    ) {
        let points: Vec<DVec3> = cloud::lattice([5, 5, 5], 1.0, 0.3, seed)
            .iter()
            .map(|&x| (turn * x + shift) * size)
            .collect();
        let (graph, s) = build(&points);
        let gradients = s.pair_gradients(&points, &graph);
        let map = DMat3::from_cols(row.0, row.1, row.2);
        for i in (0..points.len()).filter(|&i| s.ranks[i].rank == 3) {
            let mut found = DMat3::ZERO;
            for (pair, &j) in graph.pairs(i).zip(graph.row(i)) {
                found += outer(map * points[j as usize] - map * points[i], gradients[pair]);
            }
            let error = (found - map).to_cols_array().iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            // Round-off of the products `map · x` grows with |x| over the spacing.
            let allowed = 1e-12_f64.max(40.0 * s.ranks[i].condition * f64::EPSILON);
            prop_assert!(error <= allowed, "node {i}: {error:e}, condition {:.1}", s.ranks[i].condition);
        }
    }
}

#[test]
fn equals_the_normal_equations_solved_directly() {
    let points = cloud::lattice([6, 6, 6], 0.1, 0.25, 8);
    let (graph, s) = build(&points);
    let gradients = s.pair_gradients(&points, &graph);
    let field = |x: DVec3| (4.0 * x.x).sin() + x.y * x.z;
    for i in 0..points.len() {
        // Equation (26): A ∇u = Σ (u_j − u_i) X_ij w.
        let (mut a, mut rhs, mut by_stencil) = (DMat3::ZERO, DVec3::ZERO, DVec3::ZERO);
        for (pair, j) in graph.entries(i) {
            let x = points[j] - points[i];
            let du = field(points[j]) - field(points[i]);
            a += outer(x, x) * s.weights[pair];
            rhs += x * (du * s.weights[pair]);
            by_stencil += gradients[pair] * du;
        }
        let error = (a.inverse() * rhs - by_stencil).length();
        assert!(error < 1e-10, "node {i}");
    }
}

#[test]
fn touched_rows_equal_a_full_build() {
    let points = cloud::lattice([8, 8, 8], 1.0, 0.2, 5);
    let (graph, mut s) = build(&points);
    let mut random = cloud::Random::new(3);
    let touched: Vec<u32> = (0..60).collect();
    let last = graph.pairs(59).end;
    let mut factors = vec![1.0; graph.pair_count()];
    factors[..last].fill_with(|| random.unit());
    let weights = s.weights.iter().zip(&factors).map(|(w, f)| w * f).collect();
    let full = GradientStencils::plain(&points, &graph, weights, 1e-3).unwrap();
    s.update_rows(&points, &graph, |pair| factors[pair], &touched)
        .unwrap();
    assert_eq!(s.weights, full.weights);
    assert_eq!(s.matrices, full.matrices);
    assert_eq!(s.ranks, full.ranks);
}

#[test]
fn degenerate_clouds_have_a_rank_and_stencils_in_their_span() {
    let tilt = DQuat::from_axis_angle(DVec3::new(0.3, 1.0, -0.2).normalize(), 0.9);
    let plane = [(0.0, 0.0), (1.0, 0.1), (0.2, 1.0), (-0.9, 0.3), (0.1, -1.1)]
        .map(|(x, y)| tilt * DVec3::new(x, y, 0.0));
    let line = [0.0, 1.0, 2.5].map(|t| tilt * DVec3::X * t);
    let cases = [
        (plane.to_vec(), 2, tilt * DVec3::Z),
        (line.to_vec(), 1, tilt * DVec3::X),
        (vec![DVec3::ZERO, DVec3::Y], 1, DVec3::Y),
        (vec![DVec3::ONE], 0, DVec3::ZERO),
        (vec![DVec3::ONE; 3], 0, DVec3::ZERO),
    ];
    for (points, rank, axis) in cases {
        let n = to_u32(points.len());
        let edges = (0..n).flat_map(|i| (0..i).map(move |j| [i, j]));
        let graph = Neighborhoods::from_edges(points.len(), edges).unwrap();
        let weights = inverse_square_weights(&points, &graph);
        let s = GradientStencils::plain(&points, &graph, weights, 1e-3).unwrap();
        let gradients = s.pair_gradients(&points, &graph);
        let across = outer(axis, axis);
        let span = match rank {
            2 => DMat3::IDENTITY - across,
            _ => across,
        };
        for i in 0..points.len() {
            assert_eq!(s.ranks[i].rank, rank);
            assert!(s.ranks[i].condition > 1e12, "{:?}", s.ranks[i]);
            assert_below("axis", s.ranks[i].axis.cross(axis).length(), 1e-14);
            let mut sum = DMat3::ZERO;
            for (pair, &j) in graph.pairs(i).zip(graph.row(i)) {
                sum += outer(points[j as usize] - points[i], gradients[pair]);
            }
            assert!(sum.abs_diff_eq(span, 1e-14), "{sum} on {span}");
        }
    }
}

#[test]
fn bad_input_is_named() {
    let mut points = cloud::uniform(30, 1.0, 4);
    let (graph, s) = build(&points);
    let mut weights = s.weights.clone();
    weights[3] = f64::INFINITY;
    let made = GradientStencils::plain(&points, &graph, weights, 1e-3);
    assert_matches!(made, Err(StencilError::Weight { pair: 3, .. }));
    let short = GradientStencils::plain(&points[..29], &graph, s.weights.clone(), 1e-3);
    let told = short.unwrap_err().to_string();
    assert_eq!(told, "29 positions given, the graph needs 30");
    points[7].z = f64::NAN;
    let made = GradientStencils::plain(&points, &graph, s.weights, 1e-3);
    assert_eq!(made, Err(StencilError::Position { node: 7 }));
}
