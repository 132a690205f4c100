//! What the machine must not change: threads, vector instructions; memory.

use super::*;
use crate::kernel::storage::PARALLEL_NODES;

#[test]
fn any_thread_count_gives_the_same_bits_with_any_option() {
    let block = Block::new([13, 12, 12], DVec3::splat(1.0), 0.2, 5);
    assert!(block.node_count() > 2 * PARALLEL_NODES);
    let (x, v) = (shaken(&block, 0.005, 1), shaken(&block, 0.5, 2));
    for settings in [Settings::default(), mean(), controlled(0.0)] {
        let run = || {
            let mut body = built(&block, Material::neo_hookean(1.0, 0.4), &settings);
            let (energy, f) = evaluated(&mut body, &x);
            let read = body.smoothed_positions(&x);
            (energy.to_bits(), f, product(&mut body, &v), read)
        };
        let serial = testkit::on_threads(1, run);
        for threads in [2, 3, 7] {
            let same = testkit::on_threads(threads, run) == serial;
            assert!(same, "{threads} threads differ: {settings:?}");
        }
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
                ..Settings::default()
            };
            let mut body = built(block, Material::neo_hookean(1.0, 0.4), &settings);
            if let Some(arch) = arch {
                body.model.arch = arch;
            }
            let (energy, f) = evaluated(&mut body, &x);
            (energy, f, product(&mut body, &v))
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
            let scale = largest(b);
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
    let usual = Settings::default();
    let all =
        |block: &Block, material, settings: &Settings| built(block, material, settings).bytes().all;
    let double = all(&block, plain, &usual);
    within("default", double, 541 * n + 8 * pairs);
    // Without hourglass stabilization there is nothing of it.
    let bytes = all(&block, plain, &controlled(0.0));
    within("no control", bytes, 477 * n + 8 * pairs);
    // Nor of multipliers.
    let mut least_squares = block.clone();
    least_squares.use_plain_gradients();
    let bytes = all(&least_squares, plain, &usual);
    within("no multipliers", bytes, 357 * n + 8 * pairs);
    let means = all(&block, plain, &mean());
    within("mean dilatation", means - double, 48 * n + 4 * pairs);
    let viscous = all(&block, plain.with_prony(&[term(1.0, 1.0)]), &usual);
    within("one Prony term", viscous - double, 248 * n);
    let fibrous = all(&block, fibrous(plain), &usual);
    assert_eq!(fibrous, double, "fibers take nothing per node");
}
