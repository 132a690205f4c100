//! Weight functions of the distance.

/// A radial weight function `w(q)` of `q = r / h`, zero from `q = 1` on.
///
/// Not normalised to unit integral: moving least squares divides the factor out. The baseline
/// [`Kernel::InverseSquare`] is singular at 0 and cut off at `q = 1`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Kernel {
    /// `(1 − q²)³` (Aras 2014, eqs. (15)–(16)); two continuous derivatives at `q = 1`.
    #[default]
    Polynomial,
    /// Cubic B-spline: `1 − 6q² + 6q³` up to ½, then `2(1 − q)³`.
    CubicSpline,
    /// Wendland's C² function `(1 − q)⁴ (4q + 1)`, positive definite up to 3D.
    WendlandC2,
    /// `1/q²` inside the support; scale free, jumps at `q = 1`, infinite at 0.
    InverseSquare,
}

impl Kernel {
    /// All kernels, for studies and tests.
    pub const ALL: [Self; 4] = [
        Self::Polynomial,
        Self::CubicSpline,
        Self::WendlandC2,
        Self::InverseSquare,
    ];

    /// Value `w(q)` for `q ≥ 0`.
    #[must_use]
    pub fn value(self, q: f64) -> f64 {
        if q >= 1.0 {
            return 0.0;
        }
        match self {
            Self::Polynomial => {
                let s = 1.0 - q * q;
                s * s * s
            }
            Self::CubicSpline => {
                if q <= 0.5 {
                    1.0 + 6.0 * q * q * (q - 1.0)
                } else {
                    let s = 1.0 - q;
                    2.0 * s * s * s
                }
            }
            Self::WendlandC2 => {
                let s = (1.0 - q) * (1.0 - q);
                s * s * (4.0 * q + 1.0)
            }
            Self::InverseSquare => 1.0 / (q * q),
        }
    }

    /// Derivative `dw/dq` for `q ≥ 0`; 0 from `q = 1` on.
    #[must_use]
    pub fn derivative(self, q: f64) -> f64 {
        if q >= 1.0 {
            return 0.0;
        }
        match self {
            Self::Polynomial => {
                let s = 1.0 - q * q;
                -6.0 * q * s * s
            }
            Self::CubicSpline => {
                if q <= 0.5 {
                    6.0 * q * (3.0 * q - 2.0)
                } else {
                    let s = 1.0 - q;
                    -6.0 * s * s
                }
            }
            Self::WendlandC2 => {
                let s = 1.0 - q;
                -20.0 * q * s * s * s
            }
            Self::InverseSquare => -2.0 / (q * q * q),
        }
    }

    /// Short name for tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Polynomial => "polynomial",
            Self::CubicSpline => "cubic spline",
            Self::WendlandC2 => "Wendland C2",
            Self::InverseSquare => "inverse square",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::derivative::directional_error;
    use testkit::tol::{assert_below, assert_within};

    #[test]
    fn derivative_matches_central_differences() {
        for kernel in Kernel::ALL {
            for q in [0.05, 0.2, 0.45, 0.55, 0.8, 0.95] {
                let slope = kernel.derivative(q);
                let error = directional_error(|t| kernel.value(q + t), slope, 0.004, 1e-3);
                assert_below(kernel.name(), error, 1e-8);
            }
        }
    }

    #[test]
    fn falls_from_one_to_zero_and_stays_there() {
        for kernel in [Kernel::Polynomial, Kernel::CubicSpline, Kernel::WendlandC2] {
            assert_within(kernel.name(), kernel.value(0.0), 1.0, 0.0);
            assert_within(kernel.name(), kernel.derivative(0.0), 0.0, 0.0);
            assert_within(kernel.name(), kernel.value(1.0 - 1e-9), 0.0, 1e-17);
            let mut last = 1.0;
            for step in 1..=120 {
                let value = kernel.value(f64::from(step) / 100.0);
                assert!(value <= last && value >= 0.0, "{} rises", kernel.name());
                last = value;
            }
        }
        for kernel in Kernel::ALL {
            assert_within(kernel.name(), kernel.value(1.0), 0.0, 0.0);
            assert_within(kernel.name(), kernel.derivative(1.5), 0.0, 0.0);
        }
    }

    #[test]
    fn polynomial_is_the_expanded_form_of_equation_15() {
        for step in 0..100 {
            let q = f64::from(step) / 100.0;
            let expanded = 1.0 - 3.0 * q.powi(2) + 3.0 * q.powi(4) - q.powi(6);
            let value = Kernel::Polynomial.value(q);
            assert_within("eq. 15", value, expanded, 4.0 * f64::EPSILON);
        }
    }
}
