//! Gradients that continue over a rebuild, control that a cut raises, and what is monitored.

use super::*;
use crate::kernel::stale::Stale;
use crate::kernel::storage::{BLOCK, CHUNK};
use crate::law::tensor::double_dot;
use crate::rows::Rows;

pub(super) fn law() -> Material {
    Material::stable_neo_hookean(1.0, 0.4)
}

#[test]
fn rows_that_come_alone_give_the_same_bits() {
    let whole = Block::new([4, 4, 4], DVec3::splat(0.4), 0.0, 1);
    let (torn, touched) = torn();
    let x = shaken(&whole, 0.02, 6);
    let mut weights = Vec::new();
    let mut seen = touched.clone();
    for &node in &touched {
        let row = torn.row(node as usize);
        weights.extend_from_slice(&torn.weights[row.clone()]);
        seen.extend_from_slice(&torn.indices[row]);
    }
    seen.sort_unstable();
    seen.dedup();
    let at = |node: &u32| *node as usize;
    let matrices: Vec<DMat3> = touched.iter().map(|i| torn.matrices[at(i)]).collect();
    let scales: Vec<f64> = touched.iter().map(|i| torn.scales[at(i)]).collect();
    let multipliers: Vec<(u32, DVec3)> =
        seen.iter().map(|i| (*i, torn.multipliers[at(i)])).collect();
    let rows = Rows {
        nodes: &touched,
        weights: &weights,
        matrices: &matrices,
        scales: &scales,
        multipliers: &multipliers,
    };

    let mut one = model(&whole, law(), 0.1);
    let mut other = one.clone();
    update(&mut one, &touched, &torn);
    other.take_rows(&rows).expect("valid");
    let ((energy, f), (same, g)) = (evaluated(&mut one, &x), evaluated(&mut other, &x));
    assert_eq!((energy.to_bits(), f), (same.to_bits(), g));
    let none = Rows {
        weights: &weights[1..],
        ..rows
    };
    assert!(other.take_rows(&none).is_err(), "a weight is missing");
}

#[test]
fn gradients_go_on_over_a_rebuild_and_their_decay_is_booked() {
    let whole = block();
    let x = shaken(&whole, 0.01, 2);
    for settings in [Settings::default(), mean()] {
        let mut body = built(&whole, law(), &settings);
        evaluated(&mut body, &x);
        let before = body.deformation_gradients();
        let means = body.state.pressures.as_ref().map(|all| all.means.clone());
        let mut torn = block();
        let middle = 0.2;
        let touched = cut(&mut torn, |i, j| {
            (whole.positions[i].x < middle) == (whole.positions[j].x < middle)
                || (whole.positions[i].y > 0.2 && whole.positions[j].y > 0.2)
        });
        update(&mut body, &touched, &torn);
        let kept: Vec<DMat3> = touched.iter().map(|&i| before[i as usize]).collect();
        body.retain_gradients(&touched, &kept, &x);
        let off = |body: &Elastic, before: &[f64]| {
            let now = &body.state.pressures.as_ref().unwrap().means;
            (before.iter().zip(now)).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()))
        };
        if let Some(means) = &means {
            evaluated(&mut body, &x);
            assert!(off(&body, means) > 1e-3, "a mean over others");
            body.retain_means(means, &x);
        }
        evaluated(&mut body, &x);
        if let Some(means) = &means {
            assert_below("mean", off(&body, means), 1e-5);
        }
        for &node in &touched {
            let node = node as usize;
            if body.model.ranks[node] == 3 {
                let off = (body.deformation_gradient(node) - before[node]).to_cols_array();
                let size = off.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                assert_below("gradient", size, 1e-14);
            }
        }
        check_derivatives("offsets", &mut body, &shaken(&whole, 0.01, 4), 1e-3, 1e-3);
        // Moved on, turned or not, it keeps both momenta.
        for turn in [0.0, 2.0] {
            let by = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), turn);
            let x: Vec<DVec3> = shaken(&whole, 0.02, 7).iter().map(|&x| by * x).collect();
            let (_, f) = evaluated(&mut body, &x);
            let size: f64 = x.iter().zip(&f).map(|(x, f)| x.length() * f.length()).sum();
            let [sum, torque] = momenta(&x, &f);
            assert_below("torque", torque, 1e-12 * size);
            assert_below("sum", sum, 1e-12 * size);
        }
        let (start, mut f) = evaluated(&mut body, &x);
        let kept = body.state();
        assert!(kept.offsets.len() > 5, "{}", kept.offsets.len());
        let (mut work, mut energy) = (0.0, start);
        let mut steps = 0;
        while body.decays() {
            work += body.decay(0.99, &x).sums()[0];
            (energy, f) = evaluated(&mut body, &x);
            work += body.decay_works().sums()[0];
            steps += 1;
        }
        assert!(steps > 100, "{steps}");
        let change = energy - start;
        assert_within("work of the decay", work, change, 2e-4 * change.abs());
        // What is left is the model with the new rows.
        let mut fresh = built(&whole, law(), &settings);
        update(&mut fresh, &touched, &torn);
        let (same, g) = evaluated(&mut fresh, &x);
        assert_eq!((same.to_bits(), g), (energy.to_bits(), f));
        // And a checkpoint brings the offsets back.
        fresh.set_state(&kept);
        assert_eq!(fresh.state(), kept);
        assert_eq!(evaluated(&mut fresh, &x).0.to_bits(), start.to_bits());
    }
}

