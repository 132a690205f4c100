//! The weight function of the distance.

/// Radial weight `w(q) = (1 − q²)³` of `q = r / h ≥ 0`, zero from `q = 1` on, where two derivatives are
/// continuous (Aras 2014, eqs. (15)–(16)).
///
/// Not normalised to unit integral: moving least squares divides the factor out.
#[must_use]
pub fn kernel(q: f64) -> f64 {
    if q >= 1.0 {
        return 0.0;
    }
    let s = 1.0 - q * q;
    s * s * s
}

/// Derivative `dw/dq` of [`kernel`] for `q ≥ 0`; 0 from `q = 1` on.
#[must_use]
pub fn kernel_slope(q: f64) -> f64 {
    if q >= 1.0 {
        return 0.0;
    }
    let s = 1.0 - q * q;
    -6.0 * q * s * s
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::derivative::directional_error;
    use testkit::tol::{assert_below, assert_within};

    #[test]
    fn slope_matches_central_differences() {
        for q in [0.05, 0.2, 0.45, 0.55, 0.8, 0.95] {
            let error = directional_error(|t| kernel(q + t), kernel_slope(q), 0.004, 1e-3);
            assert_below("slope", error, 1e-8);
        }
    }

    #[test]
    fn falls_from_one_to_zero_and_stays_there() {
        assert_within("at 0", kernel(0.0), 1.0, 0.0);
        assert_within("slope at 0", kernel_slope(0.0), 0.0, 0.0);
        assert_within("before 1", kernel(1.0 - 1e-9), 0.0, 1e-17);
        let mut last = 1.0;
        for step in 1..=120 {
            let value = kernel(f64::from(step) / 100.0);
            assert!(value <= last && value >= 0.0, "rises at {step}");
            last = value;
        }
        assert_within("at 1", kernel(1.0), 0.0, 0.0);
        assert_within("slope beyond", kernel_slope(1.5), 0.0, 0.0);
    }

    #[test]
    fn polynomial_is_the_expanded_form_of_equation_15() {
        for step in 0..100 {
            let q = f64::from(step) / 100.0;
            let expanded = 1.0 - 3.0 * q.powi(2) + 3.0 * q.powi(4) - q.powi(6);
            assert_within("eq. 15", kernel(q), expanded, 4.0 * f64::EPSILON);
        }
    }
}
