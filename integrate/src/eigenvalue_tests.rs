#![allow(clippy::float_cmp, reason = "infinity and exact quotients")]

use super::*;
use crate::testing::Chain;
use testkit::tol::assert_within;

/// Of a fixed-fixed chain of n masses: lambda = 4 k/m sin^2(pi n / (2 (n + 1))), Rayleigh 1877.
fn exact(n: usize, stiffness_over_mass: f64) -> f64 {
    let n = n as f64;
    let sine = (std::f64::consts::PI * n / (2.0 * (n + 1.0))).sin();
    4.0 * stiffness_over_mass * sine * sine
}

#[test]
fn chain_matches_the_closed_form() {
    let chain = Chain::new(40, 900.0, 0.02);
    let settings = EigenvalueSettings {
        iterations: 200,
        tolerance: 1e-7,
        margin: 0.0,
    };
    let mut warm = Vec::new();
    let found = chain.eigenvalue(&settings, &mut warm);
    let exact = exact(40, 900.0 / 0.02);
    assert_within("eigenvalue", found.rayleigh / exact, 1.0, 1e-9);
    let again = chain.eigenvalue(&settings, &mut warm);
    assert!(again.iterations <= 2, "warm start: {again:?}");
    let step = again.critical_step * exact.sqrt();
    assert_within("step", step, 2.0, 1e-9);
}

#[test]
fn default_settings_stay_within_the_margin() {
    for n in [5, 50, 500] {
        let chain = Chain::new(n, 1.0, 1.0);
        let found = chain.eigenvalue(&EigenvalueSettings::default(), &mut Vec::new());
        let ratio = found.value / exact(n, 1.0);
        assert!((0.99..=1.03).contains(&ratio), "n {n}: {ratio}");
        assert!(found.iterations <= 60, "budget");
    }
}

#[test]
fn nothing_free_or_nothing_stiff_allows_any_step() {
    let supports = BoundaryConditions::fixed(2, &[0, 1]);
    let stiff = |v: &[DVec3], out: &mut [DVec3]| out.copy_from_slice(v);
    let settings = EigenvalueSettings::default();
    let all_held = largest_eigenvalue(&[1.0; 2], &supports, stiff, &mut Vec::new(), &settings);
    assert_eq!(all_held.unwrap().critical_step, f64::INFINITY, "held");
    let slack = |_: &[DVec3], out: &mut [DVec3]| out.fill(DVec3::ZERO);
    let free = BoundaryConditions::free(2);
    let found = largest_eigenvalue(&[1.0; 2], &free, slack, &mut Vec::new(), &settings);
    assert_eq!(found.unwrap().critical_step, f64::INFINITY, "slack");
}

#[test]
fn errors_name_the_node() {
    let settings = EigenvalueSettings::default();
    let free = BoundaryConditions::free(2);
    let nan = |_: &[DVec3], out: &mut [DVec3]| {
        out.fill(DVec3::ZERO);
        out[1].y = f64::NAN;
    };
    let error = largest_eigenvalue(&[1.0; 2], &free, nan, &mut Vec::new(), &settings);
    let expected = EigenvalueError::NotFinite { node: 1 };
    assert_eq!(error, Err(expected), "product");
    let error = largest_eigenvalue(&[1.0, 0.0], &free, nan, &mut Vec::new(), &settings);
    let expected = EigenvalueError::BadMass { node: 1, mass: 0.0 };
    assert_eq!(error, Err(expected), "mass");
}

#[test]
fn viscosity_lowers_the_step() {
    assert_eq!(critical_step(4.0, 0.0), 1.0, "2 / omega");
    let xi = 0.5_f64;
    let expected = (1.0 + xi * xi).sqrt() - xi;
    assert_within("with xi = 0.5", critical_step(4.0, 0.5), expected, 1e-15);
    let strong = critical_step(1e40, 1.0);
    assert_within("not lost to round-off", strong, 2e-40, 1e-53);
    assert_eq!(critical_step(0.0, 0.1), f64::INFINITY, "slack");
}

/// Shares in threads, which lay vectors and sums into lists of all.
struct Meeting {
    barrier: std::sync::Barrier,
    vectors: std::sync::Mutex<Vec<DVec3>>,
    sums: std::sync::Mutex<Vec<Vec<f64>>>,
}