#[test]
fn what_is_watched_is_the_worst_of_all_nodes() {
    let block = block();
    for material in [law(), Material::neo_hookean(1.0, 0.4), fibrous(law())] {
        let mut body = model(&block, material, 0.1);
        let masses: Vec<f64> = block.volumes.iter().map(|v| 1e3 * v).collect();
        let x = shaken(&block, 0.02, 9);
        evaluated(&mut body, &x);
        assert_eq!(body.stiffness_indicator().to_bits(), 0);
        body.watch_stiffness(&masses);
        evaluated(&mut body, &x);
        let (mut ratio, mut stiffest) = (f64::INFINITY, (0.0, 0));
        for i in 0..x.len() {
            let f = body.deformation_gradients()[i];
            ratio = ratio.min(f.determinant());
            let mut square = block.self_gradients[i].length_squared() / masses[i];
            for p in block.row(i) {
                square += block.gradients[p].length_squared() / masses[block.indices[p] as usize];
            }
            // The bound is one: no direction of dF is resisted more.
            let plain = Material {
                fiber: None,
                ..material
            };
            let bound = Coefficients::new(&plain).tangent_bound(f);
            let mut random = Random::new(4);
            for _ in 0..20 {
                let [a, b, c] = [(); 3].map(|()| random.vector(1.0));
                let d = DMat3::from_cols(a, b, c);
                let resisted = double_dot(d, plain.stress_change(f, d));
                assert!(resisted <= bound * double_dot(d, d) * (1.0 + 1e-12));
            }
            let indicator = block.volumes[i] * bound * square;
            if indicator > stiffest.0 {
                stiffest = (indicator, i);
            }
        }
        assert_within("det F", body.smallest_volume_ratio(), ratio, 1e-14);
        let largest = body.stiffness_indicator();
        assert_within("indicator", largest, stiffest.0, 1e-12 * stiffest.0);
        let runs = body.stiffness_indicators();
        assert_eq!(runs.len(), body.node_count().div_ceil(crate::WATCHED_NODES));
        assert_eq!(runs.fold(0.0, f64::max).to_bits(), largest.to_bits());
        let nodes = body.stiffest_nodes(8, None);
        assert_eq!(nodes.len(), 8);
        let some = body.stiffest_nodes(3, Some(&[stiffest.1 / crate::WATCHED_NODES]));
        assert_eq!(some[0], nodes[0]);
        assert_eq!(some.len(), 3);
        assert_eq!(nodes[0].node as usize, stiffest.1);
        assert!(nodes.windows(2).all(|w| w[0].indicator >= w[1].indicator));
        // It is at least of the size of the eigenvalue, which fibers raise.
        if material.fiber.is_some() {
            continue;
        }
        let value = largest_eigenvalue(&mut body, &masses);
        assert!(stiffest.0 > 0.5 * value, "{} for {value}", stiffest.0);
    }
}

/// By power iteration.
fn largest_eigenvalue(body: &mut Elastic, masses: &[f64]) -> f64 {
    let n = masses.len();
    let mut random = Random::new(1);
    let mut v: Vec<DVec3> = (0..n).map(|_| random.vector(1.0)).collect();
    let mut value = 0.0;
    for _ in 0..300 {
        let mut kv = product(body, &v);
        for (k, m) in kv.iter_mut().zip(masses) {
            *k /= *m;
        }
        let size = dot(&kv, &kv).sqrt();
        value = size / dot(&v, &v).sqrt();
        v = kv.into_iter().map(|kv| kv / size).collect();
    }
    value
}

/// Everything that an evaluation of the whole leaves.
fn left_behind_by(body: &mut Elastic, x: &[DVec3]) -> Vec<u64> {
    let (energy, forces) = evaluated(body, x);
    left_behind(body, energy, &forces)
}

/// Everything that an evaluation leaves, as bits.
fn left_behind(body: &Elastic, energy: f64, forces: &[DVec3]) -> Vec<u64> {
    let gradients = body.deformation_gradients();
    let gradients = gradients.iter().flat_map(DMat3::to_cols_array);
    let forces = forces.iter().flat_map(DVec3::to_array);
    let watched = [body.smallest_volume_ratio(), body.stiffness_indicator()];
    let all = gradients.chain(forces).chain(watched).chain([energy]);
    all.map(f64::to_bits).collect()
}

