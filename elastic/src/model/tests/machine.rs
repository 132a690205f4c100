//! What the machine must not change: threads, vector instructions, precision; memory.

use super::*;
use crate::forces::PARALLEL_NODES;

#[test]
fn any_thread_count_gives_the_same_bits() {
    let block = Block::new([13, 12, 12], DVec3::splat(1.0), 0.2, 5);
    assert!(block.node_count() > 2 * PARALLEL_NODES);
    let x = shaken(&block, 0.01, 1);
    let v = shaken(&block, 0.5, 2);
    let run = |threads: usize| {
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| {
            let mut body = model(&block, Material::neo_hookean(1.0, 0.4), 0.1);
            let mut f = vec![DVec3::ZERO; x.len()];
            let mut kv = f.clone();
            let energy = body.forces_into(&x, &mut f);
            body.tangent_product_into(&v, &mut kv);
            (energy.to_bits(), f, kv)
        })
    };
    let serial = run(1);
    for threads in [2, 3, 7] {
        assert!(run(threads) == serial, "{threads} threads differ");
    }
}

#[test]
fn threads_do_not_change_the_bits_of_any_option() {
    let block = Block::new([13, 12, 12], DVec3::splat(1.0), 0.2, 5);
    let x = shaken(&block, 0.005, 1);
    let v = shaken(&block, 0.5, 2);
    for settings in [
        mean(),
        Settings {
            precision: Precision::Single,
            ..Settings::default()
        },
    ] {
        let run = |threads: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads").install(|| {
                let mut body = built(&block, Material::neo_hookean(1.0, 0.4), &settings);
                let mut f = vec![DVec3::ZERO; x.len()];
                let mut kv = f.clone();
                let energy = body.forces_into(&x, &mut f);
                body.tangent_product_into(&v, &mut kv);
                (energy.to_bits(), f, kv)
            })
        };
        assert!(run(1) == run(3), "{settings:?}");
    }
}

/// Whatever width the processor offers, every lane sees the same operations in the same order; what
/// rounds products and sums separately gives the same forces but for round-off.
#[test]
fn the_processor_does_not_change_the_bits() {
    let mut plain = Block::new([9, 8, 8], DVec3::splat(1.0), 0.2, 5);
    let corrected = plain.clone();
    plain.use_plain_gradients();
    let x = shaken(&corrected, 0.005, 1);
    let v = shaken(&corrected, 0.5, 2);
    for (block, precision, zero_energy_control, dilatation) in [
        (&corrected, Precision::Double, 0.1, Dilatation::Local),
        (&corrected, Precision::Single, 0.1, Dilatation::Mean),
        (&corrected, Precision::Double, 0.0, Dilatation::Mean),
        (&plain, Precision::Double, 0.1, Dilatation::Local),
        (&plain, Precision::Single, 0.1, Dilatation::Local),
        (&plain, Precision::Single, 0.0, Dilatation::Local),
    ] {
        let run = |instructions: Instructions, arch: Option<pulp::Arch>| {
            let settings = Settings {
                zero_energy_control,
                precision,
                dilatation,
                instructions,
            };
            let mut body = built(block, Material::neo_hookean(1.0, 0.4), &settings);
            if let Some(arch) = arch {
                body.model.arch = arch;
            }
            let mut f = vec![DVec3::ZERO; x.len()];
            let mut kv = f.clone();
            let energy = body.forces_into(&x, &mut f);
            body.tangent_product_into(&v, &mut kv);
            (energy, f, kv)
        };
        let (energy, f, kv) = run(Instructions::Native, None);
        #[cfg(target_arch = "x86_64")]
        if let Some(narrower) = pulp::x86::V3::try_new() {
            let same = run(Instructions::Native, Some(pulp::Arch::V3(narrower)));
            assert!(same == (energy, f.clone(), kv.clone()), "{precision:?}");
        }
        let portable = run(Instructions::Portable, None);
        let allowed = match precision {
            Precision::Double => 1e-12,
            Precision::Single => 1e-6,
        };
        assert_within("energy", portable.0, energy, allowed * energy);
        for (a, b) in [(&portable.1, &f), (&portable.2, &kv)] {
            let scale = b.iter().map(|b| b.length()).fold(0.0, f64::max);
            for (a, b) in a.iter().zip(b) {
                assert_below("portable", (*a - *b).length(), allowed * scale);
            }
        }
    }
}

