use super::*;
use crate::symmetric::outer;
use crate::{inverse_square_weights, kernel_weights, within_radius};
use glam::DQuat;
use testkit::assert_matches;
use testkit::kuhn::{Block, graded, kuhn_block as block, organ};
use testkit::tol::{assert_below, assert_within};

fn graph(block: &Block) -> Neighborhoods {
    Neighborhoods::from_graph(block.offsets.clone(), block.indices.clone()).unwrap()
}

fn build(block: &Block) -> (Neighborhoods, GradientStencils) {
    build_with(block, &ConservativeSettings::default())
}

fn build_with(block: &Block, settings: &ConservativeSettings) -> (Neighborhoods, GradientStencils) {
    let graph = graph(block);
    let weights = inverse_square_weights(&block.positions, &graph);
    let stencils = weighted(block, &graph, weights, settings).unwrap();
    (graph, stencils)
}

fn weighted(
    block: &Block,
    graph: &Neighborhoods,
    weights: Vec<f64>,
    settings: &ConservativeSettings,
) -> Result<GradientStencils, StencilError> {
    let (x, b) = (&block.positions, &block.boundary_vectors);
    GradientStencils::conservative(x, &block.volumes, b, graph, weights, settings)
}

fn report(s: &GradientStencils) -> SolveReport {
    s.report.unwrap()
}

/// `max_j |Σ_i V_i g_ij − b_j| / max |b|` by the plain double loop, and the largest entry of
/// `Σ_j X_ij g_ijᵀ − I` over the nodes of rank 3.
fn errors(block: &Block, graph: &Neighborhoods, s: &GradientStencils) -> (f64, f64) {
    let (x, b) = (&block.positions, &s.boundary_vectors);
    let gradients = s.pair_gradients(x, graph);
    let mut sums = vec![DVec3::ZERO; b.len()];
    let mut consistency = 0.0_f64;
    for i in 0..b.len() {
        let (mut own, mut unit) = (DVec3::ZERO, DMat3::ZERO);
        for (pair, j) in graph.entries(i) {
            let g = gradients[pair];
            sums[j] += g * s.volumes[i];
            own -= g;
            unit += outer(x[j] - x[i], g);
        }
        sums[i] += own * s.volumes[i];
        if s.ranks[i].rank == 3 {
            for entry in (unit - DMat3::IDENTITY).to_cols_array() {
                consistency = consistency.max(entry.abs());
            }
        }
    }
    let off = sums.iter().zip(b).map(|(c, b)| *c - *b);
    (largest(&off.collect::<Vec<_>>()) / largest(b), consistency)
}

/// Conservation to 1e-10 and linear consistency to 1e-12.
fn is_exact(block: &Block, graph: &Neighborhoods, s: &GradientStencils) {
    assert!(report(s).converged, "{:?}", s.report);
    assert_below("shift of b", report(s).boundary_shift, 1e-13);
    let (conservation, consistency) = errors(block, graph, s);
    assert_below("conservation", conservation, 1e-10);
    assert_below("consistency", consistency, 1e-12);
}

/// Factors of a planar cut `x = at` that has reached `y = front`, and the nodes it touches.
fn planar_cut(block: &Block, graph: &Neighborhoods, at: f64, front: f64) -> (Vec<f64>, Vec<u32>) {
    let mut factors = vec![1.0; graph.pair_count()];
    let mut touched = Vec::new();
    for (node, &a) in (0_u32..).zip(&block.positions) {
        for pair in graph.pairs(node as usize) {
            let b = block.positions[graph.indices()[pair] as usize];
            let share = (a.x - at) / (a.x - b.x);
            if (a.x < at) != (b.x < at) && a.y + share * (b.y - a.y) < front {
                factors[pair] = 0.0;
                touched.push(node);
            }
        }
    }
    touched.dedup();
    (factors, touched)
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
        is_exact(&block, &graph, &stencils);
        let direct = errors(&block, &graph, &stencils).0;
        let reported = report(&stencils).residual;
        assert_within("gather and scatter agree", reported, direct, 1e-13);
    }
}