#[test]
fn stiffest_nodes_of_few_runs_are_those_of_all() {
    let block = Block::new([13, 13, 16], DVec3::ONE, 0.2, 1);
    let n = block.positions.len();
    assert!(n > 10 * crate::WATCHED_NODES, "{n} nodes");
    let masses: Vec<f64> = block.volumes.iter().map(|v| 1e3 * v).collect();
    for seed in [1, 2] {
        let mut body = model(&block, law(), 0.1);
        body.watch_stiffness(&masses);
        let x = shaken(&block, 0.02, seed);
        evaluated(&mut body, &x);
        let runs: Vec<usize> = (0..n.div_ceil(crate::WATCHED_NODES)).collect();
        let all = |body: &Elastic, count| body.stiffest_nodes(count, Some(&runs));
        for count in [0, 1, 3, 8, 300] {
            let found = body.stiffest_nodes(count, None);
            assert_eq!(found.len(), count);
            assert_eq!(found, all(&body, count), "{count} nodes");
        }
        // Of nodes that lost their energy since, the evaluation reports too much.
        let lost: Vec<u32> = body
            .stiffest_nodes(30, None)
            .iter()
            .map(|s| s.node)
            .collect();
        body.weaken(&lost, &x, &|_| 1.0);
        assert_eq!(body.stiffest_nodes(8, None), all(&body, 8));
    }
}

#[test]
fn control_rises_and_falls_as_far_as_its_energy_allows() {
    let rest = Block::new([4, 4, 4], DVec3::splat(0.4), 0.2, 1);
    let x = shaken(&rest, 0.02, 6);
    let n = rest.positions.len();
    let [mut with, mut without] = [0.1, 0.0].map(|alpha| model(&rest, law(), alpha));
    let nodes: Vec<u32> = (0..20).collect();
    let all: Vec<u32> = (0..).take(n).collect();
    let held = evaluated(&mut with, &x).0 - evaluated(&mut without, &x).0;
    let own = with.control_energy(&all, &x);
    assert!(own > 0.0, "{own}");
    assert_within("the control's share of the energy", own / held, 1.0, 1e-9);
    let before = with.control_energy(&nodes, &x);
    with.scale_control_within(&nodes, 3.0, 0.9 * before, &x);
    let nothing_left = with.state().control.is_empty();
    assert!(nothing_left, "to raise it");
    // Two thirds of the energy that the whole change takes, in two calls; then down, as far as is asked, not below 1.
    let part = 7.0 / 3.0;
    let up = [(2.0, 2.0), (part, part), (9.0, 3.0), (9.0, 3.0)];
    let down = [(1.5, 1.5), (0.9, 1.0), (2.0, 2.0)];
    for (most, scale) in up.into_iter().chain(down) {
        let (energy, _) = evaluated(&mut with, &x);
        let held = with.control_energy(&nodes, &x);
        with.scale_control_within(&nodes, 3.0, most * before, &x);
        let (now, forces) = evaluated(&mut with, &x);
        let added = now - energy;
        let now = with.control_energy(&nodes, &x);
        assert_within("the energy", now / before, scale, 1e-9);
        assert!((added - (now - held)).abs() < 1e-9 * energy, "{added}");
        let scales = with.state().control;
        assert_eq!(scales.len(), if scale > 1.0 { nodes.len() } else { 0 });
        let all = scales.iter().all(|(_, s)| (s - scale).abs() < 1e-9);
        assert!(all, "{scales:?}");
        let mut again = model(&rest, law(), 0.1);
        again.set_state(&with.state());
        assert_eq!(evaluated(&mut again, &x).1, forces, "as kept");
    }
    // At rest nothing is held, and nothing is added.
    let mut still = model(&rest, law(), 0.1);
    still.scale_control_within(&nodes, 3.0, 0.0, &rest.positions);
    let scales = still.state().control;
    assert!(scales.iter().all(|(_, scale)| *scale > 2.999_999));
}

