//! Any graph, weights and multipliers against the definition, pair by pair.

#![allow(
    clippy::needless_range_loop,
    reason = "both ends of pairs are walked in step"
)]

use super::*;
use proptest::prelude::*;

/// A random cloud with a random symmetric graph and random factors whose rows are consistent.
fn cloud(seed: u64, count: usize, corrected: bool) -> Option<Block> {
    let mut random = Random::new(seed);
    let place = DVec3::new(3.0, -2.0, 0.5);
    let mut block = Block::new([1, 1, 1], DVec3::ONE, 0.0, 1);
    block.positions = (0..count).map(|_| place + random.vector(0.5)).collect();
    block.volumes = (0..count).map(|_| random.range(0.5, 2.0) * 1e-3).collect();
    let mut weight = vec![vec![None; count]; count];
    for i in 0..count {
        for j in 0..i {
            if random.range(0.0, 1.0) < 0.6 {
                // One pair in ten is severed.
                let share = random.range(-0.1, 0.9).max(0.0);
                let square = block.positions[i].distance_squared(block.positions[j]);
                #[allow(clippy::cast_possible_truncation, reason = "weights are kept as f32")]
                let rounded = f64::from((share / square) as f32);
                weight[i][j] = Some(rounded);
                weight[j][i] = Some(rounded);
            }
        }
    }
    block.offsets = vec![0];
    block.indices.clear();
    block.weights.clear();
    for row in &weight {
        for (j, w) in (0_u32..).zip(row) {
            if let Some(w) = w {
                block.indices.push(j);
                block.weights.push(*w);
            }
        }
        let end = u32::try_from(block.indices.len()).expect("small");
        block.offsets.push(end);
    }
    block.gradients = vec![DVec3::ZERO; block.indices.len()];
    block.self_gradients = vec![DVec3::ZERO; count];
    block.matrices = vec![DMat3::ZERO; count];
    let scales = block.volumes.iter().map(|v| v * random.range(-1.0, 2.0));
    block.scales = scales.collect();
    block.multipliers = (0..count).map(|_| random.vector(300.0)).collect();
    if !corrected {
        block.scales.clear();
        block.multipliers.clear();
    }
    for i in 0..count {
        let (mut moment, mut tensor) = (DMat3::ZERO, DMat3::ZERO);
        for p in block.row(i) {
            let x = block.offset(i, p) * block.weights[p];
            moment += outer(x, block.offset(i, p));
            if corrected {
                let mu = block.multipliers[block.indices[p] as usize] - block.multipliers[i];
                tensor += outer(mu, x);
            }
        }
        let (values, _) = crate::kernel::completion::symmetric_eigen(moment);
        let least = values.iter().fold(f64::INFINITY, |m, v| m.min(*v));
        // A node whose every pair is severed has no moments at all: zero is not above zero.
        if least <= 0.02 * values.iter().fold(0.0, |m, v| v.max(m)) {
            return None;
        }
        let inverse = moment.inverse();
        let scale = block.scales.get(i).copied().unwrap_or(0.0);
        block.matrices[i] = inverse - tensor * inverse * scale;
    }
    block.set_gradients_from_factors(0..count);
    Some(block)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Energy and forces are those of the definition, at any node count (blocks
    /// and their remainders), and forces sum to zero.
    #[test]
    fn factored_passes_equal_the_definition(
        seed in any::<u64>(),
        count in 8_usize..50,
        corrected: bool,
        alpha in prop_oneof![Just(0.0), 0.01..1.0],
    ) {
        let block = cloud(seed, count, corrected);
        prop_assume!(block.is_some());
        let block = block.expect("just asked");
        let x = shaken(&block, 0.003, seed);
        let material = Material::neo_hookean(2.0, 0.4);
        let (expected, g) = brute_force(&block, material, alpha, &x);
        let scale = largest(&g);
        let (energy, f) = evaluated(&mut model(&block, material, alpha), &x);
        prop_assert!((energy - expected).abs() <= 1e-11 * expected, "{energy} {expected}");
        for (f, g) in f.iter().zip(&g) {
            prop_assert!((*f - *g).length() <= 1e-11 * scale, "{f} {g}");
        }
        let [sum, _] = momenta(&x, &f);
        prop_assert!(sum <= 1e-12 * scale * 50.0, "{sum} of {scale}");
    }
}
