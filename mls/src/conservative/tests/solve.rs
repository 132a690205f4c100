use super::*;
use testkit::kuhn::{graded, organ};
use testkit::tol::assert_below;

#[test]
fn graded_and_curved_clouds_are_conservative_too() {
    for block in [graded(10, 5), organ([14, 10, 9], 5)] {
        assert!(
            block.volumes.iter().all(|&v| v > 0.0),
            "no cell is turned over"
        );
        let (graph, s) = build(&block);
        assert!(s.report.converged, "{:?}", s.report);
        is_exact(&block, &graph, &s);
    }
}

#[test]
fn coarse_space_changes_the_iterations_and_not_the_stencils() {
    for block in [
        block([12; 3], 1.0, 0.2, 3),
        graded(12, 5),
        organ([14, 11, 9], 5),
    ] {
        let (_, fast) = build(&block);
        let plain = ConservativeSettings {
            coarse_space: false,
            ..Default::default()
        };
        let (_, slow) = build_with(&block, &plain);
        assert!(
            fast.report.converged && slow.report.converged,
            "{:?}",
            slow.report
        );
        let size = fast
            .pair_gradients
            .iter()
            .fold(0.0_f64, |m, g| m.max(g.length()));
        for (a, b) in fast.pair_gradients.iter().zip(&slow.pair_gradients) {
            assert_below("same stencil", (*a - *b).length(), 1e-7 * size);
        }
        let (a, b) = (fast.report.iterations, slow.report.iterations);
        assert!(
            3 * a < b,
            "{a} iterations with the coarse space, {b} without"
        );
    }
}

/// Flat corners of tetrahedra leave nodes whose edges span a plane only; without more neighbours the
/// constraint cannot be met there, and the solve must say so and not explode.
#[test]
fn flat_rows_are_reported_and_widening_cures_them() {
    let block = organ([24; 3], 5);
    let (_, s) = build(&block);
    assert!(
        s.ranks.iter().filter(|r| r.rank < 3).count() > 20,
        "the case is a hard one"
    );
    assert!(
        !s.report.converged && s.report.residual < 1.0 && s.clone().converged().is_err(),
        "{:?}",
        s.report
    );
    let size = s
        .pair_gradients
        .iter()
        .fold(0.0_f64, |m, g| m.max(g.length()));
    assert!(size.is_finite());
    assert_below(
        "consistency",
        consistency(&block.positions, &graph(&block), &s),
        1e-10,
    );
    let (wide, left) = crate::widen_deficient_rows(&block.positions, &graph(&block), 1e-3).unwrap();
    assert!(left.len() < 5, "{} rows still flat", left.len());
    let wide = Block {
        offsets: wide.offsets().to_vec(),
        indices: wide.indices().to_vec(),
        ..block.clone()
    };
    let (graph, s) = build(&wide);
    assert!(s.report.converged, "{:?}", s.report);
    assert_below(
        "conservation",
        conservation(&graph, &s, &s.boundary_vectors),
        1e-10,
    );
    // What the rows still flat cannot carry was moved off the boundary vectors.
    assert_below("shift", s.report.boundary_shift, 1e-5);
}

#[test]
fn one_thread_and_many_give_the_same_bits() {
    let block = block([13, 13, 13], 1.0, 0.2, 8);
    let (_, many) = build(&block);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        assert_eq!(pool.install(|| build(&block).1), many);
    }
}
