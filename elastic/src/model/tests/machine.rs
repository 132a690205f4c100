//! What the machine must not change: threads, vector instructions, precision; memory.

use super::*;

#[test]
fn any_thread_count_gives_the_same_bits() {
    let block = Block::new([13, 12, 12], DVec3::splat(1.0), 0.2, 5);
    assert!(block.node_count() > 2 * evaluate::PARALLEL_NODES);
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

/// Whatever width the processor offers, every lane sees the same operations in the same order.
#[test]
fn the_processor_does_not_change_the_bits() {
    let block = Block::new([9, 8, 8], DVec3::splat(1.0), 0.2, 5);
    let x = shaken(&block, 0.005, 1);
    let v = shaken(&block, 0.5, 2);
    for (precision, zero_energy_control) in [
        (Precision::Double, 0.1),
        (Precision::Single, 0.1),
        (Precision::Double, 0.0),
        (Precision::Single, 0.0),
    ] {
        for dilatation in [Dilatation::Local, Dilatation::Mean] {
            let settings = Settings {
                zero_energy_control,
                precision,
                dilatation,
            };
            let run = |baseline: bool| {
                let mut body = built(&block, Material::neo_hookean(1.0, 0.4), &settings);
                if baseline {
                    with_table!(&mut body.pairs, table => table.rows.arch = pulp::Arch::Scalar);
                }
                let mut f = vec![DVec3::ZERO; x.len()];
                let mut kv = f.clone();
                let energy = body.forces_into(&x, &mut f);
                body.tangent_product_into(&v, &mut kv);
                (energy.to_bits(), f, kv)
            };
            assert!(run(false) == run(true), "{settings:?}");
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
    // Offsets, one material, one partial energy per chunk.
    let fixed = 1024;
    let within = |what: &str, bytes: usize, stated: usize| {
        assert!(
            (stated..stated + fixed).contains(&bytes),
            "{what}: {bytes} bytes, stated {stated}"
        );
    };
    let double = built(&block, plain, &Settings::default()).bytes();
    within("f64", double, 477 * n + 68 * pairs);
    let f32_bytes = built(&block, plain, &single).bytes();
    within("f32", f32_bytes, 381 * n + 36 * pairs);
    // Without zero-energy control there is nothing of it.
    let bare = |settings: Settings| Settings {
        zero_energy_control: 0.0,
        ..settings
    };
    let bytes = built(&block, plain, &bare(Settings::default())).bytes();
    within("f64, no control", bytes, 237 * n + 52 * pairs);
    let bytes = built(&block, plain, &bare(single)).bytes();
    within("f32, no control", bytes, 201 * n + 28 * pairs);
    let means = built(&block, plain, &mean()).bytes();
    within("mean dilatation", means - double, 112 * n + 8 * pairs);
    let term = PronyTerm {
        ratio: 1.0,
        relaxation_time: 1.0,
    };
    let viscous = built(&block, plain.with_prony(&[term]), &Settings::default()).bytes();
    within("one Prony term", viscous - double, 144 * n);
    let fibrous = built(&block, fibrous(plain), &Settings::default()).bytes();
    assert_eq!(
        fibrous, double,
        "fibers of a material take nothing per node"
    );
}
