use super::*;
use crate::deformation::{deformation_gradient, gradient_sum};
use crate::search::within_radius;
use crate::weights::inverse_square_weights;
use glam::DQuat;
use testkit::kuhn::{Block, kuhn_block as block};
use testkit::tol::{assert_below, assert_within};

fn graph(block: &Block) -> Neighborhoods {
    Neighborhoods::from_graph(block.offsets.clone(), block.indices.clone()).unwrap()
}

fn build(block: &Block) -> (Neighborhoods, ConservativeStencils) {
    build_with(block, &ConservativeSettings::default())
}

fn build_with(
    block: &Block,
    settings: &ConservativeSettings,
) -> (Neighborhoods, ConservativeStencils) {
    let graph = graph(block);
    let weights = inverse_square_weights(&block.positions, &graph);
    let stencils = ConservativeStencils::new(
        &block.positions,
        &block.volumes,
        &block.boundary_vectors,
        &graph,
        weights,
        settings,
    )
    .unwrap();
    (graph, stencils)
}

/// Largest entry of `Σ_j X_ij g_ijᵀ − I` over the nodes of rank 3.
fn consistency(positions: &[DVec3], graph: &Neighborhoods, s: &ConservativeStencils) -> f64 {
    let mut worst = 0.0_f64;
    for i in 0..positions.len() {
        if s.ranks[i].rank == 3 {
            let sum = gradient_sum(
                positions,
                i,
                graph.row(i),
                &s.pair_gradients[graph.pairs(i)],
            );
            for x in (sum - DMat3::IDENTITY).to_cols_array() {
                worst = worst.max(x.abs());
            }
        }
    }
    worst
}

/// `max_j |Σ_i V_i g_ij − b_j| / max |b|` by the plain double loop.
fn conservation(graph: &Neighborhoods, s: &ConservativeStencils, b: &[DVec3]) -> f64 {
    let mut sums = vec![DVec3::ZERO; b.len()];
    for i in 0..b.len() {
        let mut own = DVec3::ZERO;
        for pair in graph.pairs(i) {
            let g = s.pair_gradients[pair];
            sums[graph.indices()[pair] as usize] += g * s.volumes[i];
            own -= g;
        }
        sums[i] += own * s.volumes[i];
    }
    let scale = b.iter().fold(0.0_f64, |m, b| m.max(b.length()));
    sums.iter()
        .zip(b)
        .fold(0.0_f64, |m, (c, b)| m.max((*c - *b).length()))
        / scale
}

#[test]
fn conservative_and_consistent_at_every_scale() {
    for (jitter, scale) in [(0.0, 1.0), (0.25, 1.0), (0.25, 1e-6), (0.25, 1e6)] {
        let mut block = block([8, 6, 5], 0.1 * scale, jitter, 4);
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 0.5).normalize(), 0.7);
        for x in &mut block.positions {
            *x = turn * *x + DVec3::new(3.0, -2.0, 1.0) * scale;
        }
        for b in &mut block.boundary_vectors {
            *b = turn * *b;
        }
        let (graph, stencils) = build(&block);
        assert!(stencils.report.converged, "{:?}", stencils.report);
        assert_below("shift of b", stencils.report.boundary_shift, 1e-13);
        assert_below(
            "conservation",
            conservation(&graph, &stencils, &block.boundary_vectors),
            1e-10,
        );
        assert_below(
            "consistency",
            consistency(&block.positions, &graph, &stencils),
            1e-12,
        );
        let reported = stencils.conservation_error(&graph)
            / block
                .boundary_vectors
                .iter()
                .fold(0.0_f64, |m, b| m.max(b.length()));
        let direct = conservation(&graph, &stencils, &stencils.boundary_vectors);
        assert_within("gather and scatter agree", reported, direct, 1e-13);
    }
}