/// The corrected stencil is the minimiser: any admissible change is orthogonal to `(g − g0)/w`.
#[test]
fn correction_has_the_form_of_the_minimiser() {
    let block = block([4, 4, 4], 1.0, 0.2, 9);
    let (graph, s) = build(&block);
    let plain = GradientStencils::plain(&block.positions, &graph, s.weights.clone(), 1e-3).unwrap();
    let corrected = s.pair_gradients(&block.positions, &graph);
    let before = plain.pair_gradients(&block.positions, &graph);
    let mu = &s.multipliers;
    for i in 0..block.positions.len() {
        let mut h = DMat3::ZERO;
        for (pair, k) in graph.entries(i) {
            h += outer(mu[k] - mu[i], before[pair]);
        }
        for (pair, j) in graph.entries(i) {
            let x = block.positions[j] - block.positions[i];
            let e = mu[j] - mu[i] - h * x;
            let change = e * (s.volumes[i] * s.weights[pair]);
            let difference = (corrected[pair] - before[pair] - change).length();
            assert_below("form of g", difference, 1e-13);
        }
    }
}

#[test]
fn any_symmetric_neighbourhood_will_do() {
    let block = block([6, 6, 6], 1.0, 0.2, 2);
    let graph = within_radius(&block.positions, 1.8).unwrap();
    let radii = vec![2.2; block.positions.len()];
    let weights = kernel_weights(&block.positions, &radii, &graph);
    let settings = ConservativeSettings::default();
    let s = weighted(&block, &graph, weights, &settings).unwrap();
    is_exact(&block, &graph, &s);
}

/// Two bodies that no pair joins, in one cloud: each is solvable by itself.
#[test]
fn pieces_are_conservative_each() {
    let mut both = block([6, 5, 4], 1.0, 0.2, 2);
    let other = block([4, 5, 5], 0.5, 0.2, 3);
    let (nodes, pairs) = (both.positions.len(), both.indices.len());
    let [nodes, pairs] = [nodes, pairs].map(|count| u32::try_from(count).unwrap());
    both.positions
        .extend(other.positions.iter().map(|x| x + 9.0));
    both.volumes.extend(&other.volumes);
    both.boundary_vectors.extend(&other.boundary_vectors);
    both.offsets
        .extend(other.offsets[1..].iter().map(|o| o + pairs));
    both.indices.extend(other.indices.iter().map(|j| j + nodes));
    let (graph, s) = build(&both);
    is_exact(&both, &graph, &s);
}

#[test]
fn memory_is_what_is_stated() {
    let block = block([9, 9, 9], 1.0, 0.2, 8);
    let (graph, s) = build(&block);
    let (nodes, pairs) = (block.positions.len(), graph.pair_count());
    assert_eq!(s.bytes(), 176 * nodes + 16 * pairs);
    let plain = GradientStencils::plain(&block.positions, &graph, s.weights, 1e-3).unwrap();
    assert_eq!(plain.bytes(), 112 * nodes + 16 * pairs);
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
    let position = try_with(&|b, _| b.positions[3].x = nan);
    assert_eq!(position, StencilError::Position { node: 3 });
    let volume = try_with(&|b, _| b.volumes[2] = 0.0);
    let (node, value) = (2, 0.0);
    assert_eq!(volume, StencilError::Volume { node, value });
    let boundary = try_with(&|b, _| b.boundary_vectors[1].z = f64::INFINITY);
    assert_eq!(boundary, StencilError::BoundaryVector { node: 1 });
    let weight = try_with(&|_, w| w[7] = -1.0);
    let (pair, value) = (7, -1.0);
    assert_eq!(weight, StencilError::Weight { pair, value });
    let short = try_with(&|b, _| b.volumes.truncate(4));
    assert_matches!(short, StencilError::Graph(_));
    let lopsided = Neighborhoods::from_graph(vec![0, 1, 1], vec![1]).unwrap();
    let (x, b, weights) = ([DVec3::ZERO, DVec3::X], [DVec3::ZERO; 2], vec![1.0]);
    let made = GradientStencils::conservative(&x, &[1.0; 2], &b, &lopsided, weights, &settings);
    assert_matches!(made, Err(StencilError::Graph(_)));
    let (_, mut s) = build(&block);
    let factor = |pair| if pair == 0 { nan } else { 1.0 };
    let refused = s.update_rows(&block.positions, &graph, factor, &[0]);
    assert_matches!(refused, Err(StencilError::Weight { pair: 0, .. }));
}

