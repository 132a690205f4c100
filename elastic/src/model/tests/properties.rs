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
/// much as before, multipliers and scales are any, and `B_i` follows from them.
fn any_rows() -> impl Strategy<Value = (Block, u64)> {
    let cells = (2..4_usize, 2..4_usize, 2..4_usize);
    (cells, any::<u64>()).prop_map(|((a, b, c), seed)| {
        let mut block = Block::new([a, b, c], DVec3::new(0.4, 0.35, 0.3), 0.2, seed);
        let mut random = Random::new(seed);
        let n = block.node_count();
        for i in 0..n {
            for p in block.row(i) {
                let j = block.indices[p] as usize;
                if j < i {
                    continue;
                }
                let back = block.row(j);
                let at = block.indices[back.clone()]
                    .iter()
                    .position(|k| *k as usize == i);
                let back = back.start + at.expect("the graph is symmetric");
                #[allow(
                    clippy::cast_possible_truncation,
                    reason = "weights have the digits of an f32"
                )]
                let weight = f64::from((block.weights[p] * random.range(0.05, 1.0)) as f32);
                (block.weights[p], block.weights[back]) = (weight, weight);
            }
        }
        for i in 0..n {
            block.multipliers[i] = random.vector(0.1);
            block.scales[i] = random.range(-0.3, 0.3);
        }
        for i in 0..n {
            let (mut moments, mut mixed) = (DMat3::ZERO, DMat3::ZERO);
            for p in block.row(i) {
                let j = block.indices[p] as usize;
                let (x, weight) = (block.offset(i, p), block.weights[p]);
                let along = block.multipliers[j] - block.multipliers[i];
                moments += outer(x, x) * weight;
                mixed += outer(x, along) * weight;
            }
            let rest = DMat3::IDENTITY - mixed * block.scales[i];
            block.matrices[i] = (moments.inverse() * rest).transpose();
        }
        (block, seed)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

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
