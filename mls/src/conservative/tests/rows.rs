use super::*;
use crate::search::within_radius;
use glam::DQuat;
use testkit::tol::{assert_below, assert_within};

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
        is_exact(&block, &graph, &stencils);
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
    let s = weighted(&block, &graph, weights, &settings).unwrap();
    assert!(s.report.converged, "{:?}", s.report);
    is_exact(&block, &graph, &s);
}

#[test]
fn memory_is_what_is_stated() {
    let block = block([9, 9, 9], 1.0, 0.2, 8);
    let (graph, s) = build(&block);
    let memory = s.memory_bytes();
    assert_eq!((memory.per_node, memory.per_pair), (272, 44));
    let stated = 272 * block.positions.len() + 44 * graph.pair_count();
    assert!(
        memory.total >= stated && memory.total <= stated + stated / 50,
        "{memory:?}"
    );
}

#[test]
fn rows_are_updated_alike_without_pair_gradients() {
    let block = block([5, 5, 5], 1.0, 0.2, 8);
    let (graph, mut kept) = build(&block);
    let mut light = kept.clone();
    light.forget_pair_gradients();
    let saved = kept.memory_bytes().total - light.memory_bytes().total;
    assert!(saved >= 28 * graph.pair_count(), "{saved} bytes");
    let touched: Vec<u32> = (0..20).collect();
    let factor = |pair: usize| [1.0, 0.5, 0.0][pair % 3];
    for stencils in [&mut kept, &mut light] {
        stencils
            .update_rows(&block.positions, &graph, factor, &touched)
            .expect("sound factors");
    }
    assert_eq!(light.matrices, kept.matrices);
    assert_eq!(light.scales, kept.scales);
    assert_eq!(light.weights, kept.weights);
    assert_eq!(light.self_gradients, kept.self_gradients);
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
        weighted(&b, &graph, w, &settings).unwrap_err()
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

/// The factored form is the stencil itself, at set-up, after a cut and where rows lose their rank; its
/// weights survive storage as f32.
#[test]
fn factors_give_the_stencils() {
    let block = block([6, 5, 4], 0.1, 0.25, 4);
    let (graph, mut s) = build(&block);
    let check = |s: &ConservativeStencils| {
        let mut deficient = 0;
        for i in 0..block.positions.len() {
            deficient += usize::from(s.ranks[i].rank < 3);
            for pair in graph.pairs(i) {
                let j = graph.indices()[pair] as usize;
                let x = block.positions[j] - block.positions[i];
                let mu = s.multipliers[j] - s.multipliers[i];
                let g = (s.matrices[i] * x + mu * s.scales[i]) * s.weights[pair];
                let size = s.pair_gradients[pair].length().max(1.0);
                assert_below(
                    "factored",
                    (g - s.pair_gradients[pair]).length(),
                    1e-12 * size,
                );
                #[allow(clippy::cast_possible_truncation, reason = "that is what is tested")]
                let stored = s.weights[pair] as f32;
                assert_eq!(f64::from(stored).to_bits(), s.weights[pair].to_bits());
            }
        }
        deficient
    };
    assert_eq!(check(&s), 0);
    let (mut factors, touched) = planar_cut(&block, &graph, DVec3::X, 0.29, 0.3);
    for (k, factor) in factors.iter_mut().enumerate() {
        *factor = if *factor > 0.5 {
            1.0 / (2.0 + (k % 7) as f64)
        } else {
            0.0
        };
    }
    let nodes: Vec<u32> = (0..u32::try_from(block.positions.len()).unwrap()).collect();
    assert!(!touched.is_empty());
    s.update_rows(&block.positions, &graph, |pair| factors[pair], &nodes)
        .unwrap();
    check(&s);
    // A node that keeps one pair has a row of rank 1.
    let alone = graph.pairs(40);
    let keep = alone.start;
    s.update_rows(
        &block.positions,
        &graph,
        |pair| {
            if alone.contains(&pair) && pair != keep {
                0.0
            } else {
                factors[pair]
            }
        },
        &[40],
    )
    .unwrap();
    assert!(check(&s) > 0, "some row is deficient");
    assert_eq!(s.ranks[40].rank, 1);
}

/// What a set-up cost can be kept: read back it is the same, and goes on as the same.
#[cfg(feature = "serde")]
#[test]
fn stencils_and_graph_survive_being_written() {
    let block = block([4; 3], 1.0, 0.2, 3);
    let (graph, mut stencils) = build(&block);
    let text = ron::to_string(&(&graph, &stencils)).unwrap();
    let (kept_graph, mut kept): (Neighborhoods, ConservativeStencils) =
        ron::from_str(&text).unwrap();
    assert_eq!((&kept_graph, &kept), (&graph, &stencils));
    let factor = |pair: usize| if pair.is_multiple_of(3) { 0.5 } else { 1.0 };
    for s in [&mut stencils, &mut kept] {
        s.update_rows(&block.positions, &graph, factor, &[1, 7, 8])
            .unwrap();
    }
    assert_eq!(kept, stencils);
    let broken = text.replacen("offsets:[0,", "offsets:[1,", 1);
    let error = ron::from_str::<(Neighborhoods, ConservativeStencils)>(&broken).unwrap_err();
    assert!(error.to_string().contains("breaks the CSR rule"), "{error}");
}