#[test]
fn touched_rows_equal_a_full_rebuild_with_the_old_multipliers() {
    let block = block([8, 8, 6], 1.0, 0.2, 6);
    let (graph, before) = build(&block);
    let (factors, touched) = planar_cut(&block, &graph, 4.4, 5.1);
    let all: Vec<u32> = (0..).take(block.positions.len()).collect();
    let [mut s, full] = [&touched, &all].map(|nodes| {
        let mut s = before.clone();
        s.update_rows(&block.positions, &graph, |pair| factors[pair], nodes)
            .unwrap();
        s
    });
    assert_eq!(s, full);
    assert_eq!(s.multipliers, before.multipliers);
    // Rows that the cut does not reach stay bitwise; severed pairs are gone.
    let gradients = s.pair_gradients(&block.positions, &graph);
    for (i, node) in (0..).zip(&all) {
        if touched.binary_search(node).is_err() {
            assert_eq!(s.matrices[i], before.matrices[i]);
        }
        for pair in graph.pairs(i).filter(|&pair| factors[pair] == 0.0) {
            assert_eq!(gradients[pair], DVec3::ZERO);
        }
    }
    let consistency = errors(&block, &graph, &s).1;
    assert_below("consistency", consistency, 1e-11);
    // Factors of 1 everywhere give the uncut rows back.
    s.update_rows(&block.positions, &graph, |_| 1.0, &touched)
        .unwrap();
    assert_eq!(s, before);
}

/// What a cut opens closes the surface of each piece around its volume; elsewhere nothing is open.
#[test]
fn opened_areas_close_the_surfaces_of_pieces() {
    let block = block([8, 8, 6], 1.0, 0.2, 6);
    let (x, volumes) = (&block.positions, &block.volumes);
    let (graph, mut s) = build(&block);
    let (factors, touched) = planar_cut(&block, &graph, 4.4, f64::INFINITY);
    let areas = |s: &GradientStencils| -> Vec<DVec3> {
        let nodes = 0..x.len();
        nodes.map(|node| s.opened_area(x, &graph, node)).collect()
    };
    let face = largest(&s.boundary_vectors);
    assert_below("uncut", largest(&areas(&s)), 1e-10 * face);
    s.update_rows(x, &graph, |pair| factors[pair], &touched)
        .unwrap();
    let opened = areas(&s);
    for left in [true, false] {
        let piece = (0..x.len()).filter(|node| (x[*node].x < 4.4) == left);
        let (mut sum, mut volume, mut moment) = (DVec3::ZERO, 0.0, DMat3::ZERO);
        for node in piece {
            let area = opened[node] + s.boundary_vectors[node];
            sum += area;
            moment += outer(area, x[node]);
            volume += volumes[node];
            if x[node].distance(DVec3::new(4.4, x[node].y, x[node].z)) > 3.5 {
                assert_below("far from the cut", opened[node].length(), 1e-10 * face);
            }
        }
        assert_below("a closed surface", sum.length(), 1e-10 * face);
        for entry in (moment - DMat3::IDENTITY * volume).to_cols_array() {
            assert_below("its volume", entry.abs(), 1e-10 * volume);
        }
    }
    let across = |left: bool| {
        opened
            .iter()
            .zip(x)
            .filter(move |(_, x)| (x.x < 4.4) == left)
    };
    for (left, sign) in [(true, 1.0), (false, -1.0)] {
        let area: DVec3 = across(left).map(|(area, _)| *area).sum();
        assert_within("of the flank", sign * area.x, 48.0, 0.01);
    }
}

