//! Tolerances. NaN never passes; a failure prints both values, the difference and what was allowed.

/// True if `TOL_SCALE=0` asks to print the real residuals.
#[must_use]
pub fn print_residuals() -> bool {
    std::env::var("TOL_SCALE").is_ok_and(|value| value == "0")
}

/// Asserts `|a − b| ≤ allowed`, with `what` in the message.
#[track_caller]
pub fn assert_within(what: &str, a: f64, b: f64, allowed: f64) {
    let difference = (a - b).abs();
    assert!(
        difference <= allowed,
        "{what}: |{a:e} - {b:e}| = {difference:e} exceeds {allowed:e}"
    );
}

/// Asserts `|a − b| ≤ relative · max(|a|, |b|, scale)`.
#[track_caller]
pub fn assert_relative(what: &str, a: f64, b: f64, scale: f64, relative: f64) {
    assert_within(what, a, b, relative * a.abs().max(b.abs()).max(scale));
}

/// Asserts `value ≤ allowed`; NaN fails.
#[track_caller]
pub fn assert_below(what: &str, value: f64, allowed: f64) {
    assert!(value <= allowed, "{what}: {value:e} exceeds {allowed:e}");
}

/// Round-off allowance `c · ε · n · scale` for a sum of `n` terms of size `scale`.
#[must_use]
pub fn round_off(c: f64, n: usize, scale: f64) -> f64 {
    c * f64::EPSILON * n.max(1) as f64 * scale
}
