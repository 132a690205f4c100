use super::*;
use crate::deformation::gradient_sum;
use crate::kernel::Kernel;
use crate::search::{NearestSettings, k_nearest};
use crate::weights::kernel_weights;
use proptest::prelude::*;
use testkit::cloud;
use testkit::strategies::{rotation, scale, vector};

fn build(points: &[DVec3]) -> (Neighborhoods, GradientStencils) {
    let found = k_nearest(points, &NearestSettings::default()).unwrap();
    let graph = found.neighborhoods;
    let weights = kernel_weights(Kernel::Polynomial, points, &found.support_radii, &graph);
    let stencils = GradientStencils::new(points, &graph, weights, 1e-3).unwrap();
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
        let gradient = DMat3::from_cols(row.0, row.1, row.2);
        for i in 0..points.len() {
            if s.ranks[i].rank < 3 {
                continue;
            }
            let moved: Vec<DVec3> = points.iter().map(|&x| gradient * x).collect();
            let found = gradient_sum(&moved, i, graph.row(i), &s.pair_gradients[graph.pairs(i)]);
            let error = (found - gradient).to_cols_array().iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            // Round-off of the products `gradient · x` grows with |x| over the spacing.
            let allowed = 1e-12_f64.max(40.0 * s.ranks[i].condition * f64::EPSILON);
            prop_assert!(error <= allowed, "node {i}: {error:e}, condition {:.1}", s.ranks[i].condition);
        }
    }
}

#[test]
fn equals_the_normal_equations_solved_directly() {
    let points = cloud::lattice([6, 6, 6], 0.1, 0.25, 8);
    let (graph, s) = build(&points);
    let field = |x: DVec3| (4.0 * x.x).sin() + x.y * x.z;
    for i in 0..points.len() {
        // Equation (26): A ∇u = Σ (u_j − u_i) X_ij w.
        let (mut a, mut rhs, mut by_stencil) = (DMat3::ZERO, DVec3::ZERO, DVec3::ZERO);
        for pair in graph.pairs(i) {
            let j = graph.indices()[pair] as usize;
            let x = points[j] - points[i];
            let du = field(points[j]) - field(points[i]);
            a += outer(x, x) * s.weights[pair];
            rhs += x * (du * s.weights[pair]);
            by_stencil += s.pair_gradients[pair] * du;
        }
        assert!(
            (a.inverse() * rhs - by_stencil).length() < 1e-10,
            "node {i}"
        );
    }
}

#[test]
fn touched_rows_equal_a_full_build() {
    let points = cloud::lattice([8, 8, 8], 1.0, 0.2, 5);
    let (graph, mut s) = build(&points);
    let mut random = cloud::Random::new(3);
    let factors: Vec<f64> = (0..graph.pair_count())
        .map(|p| if p < 500 { random.unit() } else { 1.0 })
        .collect();
    let touched: Vec<u32> = (0..60).collect();
    let last = graph.pairs(59).end;
    let factors: Vec<f64> = factors
        .iter()
        .enumerate()
        .map(|(p, &f)| if p < last { f } else { 1.0 })
        .collect();
    let weights = s.weights.iter().zip(&factors).map(|(w, f)| w * f).collect();
    let full = GradientStencils::new(&points, &graph, weights, 1e-3).unwrap();
    s.update_rows(&points, &graph, |pair| factors[pair], &touched)
        .unwrap();
    assert_eq!(s.pair_gradients, full.pair_gradients);
    assert_eq!(s.self_gradients, full.self_gradients);
    assert_eq!(s.ranks, full.ranks);
    assert_eq!(s.moment_inverses, full.moment_inverses);
}

#[test]
fn one_thread_and_many_give_the_same_bits() {
    let points = cloud::uniform(3000, 1.0, 4);
    let many = build(&points);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    assert_eq!(pool.install(|| build(&points)), many);
}

#[test]
fn bad_input_is_named() {
    let mut points = cloud::uniform(30, 1.0, 4);
    let (graph, s) = build(&points);
    let mut weights = s.weights.clone();
    weights[3] = f64::INFINITY;
    assert!(matches!(
        GradientStencils::new(&points, &graph, weights, 1e-3),
        Err(StencilError::Weight { pair: 3, .. })
    ));
    points[7].z = f64::NAN;
    assert_eq!(
        GradientStencils::new(&points, &graph, s.weights, 1e-3),
        Err(StencilError::Position { node: 7 })
    );
}

#[test]
fn memory_is_what_is_stated() {
    let points = cloud::uniform(2000, 1.0, 4);
    let (graph, s) = build(&points);
    let memory = s.memory_bytes();
    assert_eq!((memory.per_node, memory.per_pair), (136, 40));
    let stated = 136 * points.len() + 40 * graph.pair_count();
    assert!(
        memory.total >= stated && memory.total <= stated + stated / 50,
        "{memory:?}"
    );
}
