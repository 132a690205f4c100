//! Bases of the local approximation.

use glam::DVec3;

/// Number of space dimensions a basis spans; points are `DVec3` with the unused components 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// Functions of x.
    One,
    /// Functions of x and y.
    Two,
    /// Functions of x, y and z.
    Three,
}

impl Dimension {
    /// The number itself.
    #[must_use]
    pub fn count(self) -> usize {
        match self {
            Self::One => 1,
            Self::Two => 2,
            Self::Three => 3,
        }
    }

    /// Axes of the mixed quadratic terms, in the order xy, yz, xz.
    fn mixed(self) -> &'static [[usize; 2]] {
        match self {
            Self::One => &[],
            Self::Two => &[[0, 1]],
            Self::Three => &[[0, 1], [1, 2], [0, 2]],
        }
    }

    /// A point without the coordinates that the dimension does not have.
    pub(crate) fn flatten(self, x: DVec3) -> DVec3 {
        match self {
            Self::One => DVec3::new(x.x, 0.0, 0.0),
            Self::Two => DVec3::new(x.x, x.y, 0.0),
            Self::Three => x,
        }
    }
}

/// Order of a complete polynomial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Order {
    /// `[1]`: Shepard's method.
    Constant,
    /// `[1, x, y, z]` (Aras 2014, eq. (21) in 2D).
    Linear,
    /// `[1, x, y, z, x², y², z², xy, yz, xz]` (Aras 2014, eq. (20) in 1D).
    Quadratic,
}

/// Basis `p(x)` of a moving-least-squares approximation.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Basis {
    /// Complete polynomials.
    Polynomial {
        /// Order of the polynomials.
        order: Order,
        /// Coordinates they depend on.
        dimension: Dimension,
    },
    /// Intrinsic basis of a crack tip in 2D (Aras 2014, eq. (33)): `[1, x, y]` and
    /// `√r sin θ/2, √r cos θ/2, √r sin θ/2 sin θ, √r cos θ/2 sin θ`.
    CrackTip {
        /// Tip (m); r and θ are measured from it in the xy plane.
        tip: DVec3,
        /// Angle of the crack's extension ahead of the tip to the x axis (rad); the crack itself
        /// lies at `θ = ±π`.
        angle: f64,
    },
}

/// Most functions a basis has.
pub(crate) const LARGEST_BASIS: usize = 10;

/// Values of all functions of a basis, unused positions 0.
pub(crate) type BasisValues = [f64; LARGEST_BASIS];

impl Basis {
    /// Shorthand for [`Basis::Polynomial`].
    #[must_use]
    pub fn polynomial(order: Order, dimension: Dimension) -> Self {
        Self::Polynomial { order, dimension }
    }

    /// Number of functions m.
    #[must_use]
    pub fn size(self) -> usize {
        match self {
            Self::Polynomial { order, dimension } => {
                let d = dimension.count();
                match order {
                    Order::Constant => 1,
                    Order::Linear => 1 + d,
                    Order::Quadratic => (d + 1) * (d + 2) / 2,
                }
            }
            Self::CrackTip { .. } => 7,
        }
    }

    /// Dimension of the space the basis lives in.
    #[must_use]
    pub fn dimension(self) -> Dimension {
        match self {
            Self::Polynomial { dimension, .. } => dimension,
            Self::CrackTip { .. } => Dimension::Two,
        }
    }