#[test]
fn forces_again_are_those_of_a_whole_evaluation_to_the_bit() {
    let mut block = Block::new([6, 6, 60], DVec3::splat(0.1), 0.2, 3);
    let mut body = model(&block, law(), 0.1);
    let n = body.node_count();
    body.watch_stiffness(&vec![1.0; n]);
    let x = shaken(&block, 0.01, 4);
    let (_, mut forces) = evaluated(&mut body, &x);
    let middle = block.positions[n / 2];
    for round in 0..4 {
        let before = body.deformation_gradients();
        // A slit across the bar, one layer deeper in every round.
        let at = block.positions.clone();
        let deep = 0.1 * f64::from(round + 2);
        let touched = cut(&mut block, |i, j| {
            let side = |k: usize| at[k].z > middle.z;
            side(i) == side(j) || at[i].x.max(at[j].x) > deep
        });
        update(&mut body, &touched, &block);
        body.scale_control_within(&touched, 3.0, f64::INFINITY, &x);
        let share = |p: usize| f64::from(u8::from(block.weights[p] > 0.0));
        body.weaken(&touched[..3], &x, &share);
        let old: Vec<DMat3> = touched.iter().map(|&i| before[i as usize]).collect();
        body.retain_gradients(&touched, &old, &x);
        let part = body.part(&touched[3..20]);
        let mut product = vec![DVec3::ONE; part.nodes().len()];
        let ones = product.clone();
        body.tangent_product_within(&part, &ones, &mut product);
        if round == 3 {
            body.decay(0.5, &x);
        }
        let chosen = body.changed_chunks();
        let count = chosen.iter().filter(|chosen| **chosen).count();
        assert!(2 * count <= chosen.len(), "{count} of {}", chosen.len());
        let expected = left_behind_by(&mut body.clone(), &x);
        let energy = body.forces_again(&x, &mut forces);
        assert_eq!(left_behind(&body, energy, &forces), expected);
    }
    // Elsewhere, and after a product of the whole, everything is evaluated.
    let there = shaken(&block, 0.02, 5);
    for x in [&there, &x] {
        let expected = left_behind_by(&mut body.clone(), x);
        body.tangent_product_into(&there, &mut forces);
        let energy = body.forces_again(x, &mut forces);
        assert_eq!(left_behind(&body, energy, &forces), expected);
    }
    body.forces_again(&there, &mut forces);
    let (_, whole) = evaluated(&mut body, &there);
    assert_eq!(forces, whole, "a body that moved");
}

/// Blocks in which nothing can have a strain are evaluated once; against a body that evaluates them each time.
#[test]
fn blocks_that_are_not_evaluated_again_say_what_they_said() {
    let mut block = Block::new([6, 6, 60], DVec3::new(0.1, 0.1, 1.0), 0.2, 3);
    let mut body = model(&block, law(), 0.1);
    let rest = block.positions.clone();
    let n = body.node_count();
    let middle = rest[n / 2].z;
    let held = (0_u32..).zip(&rest).filter(|(_, x)| x.z > middle);
    let held: Vec<u32> = held.map(|(node, _)| node).collect();
    body.set_held(&held);
    body.watch_stiffness(&vec![1.0; n]);
    let sleeping = |body: &Elastic| {
        let chunks = body.scratch.asleep.iter();
        let blocks = chunks.map(|chunk| (0..CHUNK / BLOCK).filter(|&at| chunk.holds(at)).count());
        blocks.sum::<usize>()
    };
    for round in 0..6 {
        let mut x = shaken(&block, 0.01, round);
        for &node in &held {
            x[node as usize] = rest[node as usize];
        }
        let before = sleeping(&body);
        match round {
            2 | 4 => {
                // Through half of what sleeps, too, and deeper the second time.
                let deep = if round == 2 { 0.04 } else { 0.08 };
                let touched = cut(&mut block, |i, j| {
                    let side = |k: usize| rest[k].y > 0.05;
                    let far = rest[i].z.max(rest[j].z) > 1.5 * middle;
                    side(i) == side(j) || far || rest[i].x.max(rest[j].x) > deep
                });
                update(&mut body, &touched, &block);
                body.scale_control_within(&touched, 3.0, f64::INFINITY, &x);
                let share = |p: usize| f64::from(u8::from(block.weights[p] > 0.0));
                body.weaken(&touched[touched.len() - 9..], &x, &share);
                let old = vec![DMat3::from_diagonal(DVec3::new(1.1, 1.0, 0.9)); touched.len()];
                body.retain_gradients(&touched, &old, &x);
            }
            3 => {
                body.decay(0.5, &x);
            }
            5 => {
                // What offsets are left is dropped.
                body.decay(0.0, &x);
                let part = body.part(&held[..40]);
                let mut product = vec![DVec3::ZERO; part.nodes().len()];
                body.tangent_product_within(&part, &product.clone(), &mut product);
            }
            _ => {}
        }
        let mut awake = body.clone();
        awake.scratch.stale = Stale::everything();
        let expected = left_behind_by(&mut awake, &x);
        // What is left in the slice does not matter.
        let mut forces = vec![DVec3::ONE; n];
        let energy = body.forces_into(&x, &mut forces);
        let found = left_behind(&body, energy, &forces);
        assert_eq!(found, expected, "round {round}");
        let asleep = sleeping(&body);
        assert!(round != 2 || asleep < before, "a cut wakes what it touches");
        assert!(asleep > 0, "round {round}: something sleeps");
    }
}