fn in_shares(
    chain: &Chain,
    supports: &BoundaryConditions,
    starts: &[usize],
    settings: &EigenvalueSettings,
    product: &(impl Fn(&[DVec3], &mut [DVec3]) + Sync),
) -> Vec<(Result<Eigenvalue, EigenvalueError>, Vec<DVec3>)> {
    let n = chain.masses.len();
    let meeting = Meeting {
        barrier: std::sync::Barrier::new(starts.len()),
        vectors: std::sync::Mutex::new(vec![DVec3::ZERO; n]),
        sums: std::sync::Mutex::new(vec![Vec::new(); starts.len()]),
    };
    let share = |number: usize| {
        let range = starts[number]..starts.get(number + 1).copied().unwrap_or(n);
        let stiffness = |v: &[DVec3], out: &mut [DVec3]| {
            meeting.vectors.lock().unwrap()[range.clone()].copy_from_slice(v);
            meeting.barrier.wait();
            let mut all = vec![DVec3::ZERO; n];
            product(&meeting.vectors.lock().unwrap(), &mut all);
            meeting.barrier.wait();
            out.copy_from_slice(&all[range.clone()]);
        };
        let sum = |parts: &[f64]| {
            meeting.sums.lock().unwrap()[number] = parts.to_vec();
            meeting.barrier.wait();
            let all = meeting.sums.lock().unwrap().concat();
            meeting.barrier.wait();
            all.iter().sum()
        };
        let mut vector = Vec::new();
        let share = EigenvalueShare {
            first: range.start,
            masses: &chain.masses[range.clone()],
            supports: &supports.part(range.clone()),
        };
        let found = largest_eigenvalue_of_share(&share, stiffness, sum, &mut vector, settings);
        (found, vector)
    };
    std::thread::scope(|scope| {
        let share = &share;
        let running: Vec<_> = (0..starts.len())
            .map(|number| scope.spawn(move || share(number)))
            .collect();
        let ended = running.into_iter().map(|thread| thread.join().unwrap());
        ended.collect()
    })
}

#[test]
fn shares_find_what_the_whole_finds_to_the_bit() {
    let mut chain = Chain::new(2 * 1024 + 300, 900.0, 0.02);
    for (node, mass) in (0_u32..).zip(&mut chain.masses) {
        *mass *= 1.0 + 0.5 * f64::from(node % 7);
    }
    let mut supports = BoundaryConditions::fixed(chain.masses.len(), &[0, 1500]);
    supports.slide(1024, DVec3::new(1.0, 2.0, 3.0));
    let settings = EigenvalueSettings {
        iterations: 25,
        tolerance: 1e-6,
        ..EigenvalueSettings::default()
    };
    let product = |v: &[DVec3], out: &mut [DVec3]| chain.product(v, out);
    let mut vector = Vec::new();
    let (masses, stiffness) = (&chain.masses, &product);
    let whole = largest_eigenvalue(masses, &supports, stiffness, &mut vector, &settings).unwrap();
    assert!(whole.iterations > 5, "{} products", whole.iterations);
    for starts in [&[0][..], &[0, 1024], &[0, 1024, 2048]] {
        let shares = in_shares(&chain, &supports, starts, &settings, &product);
        let parts = shares.iter().flat_map(|(_, part)| part);
        assert!(parts.eq(&vector), "the vector in {} shares", starts.len());
        for (found, _) in &shares {
            assert_eq!(found.as_ref().unwrap(), &whole, "{} shares", starts.len());
        }
    }
    let broken = |v: &[DVec3], out: &mut [DVec3]| {
        chain.product(v, out);
        out[1030] = DVec3::NAN;
    };
    let shares = in_shares(&chain, &supports, &[0, 1024, 2048], &settings, &broken);
    let nodes = shares.iter().map(|(found, _)| match found {
        Err(EigenvalueError::NotFinite { node }) => *node,
        other => panic!("{other:?}"),
    });
    assert!(nodes.eq([1024, 1030, 2348]), "all shares end");
}

/// A part of a chain, its ends held by the rest, is a chain of its own.
#[test]
fn a_part_with_all_others_held_is_a_chain_of_its_own() {
    let settings = EigenvalueSettings::default();
    let (whole, part) = (Chain::new(20, 900.0, 0.02), Chain::new(6, 900.0, 0.02));
    let nodes: Vec<u32> = (7..13).collect();
    let masses = vec![0.02; 20];
    let mut spread = vec![DVec3::ZERO; 20];
    let mut rows = vec![DVec3::ZERO; 20];
    let within = largest_eigenvalue_within(
        &nodes,
        &masses,
        &BoundaryConditions::free(20),
        |v, out| {
            spread[7..13].copy_from_slice(v);
            whole.product(&spread, &mut rows);
            out.copy_from_slice(&rows[7..13]);
        },
        &mut Vec::new(),
        &settings,
    );
    let alone = part.eigenvalue(&settings, &mut Vec::new());
    let ratio = within.unwrap().value / alone.value;
    assert!((ratio - 1.0).abs() < 1e-12, "{ratio}");
}
