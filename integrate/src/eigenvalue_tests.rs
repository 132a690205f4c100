#![allow(clippy::float_cmp, reason = "infinity and exact quotients")]

use super::*;
use crate::testing::Chain;

#[test]
fn chain_matches_the_closed_form() {
    // Fixed-fixed chain of n masses: lambda = 4 k/m sin^2(pi n / (2 (n + 1))), Rayleigh 1877.
    let chain = Chain::new(40, 900.0, 0.02);
    let settings = EigenvalueSettings {
        iterations: 200,
        tolerance: 1e-7,
        margin: 0.0,
    };
    let mut warm = Vec::new();
    let found = chain.eigenvalue(&settings, &mut warm);
    let n = 40.0_f64;
    let sine = (std::f64::consts::PI * n / (2.0 * (n + 1.0))).sin();
    let exact = 4.0 * 900.0 / 0.02 * sine * sine;
    assert!(
        (found.rayleigh / exact - 1.0).abs() < 1e-9,
        "{} against {exact} after {}",
        found.rayleigh,
        found.iterations
    );
    let again = chain.eigenvalue(&settings, &mut warm);
    assert!(
        again.iterations <= 2,
        "warm start took {}",
        again.iterations
    );
    assert!(
        (again.critical_step - 2.0 / exact.sqrt()).abs() < 1e-9 / exact.sqrt(),
        "step"
    );
}

#[test]
fn default_settings_stay_within_the_margin() {
    for n in [5, 50, 500] {
        let chain = Chain::new(n, 1.0, 1.0);
        let found = chain.eigenvalue(&EigenvalueSettings::default(), &mut Vec::new());
        let size = f64::from(u32::try_from(n).unwrap());
        let sine = (std::f64::consts::PI * size / (2.0 * (size + 1.0))).sin();
        let exact = 4.0 * sine * sine;
        let ratio = found.value / exact;
        assert!((0.99..=1.03).contains(&ratio), "n {n}: {ratio}");
        assert!(found.iterations <= 60, "budget");
    }
}

#[test]
fn bit_equal_on_repetition() {
    let chain = Chain::new(30, 3.0, 0.5);
    let settings = EigenvalueSettings::default();
    let a = chain.eigenvalue(&settings, &mut Vec::new());
    let b = chain.eigenvalue(&settings, &mut Vec::new());
    assert_eq!(a.rayleigh.to_bits(), b.rayleigh.to_bits(), "same bits");
}

#[test]
fn nothing_free_or_nothing_stiff_allows_any_step() {
    let supports = Supports::fixed(2, &[0, 1]);
    let stiff = |v: &[DVec3], out: &mut [DVec3]| out.copy_from_slice(v);
    let settings = EigenvalueSettings::default();
    let all_held = largest_eigenvalue(&[1.0; 2], &supports, stiff, &mut Vec::new(), &settings);
    assert_eq!(all_held.unwrap().critical_step, f64::INFINITY, "held");
    let slack = |_: &[DVec3], out: &mut [DVec3]| out.fill(DVec3::ZERO);
    let free = Supports::free(2);
    let found = largest_eigenvalue(&[1.0; 2], &free, slack, &mut Vec::new(), &settings);
    assert_eq!(found.unwrap().critical_step, f64::INFINITY, "slack");
}

#[test]
fn errors_name_the_node() {
    let settings = EigenvalueSettings::default();
    let free = Supports::free(2);
    let nan = |_: &[DVec3], out: &mut [DVec3]| {
        out.fill(DVec3::ZERO);
        out[1].y = f64::NAN;
    };
    let error = largest_eigenvalue(&[1.0; 2], &free, nan, &mut Vec::new(), &settings);
    assert_eq!(
        error,
        Err(EigenvalueError::NotFinite { node: 1 }),
        "product"
    );
    let error = largest_eigenvalue(&[1.0, 0.0], &free, nan, &mut Vec::new(), &settings);
    let expected = EigenvalueError::BadMass { node: 1, mass: 0.0 };
    assert_eq!(error, Err(expected), "mass");
}

#[test]
fn viscosity_lowers_the_step() {
    assert_eq!(critical_step(4.0, 0.0), 1.0, "2 / omega");
    let xi = 0.5_f64;
    let expected = (1.0 + xi * xi).sqrt() - xi;
    assert!(
        (critical_step(4.0, 0.5) - expected).abs() < 1e-15,
        "with xi = 0.5"
    );
    assert_eq!(critical_step(0.0, 0.1), f64::INFINITY, "slack");
}
