//! Derivative checks by central differences that also look at the order of the error.

/// Largest relative error of an analytic directional derivative against central differences.
///
/// `f(t)` is the function along a line, `slope` its analytic derivative at 0, `step` the largest
/// step tried. The step is divided by 4 six times; the smallest error is returned, relative to
/// `max(|slope|, floor)`. NaN comes back as infinity.
pub fn directional_error(mut f: impl FnMut(f64) -> f64, slope: f64, step: f64, floor: f64) -> f64 {
    let scale = slope.abs().max(floor);
    let mut best = f64::INFINITY;
    let mut h = step;
    for _ in 0..7 {
        let error = ((f(h) - f(-h)) / (2.0 * h) - slope).abs() / scale;
        if error < best {
            best = error;
        }
        h *= 0.25;
    }
    best
}

/// Observed order of convergence between errors at steps `h` and `h / ratio`.
#[must_use]
pub fn observed_order(coarse: f64, fine: f64, ratio: f64) -> f64 {
    (coarse / fine).ln() / ratio.ln()
}