/// The corrected stencil is the minimiser: any admissible change is orthogonal to `(g − g0)/w`.
#[test]
fn correction_has_the_form_of_the_minimiser() {
    let block = block([4, 4, 4], 1.0, 0.2, 9);
    let (graph, s) = build(&block);
    for i in 0..block.positions.len() {
        let mu = &s.multipliers;
        let mut h = DMat3::ZERO;
        for pair in graph.pairs(i) {
            let k = graph.indices()[pair] as usize;
            let x = block.positions[k] - block.positions[i];
            h += outer(mu[k] - mu[i], s.moment_inverses[i] * x * s.weights[pair]);
        }
        for pair in graph.pairs(i) {
            let j = graph.indices()[pair] as usize;
            let x = block.positions[j] - block.positions[i];
            let w = s.weights[pair];
            let g0 = s.moment_inverses[i] * x * w;
            let e = mu[j] - mu[i] - h * x;
            let difference = (s.pair_gradients[pair] - g0 - e * (s.volumes[i] * w)).length();
            assert_below("form of g", difference, 1e-13);
        }
    }
}

#[test]
fn any_symmetric_neighbourhood_will_do() {
    let block = block([6, 6, 6], 1.0, 0.2, 2);
    let graph = within_radius(&block.positions, 1.8).unwrap();
    let radii = vec![2.2; block.positions.len()];
    let weights =
        crate::kernel_weights(crate::Kernel::Polynomial, &block.positions, &radii, &graph);
    let settings = ConservativeSettings::default();
    let s = ConservativeStencils::new(
        &block.positions,
        &block.volumes,
        &block.boundary_vectors,
        &graph,
        weights,
        &settings,
    )
    .unwrap();
    assert!(s.report.converged, "{:?}", s.report);
    assert_below(
        "conservation",
        conservation(&graph, &s, &block.boundary_vectors),
        1e-10,
    );
    assert_below(
        "consistency",
        consistency(&block.positions, &graph, &s),
        1e-12,
    );
}

/// Factors of a planar cut at `x = at` that has reached `y = front`.
fn planar_cut(block: &Block, graph: &Neighborhoods, at: f64, front: f64) -> (Vec<f64>, Vec<u32>) {
    let mut factors = vec![1.0; graph.pair_count()];
    let mut touched = Vec::new();
    for i in 0..block.positions.len() {
        for pair in graph.pairs(i) {
            let (a, b) = (
                block.positions[i],
                block.positions[graph.indices()[pair] as usize],
            );
            let crosses = (a.x < at) != (b.x < at);
            let share = (at - a.x) / (b.x - a.x);
            if crosses && a.y + share * (b.y - a.y) < front {
                factors[pair] = 0.0;
                touched.push(u32::try_from(i).unwrap());
            }
        }
    }
    touched.dedup();
    (factors, touched)
}

#[test]
fn touched_rows_equal_a_full_rebuild_with_the_old_multipliers() {
    let block = block([8, 8, 6], 1.0, 0.2, 6);
    let (graph, before) = build(&block);
    let mut s = before.clone();
    let (factors, touched) = planar_cut(&block, &graph, 4.4, 5.1);
    s.update_rows(&block.positions, &graph, |pair| factors[pair], &touched)
        .unwrap();
    let mut full = before.clone();
    for (w, f) in full.weights.iter_mut().zip(&factors) {
        *w *= f;
    }
    full.rebuild_all(&block.positions, &graph);
    assert_eq!(s, full);
    // Rows that the cut does not reach keep their bits; severed pairs are gone.
    for i in 0..block.positions.len() {
        for pair in graph.pairs(i) {
            if touched.binary_search(&u32::try_from(i).unwrap()).is_err() {
                assert_eq!(s.pair_gradients[pair], before.pair_gradients[pair]);
            } else if factors[pair] == 0.0 {
                assert_eq!(s.pair_gradients[pair], DVec3::ZERO);
            }
        }
    }
    assert_below(
        "consistency",
        consistency(&block.positions, &graph, &s),
        1e-11,
    );
    // Factors of 1 everywhere give the uncut rows back.
    s.update_rows(&block.positions, &graph, |_| 1.0, &touched)
        .unwrap();
    assert_eq!(s, before);
}