/// f32 pairs agree with f64 ones to their own rounding, also far from the origin.
#[test]
fn single_precision_follows_double() {
    let block = block();
    let single = Settings {
        precision: Precision::Single,
        ..Settings::default()
    };
    let material = fibrous(Material::neo_hookean(1.0, 0.4));
    let mut coarse = built(&block, material, &single);
    let mut fine = model(&block, material, 0.1);
    assert!(coarse.bytes() < fine.bytes());
    for shift in [0.0, 1e3] {
        let mut x = shaken(&block, 0.01, 3);
        for x in &mut x {
            x.y += shift;
        }
        let mut f = vec![DVec3::ZERO; x.len()];
        let mut g = f.clone();
        let e0 = coarse.forces_into(&x, &mut f);
        let e1 = fine.forces_into(&x, &mut g);
        let scale = g.iter().map(|g| g.length()).fold(0.0, f64::max);
        // 1e3 away the virtual work of round-off forces on u enters the energy.
        assert_within("energy", e0, e1, 1e-6 * e1 + 1e-6 * scale * shift);
        for (f, g) in f.iter().zip(&g) {
            assert_below("force", (*f - *g).length(), 2e-6 * scale);
        }
        coarse.tangent_product_into(&x, &mut f);
        fine.tangent_product_into(&x, &mut g);
        let scale = g.iter().map(|g| g.length()).fold(0.0, f64::max);
        for (f, g) in f.iter().zip(&g) {
            assert_below("product", (*f - *g).length(), 1e-5 * scale);
        }
    }
    let energy = coarse.forces_into(&block.positions, &mut vec![DVec3::ZERO; block.node_count()]);
    assert!(energy == 0.0, "at rest {energy}");
}

/// What the README states: bytes per node and pair, and nothing for what is not used.
#[test]
fn memory_is_what_the_readme_states() {
    let block = Block::new([9, 9, 9], DVec3::ONE, 0.0, 1);
    let (n, pairs) = (block.node_count(), block.indices.len());
    let plain = Material::neo_hookean(1.0, 0.4);
    let single = Settings {
        precision: Precision::Single,
        ..Settings::default()
    };
    // Unused lanes of the last block, one material, one partial energy per chunk.
    let fixed = 8192;
    let within = |what: &str, bytes: usize, stated: usize| {
        assert!(
            (stated..stated + fixed).contains(&bytes),
            "{what}: {bytes} bytes, stated {stated}"
        );
    };
    let double = built(&block, plain, &Settings::default()).bytes();
    within("f64", double, 541 * n + 8 * pairs);
    let f32_bytes = built(&block, plain, &single).bytes();
    within("f32", f32_bytes, 309 * n + 8 * pairs);
    // Without zero-energy control there is nothing of it.
    let bare = |settings: Settings| Settings {
        zero_energy_control: 0.0,
        ..settings
    };
    let bytes = built(&block, plain, &bare(Settings::default())).bytes();
    within("f64, no control", bytes, 477 * n + 8 * pairs);
    let bytes = built(&block, plain, &bare(single)).bytes();
    within("f32, no control", bytes, 273 * n + 8 * pairs);
    // Nor of multipliers.
    let mut least_squares = block.clone();
    least_squares.use_plain_gradients();
    let bytes = built(&least_squares, plain, &Settings::default()).bytes();
    within("f64, no multipliers", bytes, 357 * n + 8 * pairs);
    let bytes = built(&least_squares, plain, &single).bytes();
    within("f32, no multipliers", bytes, 233 * n + 8 * pairs);
    let means = built(&block, plain, &mean()).bytes();
    within("mean dilatation", means - double, 48 * n + 4 * pairs);
    let term = PronyTerm {
        ratio: 1.0,
        relaxation_time: 1.0,
    };
    let viscous = built(&block, plain.with_prony(&[term]), &Settings::default()).bytes();
    within("one Prony term", viscous - double, 248 * n);
    let fibrous = built(&block, fibrous(plain), &Settings::default()).bytes();
    assert_eq!(
        fibrous, double,
        "fibers of a material take nothing per node"
    );
}