    /// Functions at `at`; polynomials in `(at − origin) / scale`, branch functions with r in
    /// units of `scale`.
    pub(crate) fn values(self, at: DVec3, origin: DVec3, scale: f64) -> BasisValues {
        let mut p = [0.0; LARGEST_BASIS];
        p[0] = 1.0;
        let s = (at - origin) / scale;
        match self {
            Self::Polynomial { order, dimension } => {
                let (d, s) = (dimension.count(), s.to_array());
                if order != Order::Constant {
                    p[1..=d].copy_from_slice(&s[..d]);
                }
                if order == Order::Quadratic {
                    for (square, s) in p[1 + d..].iter_mut().zip(&s[..d]) {
                        *square = s * s;
                    }
                    for (mixed, &[a, b]) in p[1 + 2 * d..].iter_mut().zip(dimension.mixed()) {
                        *mixed = s[a] * s[b];
                    }
                }
            }
            Self::CrackTip { tip, angle } => {
                p[1] = s.x;
                p[2] = s.y;
                let (root, theta) = polar((at - tip) / scale, angle);
                let (half_sin, half_cos) = (0.5 * theta).sin_cos();
                p[3] = root * half_sin;
                p[4] = root * half_cos;
                p[5] = p[3] * theta.sin();
                p[6] = p[4] * theta.sin();
            }
        }
        p
    }

    /// Gradients (1/m) of the functions at `at`, as [`Basis::values`] scales them.
    pub(crate) fn gradients(self, at: DVec3, origin: DVec3, scale: f64) -> [BasisValues; 3] {
        let mut g = [[0.0; LARGEST_BASIS]; 3];
        let s = (at - origin) / scale;
        let one = 1.0 / scale;
        match self {
            Self::Polynomial { order, dimension } => {
                let (d, s) = (dimension.count(), s.to_array());
                for (axis, row) in g.iter_mut().enumerate().take(d) {
                    if order != Order::Constant {
                        row[1 + axis] = one;
                    }
                    if order == Order::Quadratic {
                        row[1 + d + axis] = 2.0 * s[axis] * one;
                    }
                }
                if order == Order::Quadratic {
                    for (k, &[a, b]) in dimension.mixed().iter().enumerate() {
                        g[a][1 + 2 * d + k] = s[b] * one;
                        g[b][1 + 2 * d + k] = s[a] * one;
                    }
                }
            }
            Self::CrackTip { tip, angle } => {
                g[0][1] = one;
                g[1][2] = one;
                let (sin, cos) = angle.sin_cos();
                let (root, t) = polar((at - tip) / scale, angle);
                let (s1, c1) = t.sin_cos();
                let (sh, ch) = (0.5 * t).sin_cos();
                // √r f(θ): ∂_r = f / (2√r), ∂_θ / r = f' / √r.
                let radial = [sh, ch, sh * s1, ch * s1].map(|f| 0.5 * f / root);
                let angular = [
                    0.5 * ch,
                    -0.5 * sh,
                    0.5 * ch * s1 + sh * c1,
                    -0.5 * sh * s1 + ch * c1,
                ]
                .map(|f| f / root);
                for k in 0..4 {
                    let along = radial[k] * c1 - angular[k] * s1;
                    let across = radial[k] * s1 + angular[k] * c1;
                    g[0][3 + k] = (cos * along - sin * across) * one;
                    g[1][3 + k] = (sin * along + cos * across) * one;
                }
            }
        }
        g
    }
}

/// `√r` and θ about a crack's tip, θ from the crack's extension.
fn polar(from: DVec3, angle: f64) -> (f64, f64) {
    let (sin, cos) = angle.sin_cos();
    let (x, y) = (cos * from.x + sin * from.y, cos * from.y - sin * from.x);
    (x.hypot(y).sqrt(), y.atan2(x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branch_function_jumps_across_the_crack_only() {
        let basis = Basis::CrackTip {
            tip: DVec3::ZERO,
            angle: 0.0,
        };
        let jump = |x: f64| {
            let above = basis.values(DVec3::new(x, 1e-12, 0.0), DVec3::ZERO, 1.0);
            let below = basis.values(DVec3::new(x, -1e-12, 0.0), DVec3::ZERO, 1.0);
            (above[3] - below[3]).abs()
        };
        assert!((jump(-0.25) - 1.0).abs() < 1e-9);
        assert!(jump(0.25) < 1e-9);
    }
}