/// Net force of a uniform uniaxial stress along y, parallel to the cut, at every node:
/// `Σ_i V_i σ g_ij − σ b0_j` with the boundary vectors of the uncut body.
fn parallel_stress_error(s: &ConservativeStencils, graph: &Neighborhoods, b0: &[DVec3]) -> f64 {
    let mut sums: Vec<f64> = b0.iter().map(|b| -b.y).collect();
    for i in 0..b0.len() {
        sums[i] += s.self_gradients[i].y * s.volumes[i];
        for pair in graph.pairs(i) {
            sums[graph.indices()[pair] as usize] += s.pair_gradients[pair].y * s.volumes[i];
        }
    }
    sums.iter().fold(0.0_f64, |m, c| m.max(c.abs()))
}

/// Some nodes and their neighbours.
fn with_ring(graph: &Neighborhoods, nodes: &[u32]) -> Vec<u32> {
    let mut near = nodes.to_vec();
    for &node in nodes {
        near.extend_from_slice(graph.row(node as usize));
    }
    near.sort_unstable();
    near.dedup();
    near
}

#[test]
fn finished_stroke_is_exact_for_stress_parallel_to_the_cut() {
    let block = block([8, 8, 6], 1.0, 0.2, 6);
    let (graph, mut s) = build(&block);
    let (factors, touched) = planar_cut(&block, &graph, 4.4, 4.1);
    s.update_rows(&block.positions, &graph, |pair| factors[pair], &touched)
        .unwrap();
    let kept = parallel_stress_error(&s, &graph, &block.boundary_vectors);
    let near = with_ring(&graph, &touched);
    let projectors = vec![normal_projector(&[DVec3::X]); near.len()];
    let report = s.finish_stroke(&block.positions, &graph, &near, &projectors);
    assert!(
        report.accepted && report.solve.converged && report.moved > touched.len() / 2,
        "{report:?}"
    );
    assert!(report.stiffening < 1.15, "{report:?}");
    let finished = parallel_stress_error(&s, &graph, &block.boundary_vectors);
    assert!(
        kept > 1e-3,
        "without the projection the error is visible: {kept:e}"
    );
    assert_below("parallel stress", finished, 1e-10);
    assert_below(
        "consistency",
        consistency(&block.positions, &graph, &s),
        1e-11,
    );
    // New area vectors appear on both sides of the cut, along its normal only.
    let across: f64 = s
        .boundary_vectors
        .iter()
        .zip(&block.boundary_vectors)
        .map(|(a, b)| (*a - *b).x.abs())
        .sum();
    assert!(
        across > 0.5 * 2.0 * 4.1 * 6.0,
        "two faces of about 24 m² each: {across}"
    );
}

#[test]
fn severed_pieces_each_stay_conservative() {
    let block = block([8, 5, 5], 1.0, 0.2, 3);
    let (graph, mut s) = build(&block);
    let (factors, touched) = planar_cut(&block, &graph, 4.4, f64::INFINITY);
    s.update_rows(&block.positions, &graph, |pair| factors[pair], &touched)
        .unwrap();
    let near = with_ring(&graph, &touched);
    let projectors = vec![normal_projector(&[DVec3::X]); near.len()];
    let report = s.finish_stroke(&block.positions, &graph, &near, &projectors);
    assert!(report.accepted && report.solve.converged, "{report:?}");
    for side in [false, true] {
        let sum: DVec3 = (0..block.positions.len())
            .filter(|&i| (block.positions[i].x < 4.4) == side)
            .map(|i| s.boundary_vectors[i])
            .sum();
        assert_below("closed piece", sum.length(), 1e-10);
    }
    // Small debris is left alone.
    let settings = ConservativeSettings {
        smallest_piece: 10_000,
        ..Default::default()
    };
    let mut kept = ConservativeStencils {
        settings,
        ..build(&block).1
    };
    kept.update_rows(&block.positions, &graph, |pair| factors[pair], &touched)
        .unwrap();
    let before = kept.pair_gradients.clone();
    kept.finish_stroke(&block.positions, &graph, &near, &projectors);
    assert_eq!(kept.pair_gradients, before);
}

