//! What the machine must not change: threads, vector instructions; memory.

use super::*;
use crate::kernel::storage::PARALLEL_NODES;

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
    for settings in [mean(), bare()] {
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
    for (block, stabilization, dilatation) in [
        (&corrected, 0.1, Dilatation::Local),
        (&corrected, 0.0, Dilatation::Mean),
        (&plain, 0.1, Dilatation::Local),
        (&plain, 0.0, Dilatation::Local),
    ] {
        let run = |arch: Option<pulp::Arch>| {
            let settings = Settings {
                stabilization,
                dilatation,
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
        let (energy, f, kv) = run(None);
        #[cfg(target_arch = "x86_64")]
        if let Some(narrower) = pulp::x86::V3::try_new() {
            let same = run(Some(pulp::Arch::V3(narrower)));
            assert!(same == (energy, f.clone(), kv.clone()), "{dilatation:?}");
        }
        let portable = run(Some(pulp::Arch::Scalar));
        let allowed = 1e-12;
        assert_within("energy", portable.0, energy, allowed * energy);
        for (a, b) in [(&portable.1, &f), (&portable.2, &kv)] {
            let scale = b.iter().map(|b| b.length()).fold(0.0, f64::max);
            for (a, b) in a.iter().zip(b) {
                assert_below("portable", (*a - *b).length(), allowed * scale);
            }
        }
    }
}

/// What the README states: bytes per node and pair, and nothing for what is not used.
#[test]
fn memory_is_what_the_readme_states() {
    let block = Block::new([9, 9, 9], DVec3::ONE, 0.0, 1);
    let (n, pairs) = (block.node_count(), block.indices.len());
    let plain = Material::neo_hookean(1.0, 0.4);
    // Unused lanes of the last block, one material, one partial energy per chunk.
    let fixed = 8192;
    let within = |what: &str, bytes: usize, stated: usize| {
        assert!(
            (stated..stated + fixed).contains(&bytes),
            "{what}: {bytes} bytes, stated {stated}"
        );
    };
    let double = built(&block, plain, &Settings::default()).bytes().all;
    within("default", double, 541 * n + 8 * pairs);
    // Without hourglass stabilization there is nothing of it.
    let bytes = built(&block, plain, &bare()).bytes().all;
    within("no control", bytes, 477 * n + 8 * pairs);
    // Nor of multipliers.
    let mut least_squares = block.clone();
    least_squares.use_plain_gradients();
    let bytes = built(&least_squares, plain, &Settings::default())
        .bytes()
        .all;
    within("no multipliers", bytes, 357 * n + 8 * pairs);
    let means = built(&block, plain, &mean()).bytes().all;
    within("mean dilatation", means - double, 48 * n + 4 * pairs);
    let term = PronyTerm {
        ratio: 1.0,
        relaxation_time: 1.0,
    };
    let viscous = built(&block, plain.with_prony(&[term]), &Settings::default())
        .bytes()
        .all;
    within("one Prony term", viscous - double, 248 * n);
    let fibrous = built(&block, fibrous(plain), &Settings::default())
        .bytes()
        .all;
    assert_eq!(
        fibrous, double,
        "fibers of a material take nothing per node"
    );
}