/// A body diced by planes, with slivers, and a node that keeps one pair: rows that lose their rank keep
/// what plain stencils have there. Weights survive storage as f32.
#[test]
fn diced_bodies_stay_finite() {
    let block = block([10, 10, 10], 1.0, 0.2, 7);
    let (graph, mut s) = build(&block);
    let cell =
        |x: DVec3| [x.x, x.y, x.z].map(|c| (c > 2.6) as u8 + (c > 3.1) as u8 + (c > 6.2) as u8);
    let alone = graph.pairs(40);
    let mut factors = vec![1.0; graph.pair_count()];
    for i in 0..block.positions.len() {
        for (pair, j) in graph.entries(i) {
            if cell(block.positions[i]) != cell(block.positions[j]) {
                factors[pair] = 0.0;
            } else if pair % 7 == 0 {
                factors[pair] = 0.3;
            }
        }
    }
    factors[alone.clone()].fill(0.0);
    factors[alone.start] = 1.0;
    let all: Vec<u32> = (0..).take(block.positions.len()).collect();
    s.update_rows(&block.positions, &graph, |pair| factors[pair], &all)
        .unwrap();
    assert_eq!(s.ranks[40].rank, 1);
    let plain = GradientStencils::plain(&block.positions, &graph, s.weights.clone(), 1e-3).unwrap();
    let deficient = (0..all.len()).filter(|&i| s.ranks[i].rank < 3);
    assert!(deficient.clone().count() > 1, "slivers lose rank");
    for i in deficient {
        assert_eq!((s.matrices[i], s.scales[i]), (plain.matrices[i], 0.0));
    }
    let gradients = s.pair_gradients(&block.positions, &graph);
    assert!(gradients.iter().all(|g| g.is_finite()));
    let consistency = errors(&block, &graph, &s).1;
    assert_below("consistency", consistency, 1e-9);
    #[allow(clippy::cast_possible_truncation, reason = "that is what is tested")]
    let stored = s.weights.iter().map(|&w| f64::from(w as f32));
    let mut both = stored.zip(&s.weights);
    assert!(both.all(|(a, b)| a.to_bits() == b.to_bits()));
}

/// Stencils of graded and curved clouds are conservative, too.
#[test]
fn coarse_space_changes_the_iterations_and_not_the_stencils() {
    for block in [
        block([12; 3], 1.0, 0.2, 3),
        graded(12, 5),
        organ([14, 11, 9], 5),
    ] {
        let positive = block.volumes.iter().all(|&v| v > 0.0);
        assert!(positive, "no cell is turned over");
        let (graph, fast) = build(&block);
        is_exact(&block, &graph, &fast);
        let plain = ConservativeSettings {
            coarse_space: false,
            ..Default::default()
        };
        let slow = build_with(&block, &plain).1;
        assert!(report(&slow).converged, "{:?}", slow.report);
        let [a, b] = [&fast, &slow].map(|s| s.pair_gradients(&block.positions, &graph));
        let size = largest(&a);
        for (a, b) in a.iter().zip(&b) {
            assert_below("same stencil", (*a - *b).length(), 1e-7 * size);
        }
        let [a, b] = [&fast, &slow].map(|s| report(s).iterations);
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
    let (edges, s) = build(&block);
    let flat = s.ranks.iter().filter(|r| r.rank < 3).count();
    assert!(flat > 20, "the case is a hard one");
    let stopped = report(&s);
    assert!(!stopped.converged && stopped.residual < 1.0, "{stopped:?}");
    let (conservation, consistency) = errors(&block, &edges, &s);
    assert!(conservation.is_finite() && s.converged().is_err());
    assert_below("consistency", consistency, 1e-10);
    let (wide, left) = crate::widen_deficient_rows(&block.positions, &edges, 1e-3).unwrap();
    assert!(left.len() < 5, "{} rows still flat", left.len());
    let weights = inverse_square_weights(&block.positions, &wide);
    let s = weighted(&block, &wide, weights, &ConservativeSettings::default()).unwrap();
    assert!(report(&s).converged, "{:?}", s.report);
    assert_below("conservation", errors(&block, &wide, &s).0, 1e-10);
    // What the rows still flat cannot carry was moved off the boundary vectors.
    assert_below("shift", report(&s).boundary_shift, 1e-5);
}

#[test]
fn one_thread_and_many_are_bitwise_identical() {
    let block = block([13, 13, 13], 1.0, 0.2, 8);
    let (_, many) = build(&block);
    for threads in [1, 3] {
        assert_eq!(testkit::on_threads(threads, || build(&block).1), many);
    }
}