/// Without their ring the crossed nodes alone must carry what irregular volumes leave over: the
/// constraint can be met, but only by rows far stiffer than any before. The update's rows stay.
#[test]
fn a_finish_that_would_stiffen_the_body_is_not_taken() {
    let block = block([8, 5, 5], 1.0, 0.2, 3);
    let (graph, mut s) = build(&block);
    let (factors, touched) = planar_cut(&block, &graph, 4.4, f64::INFINITY);
    s.update_rows(&block.positions, &graph, |pair| factors[pair], &touched)
        .unwrap();
    let kept = s.clone();
    let projectors = vec![normal_projector(&[DVec3::X]); touched.len()];
    let report = s.finish_stroke(&block.positions, &graph, &touched, &projectors);
    assert!(report.solve.converged && !report.accepted, "{report:?}");
    assert!(report.stiffening > 10.0, "{report:?}");
    assert_eq!(s, kept);
    // Nor is one whose solve stops short.
    let short = ConservativeSettings {
        iteration_limit: 3,
        ..Default::default()
    };
    let mut s = ConservativeStencils {
        settings: short,
        ..kept.clone()
    };
    let near = with_ring(&graph, &touched);
    let projectors = vec![normal_projector(&[DVec3::X]); near.len()];
    let report = s.finish_stroke(&block.positions, &graph, &near, &projectors);
    assert!(!report.solve.converged && !report.accepted, "{report:?}");
    assert_eq!(s.pair_gradients, kept.pair_gradients);
    assert_eq!(s.multipliers, kept.multipliers);
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

/// Stencils of a few points that all see each other.
fn star(positions: &[DVec3]) -> (Neighborhoods, ConservativeStencils) {
    let n = positions.len();
    let mut offsets = vec![0];
    let mut indices = Vec::new();
    for i in 0..n {
        indices.extend(
            (0..n)
                .filter(|&j| j != i)
                .map(|j| u32::try_from(j).unwrap()),
        );
        offsets.push(u32::try_from(indices.len()).unwrap());
    }
    let graph = Neighborhoods::from_graph(offsets, indices).unwrap();
    let weights = inverse_square_weights(positions, &graph);
    let s = ConservativeStencils::new(
        positions,
        &vec![1.0; n],
        &vec![DVec3::ZERO; n],
        &graph,
        weights,
        &ConservativeSettings::default(),
    )
    .unwrap();
    (graph, s)
}

#[test]
fn degenerate_clouds_have_a_rank_and_feel_no_rotation() {
    let tilt = DQuat::from_axis_angle(DVec3::new(0.3, 1.0, -0.2).normalize(), 0.9);
    let plane: Vec<DVec3> = [(0.0, 0.0), (1.0, 0.1), (0.2, 1.0), (-0.9, 0.3), (0.1, -1.1)]
        .iter()
        .map(|&(x, y)| tilt * DVec3::new(x, y, 0.0))
        .collect();
    let line: Vec<DVec3> = [0.0, 1.0, 2.5]
        .iter()
        .map(|&t| tilt * DVec3::X * t)
        .collect();
    let cases = [
        (plane, 2_u8),
        (line, 1),
        (vec![DVec3::ZERO, DVec3::Y], 1),
        (vec![DVec3::ONE], 0),
        (vec![DVec3::ONE, DVec3::ONE, DVec3::ONE], 0),
    ];
    for (points, rank) in cases {
        let (graph, s) = star(&points);
        for i in 0..points.len() {
            assert_eq!(s.ranks[i].rank, rank);
            assert!(
                s.ranks[i].condition > 1e12,
                "condition {}",
                s.ranks[i].condition
            );
            let pairs = graph.pairs(i);
            assert!(
                s.pair_gradients[pairs.clone()]
                    .iter()
                    .all(|g| g.is_finite())
            );
            for angle in [0.0, 0.5, 1.6, 3.1] {
                let turn = DQuat::from_axis_angle(DVec3::new(0.5, -0.4, 1.0).normalize(), angle);
                let moved: Vec<DVec3> = points.iter().map(|&x| turn * x + DVec3::ONE).collect();
                let sum = gradient_sum(&moved, i, graph.row(i), &s.pair_gradients[pairs.clone()]);
                let f = deformation_gradient(sum, &s.ranks[i]);
                let strain = f.transpose() * f - DMat3::IDENTITY;
                let size = strain
                    .to_cols_array()
                    .iter()
                    .fold(0.0_f64, |m, x| m.max(x.abs()));
                assert_below("strain of a rotation", size, 1e-14);
                assert!(f.determinant() > 0.0, "no mirror image");
            }
        }
    }
}

#[test]
fn a_stretched_plane_shows_its_strain() {
    let points =
        [(0.0, 0.0), (1.0, 0.1), (0.2, 1.0), (-0.9, 0.3)].map(|(x, y)| DVec3::new(x, y, 0.0));
    let (graph, s) = star(&points);
    let moved = points.map(|x| DVec3::new(1.5 * x.x, x.y, 0.2 * x.x));
    let sum = gradient_sum(&moved, 0, graph.row(0), &s.pair_gradients[graph.pairs(0)]);
    let f = deformation_gradient(sum, &s.ranks[0]);
    assert_within(
        "along x",
        (f.transpose() * f).x_axis.x,
        1.5 * 1.5 + 0.04,
        1e-13,
    );
    assert_within("thickness", (f * DVec3::Z).length(), 1.0, 1e-14);
}

#[test]
fn bad_input_is_named() {
    let block = block([2, 2, 2], 1.0, 0.0, 1);
    let graph = graph(&block);
    let weights = inverse_square_weights(&block.positions, &graph);
    let settings = ConservativeSettings::default();
    let try_with = |edit: &dyn Fn(&mut Block, &mut Vec<f64>)| {
        let (mut b, mut w) = (block.clone(), weights.clone());
        edit(&mut b, &mut w);
        ConservativeStencils::new(
            &b.positions,
            &b.volumes,
            &b.boundary_vectors,
            &graph,
            w,
            &settings,
        )
        .unwrap_err()
    };
    let nan = f64::NAN;
    assert_eq!(
        try_with(&|b, _| b.positions[3].x = nan),
        StencilError::Position { node: 3 }
    );
    assert_eq!(
        try_with(&|b, _| b.volumes[2] = 0.0),
        StencilError::Volume {
            node: 2,
            value: 0.0
        }
    );
    assert_eq!(
        try_with(&|b, _| b.boundary_vectors[1].z = f64::INFINITY),
        StencilError::BoundaryVector { node: 1 }
    );
    assert_eq!(
        try_with(&|_, w| w[7] = -1.0),
        StencilError::Weight {
            pair: 7,
            value: -1.0
        }
    );
    let lopsided = Neighborhoods::from_graph(vec![0, 1, 1], vec![1]).unwrap();
    let made = ConservativeStencils::new(
        &[DVec3::ZERO, DVec3::X],
        &[1.0; 2],
        &[DVec3::ZERO; 2],
        &lopsided,
        vec![1.0],
        &settings,
    );
    assert!(matches!(made, Err(StencilError::Graph(_))));
    let (_, mut s) = build(&block);
    let mut factors = vec![1.0; graph.pair_count()];
    factors[0] = nan;
    assert!(matches!(
        s.update_rows(&block.positions, &graph, |pair| factors[pair], &[0]),
        Err(StencilError::Weight { pair: 0, .. })
    ));
}

/// The block `[0, 1]³` with coordinates pushed towards the corner, cells 3 times smaller there.
fn graded(cells: usize) -> Block {
    let spacing = 1.0 / cells as f64;
    let plain = block([cells; 3], spacing, 0.2, 5);
    let push = |s: f64| 0.35 * s + 0.65 * s * s * s;
    let positions = plain
        .positions
        .iter()
        .map(|x| DVec3::new(push(x.x), push(x.y), push(x.z)))
        .collect();
    testkit::kuhn::from_tetrahedra(positions, plain.tetrahedra)
}

/// A lobed, bent body without a flat face.
fn organ(cells: [usize; 3]) -> Block {
    let plain = block(cells, 1.0, 0.2, 5);
    let size = DVec3::new(cells[0] as f64, cells[1] as f64, cells[2] as f64);
    let bend = |x: DVec3| {
        let s = x / size * 2.0 - 1.0;
        // The cube to a ball, the ball to a bean.
        let q = s * s;
        let ball = s * DVec3::new(
            (1.0 - q.y / 2.0 - q.z / 2.0 + q.y * q.z / 3.0).sqrt(),
            (1.0 - q.z / 2.0 - q.x / 2.0 + q.z * q.x / 3.0).sqrt(),
            (1.0 - q.x / 2.0 - q.y / 2.0 + q.x * q.y / 3.0).sqrt(),
        );
        DVec3::new(
            1.6 * ball.x,
            0.8 * ball.y + 0.5 * ball.x * ball.x,
            0.6 * ball.z,
        )
    };
    let positions = plain.positions.iter().map(|&x| bend(x)).collect();
    testkit::kuhn::from_tetrahedra(positions, plain.tetrahedra)
}

#[test]
fn graded_and_curved_clouds_are_conservative_too() {
    for block in [graded(10), organ([14, 10, 9])] {
        assert!(
            block.volumes.iter().all(|&v| v > 0.0),
            "no cell is turned over"
        );
        let (graph, s) = build(&block);
        assert!(s.report.converged, "{:?}", s.report);
        assert_below(
            "conservation",
            conservation(&graph, &s, &block.boundary_vectors),
            1e-10,
        );
        assert_below(
            "consistency",
            consistency(&block.positions, &graph, &s),
            1e-12,
        );
    }
}

#[test]
fn coarse_space_changes_the_iterations_and_not_the_stencils() {
    for block in [block([12; 3], 1.0, 0.2, 3), graded(12), organ([14, 11, 9])] {
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
    let block = organ([24; 3]);
    let (_, s) = build(&block);
    assert!(
        s.ranks.iter().filter(|r| r.rank < 3).count() > 20,
        "the case is a hard one"
    );
    assert!(
        !s.report.converged && s.report.residual < 1.0,
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

/// A body diced by planes, with slivers: whatever the solve achieves, nothing explodes.
#[test]
fn diced_bodies_stay_finite() {
    let block = block([10, 10, 10], 1.0, 0.2, 7);
    let (graph, mut s) = build(&block);
    let mut factors = vec![1.0; graph.pair_count()];
    let cell =
        |x: DVec3| [x.x, x.y, x.z].map(|c| (c > 2.6) as u8 + (c > 3.1) as u8 + (c > 6.2) as u8);
    let mut touched = Vec::new();
    for i in 0..block.positions.len() {
        for pair in graph.pairs(i) {
            let j = graph.indices()[pair] as usize;
            if cell(block.positions[i]) != cell(block.positions[j]) {
                factors[pair] = 0.0;
                touched.push(u32::try_from(i).unwrap());
            }
        }
    }
    touched.dedup();
    s.update_rows(&block.positions, &graph, |pair| factors[pair], &touched)
        .unwrap();
    assert!(s.ranks.iter().any(|r| r.rank < 3), "slivers lose rank");
    let projectors = vec![DMat3::IDENTITY; touched.len()];
    let report = s.finish_stroke(&block.positions, &graph, &touched, &projectors);
    assert!(report.solve.residual.is_finite(), "{report:?}");
    assert!(!report.accepted || report.stiffening <= 2.0, "{report:?}");
    let all = s
        .pair_gradients
        .iter()
        .chain(&s.self_gradients)
        .chain(&s.multipliers);
    assert!(all.into_iter().all(|g| g.is_finite()));
    assert_below(
        "consistency",
        consistency(&block.positions, &graph, &s),
        1e-9,
    );
}

#[test]
fn memory_is_what_is_stated() {
    let block = block([9, 9, 9], 1.0, 0.2, 8);
    let (graph, s) = build(&block);
    let memory = s.memory_bytes();
    assert_eq!((memory.per_node, memory.per_pair), (192, 44));
    let stated = 192 * block.positions.len() + 44 * graph.pair_count();
    assert!(
        memory.total >= stated && memory.total <= stated + stated / 50,
        "{memory:?}"
    );
}
