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

/// Errors of central differences over falling steps; see [`central_sweep`].
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Relative error per step, largest step first.
    pub errors: Vec<f64>,
}

/// Above this an error is truncation and not round-off.
const RESOLVED: f64 = 1e-7;

impl Sweep {
    /// Smallest error met.
    #[must_use]
    pub fn smallest(&self) -> f64 {
        self.errors.iter().fold(f64::INFINITY, |a, b| a.min(*b))
    }

    /// Observed orders of the last two halvings before the error falls below 1e-7; fewer where the
    /// largest step is already that good.
    #[must_use]
    pub fn orders(&self) -> Vec<f64> {
        let resolved = self.errors.iter().take_while(|e| **e > RESOLVED).count();
        let first = resolved.saturating_sub(3);
        let pairs = self.errors[first..resolved].windows(2);
        let orders = pairs.map(|pair| observed_order(pair[0], pair[1], 2.0));
        orders.collect()
    }

    /// Asserts errors down to `accuracy` and orders within 0.2 of two; returns how many orders were
    /// seen.
    #[track_caller]
    pub fn assert_second_order(&self, what: &str, accuracy: f64) -> usize {
        let smallest = self.smallest();
        let errors = &self.errors;
        assert!(smallest <= accuracy, "{what}: {accuracy:e}, {errors:?}");
        let orders = self.orders();
        for order in &orders {
            assert!((order - 2.0).abs() < 0.2, "{what}: {order}, {errors:?}");
        }
        orders.len()
    }
}

/// Central differences `(f(h) - f(-h)) / 2h` of a vector function along a line against its analytic
/// derivative `slope`, `h` halved sixteen times from `step`.
///
/// Errors are the largest component's, relative to the largest component of `slope` (or `floor`, if
/// that is larger): comparing whole vectors leaves no cancellation between components to chance.
/// NaN comes back as infinity.
pub fn central_sweep(
    mut f: impl FnMut(f64) -> Vec<f64>,
    slope: &[f64],
    step: f64,
    floor: f64,
) -> Sweep {
    let scale = slope.iter().fold(floor, |most, s| most.max(s.abs()));
    let mut h = step;
    let mut errors = Vec::new();
    for _ in 0..17 {
        let (ahead, behind) = (f(h), f(-h));
        let mut worst: f64 = 0.0;
        for ((a, b), s) in ahead.iter().zip(&behind).zip(slope) {
            let error = ((a - b) / (2.0 * h) - s).abs() / scale;
            worst = if error <= worst { worst } else { error };
        }
        errors.push(if worst.is_nan() { f64::INFINITY } else { worst });
        h *= 0.5;
    }
    Sweep { errors }
}
