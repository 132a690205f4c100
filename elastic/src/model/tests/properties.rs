//! What holds for any rows: forces are slopes, tangents symmetric, momenta kept, energies objective.

use proptest::prelude::*;
use testkit::strategies::rotation;

use super::*;

/// Any law with any constants (Pa) that a scene may ask for.
fn any_material() -> impl Strategy<Value = Material> {
    let constants = (1e2..1e5_f64, 0.0..0.49_f64, 0.0..1.0_f64);
    (0..5_u8, constants).prop_map(|(law, (young, ratio, share))| match law {
        0 => Material::neo_hookean(young, ratio),
        1 => Material::stable_neo_hookean(young, ratio),
        2 => Material::saint_venant_kirchhoff(young, ratio),
        // The law asks for λ >= 4 c01, that is ν / (1 - 2 ν) >= share.
        3 => Material::mooney_rivlin(
            young,
            ratio,
            share * (0.999 * ratio / (1.0 - 2.0 * ratio)).min(1.0),
        ),
        _ => Material::neo_hookean(young, ratio).with_volume_constant(share * young),
    })
}

/// A jittered block whose rows are any that are linearly consistent: every pair weighs 0.05 to 1 times as
/// much as before, multipliers and scales are any, if there are some, and `B_i` follows from them.
fn any_rows() -> impl Strategy<Value = (Block, u64)> {
    let cells = (2..4_usize, 2..4_usize, 2..4_usize);
    let drawn = (cells, any::<u64>(), any::<bool>());
    drawn.prop_map(|((a, b, c), seed, corrected)| {
        let mut block = Block::new([a, b, c], DVec3::new(0.4, 0.35, 0.3), 0.2, seed);
        let mut random = Random::new(seed);
        let n = block.node_count();
        for i in 0..n {
            for p in block.row(i) {
                let j = block.indices[p] as usize;
                if j < i {
                    continue;
                }
                let mut back = block.row(j);
                let back = back.find(|&q| block.indices[q] as usize == i);
                #[allow(
                    clippy::cast_possible_truncation,
                    reason = "weights have the digits of an f32"
                )]
                let weight = f64::from((block.weights[p] * random.range(0.05, 1.0)) as f32);
                block.weights[p] = weight;
                block.weights[back.expect("the graph is symmetric")] = weight;
            }
        }
        for i in 0..n {
            block.multipliers[i] = random.vector(0.1);
            block.scales[i] = random.range(-0.3, 0.3);
        }
        if !corrected {
            block.scales.clear();
            block.multipliers.clear();
        }
        for i in 0..n {
            let (mut moments, mut mixed) = (DMat3::ZERO, DMat3::ZERO);
            for p in block.row(i) {
                let (x, weight) = (block.offset(i, p), block.weights[p]);
                moments += outer(x, x) * weight;
                if corrected {
                    let along = block.multipliers[block.indices[p] as usize];
                    mixed += outer(x, along - block.multipliers[i]) * (weight * block.scales[i]);
                }
            }
            let rest = DMat3::IDENTITY - mixed;
            block.matrices[i] = (moments.inverse() * rest).transpose();
        }
        block.set_gradients_from_factors(0..n);
        (block, seed)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    /// Energy and forces are those of the definition, pair by pair, at any node count (blocks and their remainders).
    #[test]
    fn factored_passes_equal_the_definition(
        (block, seed) in any_rows(),
        alpha in prop_oneof![Just(0.0), 0.01..1.0],
    ) {
        let x = shaken(&block, 0.003, seed);
        let material = Material::neo_hookean(2.0, 0.4);
        let (expected, g) = brute_force(&block, material, alpha, &x);
        let scale = largest(&g);
        let (energy, f) = evaluated(&mut model(&block, material, alpha), &x);
        prop_assert!((energy - expected).abs() <= 1e-11 * expected, "{energy} {expected}");
        for (f, g) in f.iter().zip(&g) {
            prop_assert!((*f - *g).length() <= 1e-11 * scale, "{f} {g}");
        }
    }

    /// Of any rows: forces are minus the slope of the energy, the tangent is symmetric and theirs, and no
    /// body drags or turns itself.
    #[test]
    fn bodies_of_any_rows_keep_what_must_be_kept(
        (block, seed) in any_rows(),
        material in any_material(),
        control in prop_oneof![Just(0.0), 0.01..0.5_f64],
        rotation in rotation(),
    ) {
        let mut body = model(&block, material, control);
        let n = block.node_count();
        let x = shaken(&block, 0.01, seed);
        let mut random = Random::new(!seed);
        let (u, v): (Vec<DVec3>, Vec<DVec3>) =
            (0..n).map(|_| (random.vector(1.0), random.vector(1.0))).unzip();
        let mut evaluate = |x: &[DVec3]| evaluated(&mut body, x);
        let step = 1e-6;
        let (ahead, behind) = (evaluate(&moved(&x, &u, step)), evaluate(&moved(&x, &u, -step)));
        let turned: Vec<DVec3> = x.iter().map(|x| rotation * *x + DVec3::new(3.0, -2.0, 1.0)).collect();
        let (turned_energy, turned_forces) = evaluate(&turned);
        let (energy, f) = evaluate(&x);
        let size = dot(&f, &f).sqrt();

        let slope = (ahead.0 - behind.0) / (2.0 * step);
        let moves = dot(&u, &u).sqrt();
        prop_assert!((slope + dot(&f, &u)).abs() < 1e-5 * size * moves, "{slope} for {}", -dot(&f, &u));

        prop_assert!((turned_energy - energy).abs() < 1e-9 * energy.abs(), "{turned_energy} for {energy}");
        for (turned, f) in turned_forces.iter().zip(&f) {
            prop_assert!(turned.distance(rotation * *f) < 1e-8 * size, "{turned} for {f}");
        }

        let [sum, torque] = momenta(&x, &f);
        prop_assert!(sum < 1e-12 * size * (n as f64).sqrt(), "{sum} of {size}");
        prop_assert!(torque < 1e-11 * size * (n as f64).sqrt(), "{torque} of {size}");

        let (ku, kv) = (product(&mut body, &u), product(&mut body, &v));
        let stiff = dot(&ku, &ku).sqrt() * moves;
        prop_assert!((dot(&ku, &v) - dot(&kv, &u)).abs() < 1e-11 * stiff, "of {stiff}");
        let change: Vec<DVec3> =
            ahead.1.iter().zip(&behind.1).map(|(a, b)| (*b - *a) / (2.0 * step)).collect();
        let off: f64 = change.iter().zip(&ku).map(|(a, b)| (*a - *b).length_squared()).sum();
        prop_assert!(off.sqrt() < 1e-5 * stiff, "{} of {stiff}", off.sqrt());
    }
}
