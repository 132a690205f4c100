//! Energy, stress and tangent in the form in which nodes evaluate them.

use glam::{DMat3, DVec3};

use crate::law::arithmetic::{Arithmetic, Separate};
use crate::law::fiber::Fiber;
use crate::law::material::{Law, Material};
use crate::law::tensor::{cofactor, cofactor_change, double_dot};

/// Below this volume ratio the volumetric energy continues as its own second-order expansion.
///
/// `ln J` ends at `J = 0`. A node squeezed to a tenth of its volume is outside what a soft tissue
/// model claims; what matters there is that energy and stress stay finite, continuous and push back.
pub(crate) const EXTENSION_VOLUME_RATIO: f64 = 0.1;

/// Volume ratio below which a material's barrier resists (see [`Material::with_barrier`]).
pub(crate) const BARRIER_VOLUME_RATIO: f64 = 0.4;

/// Coefficients of a material: `W = c10 (I1-3) + c01 (I2-3) + h(J) + fibers`,
/// `h = -a ln J + b/2 ln²J (extended) - l (J-1) + k/2 (J-1)² + barrier`, or Saint Venant–Kirchhoff with `mu`,
/// `lambda` instead of `c10`, `c01`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Coefficients {
    /// Neo-Hookean without fibers: what the passes evaluate in place.
    plain: bool,
    green: bool,
    c10: f64,
    c01: f64,
    volumetric: Volumetric,
    fiber: Option<Fiber>,
}

/// `-a ln J + b/2 ln²J (extended) - l (J-1) + k/2 (J-1)² + barrier`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Volumetric {
    log: f64,
    log_squared: f64,
    linear: f64,
    constant: f64,
    barrier: f64,
}

/// Value and two derivatives of the barrier at `J`, over its pressure `p`: `0.4 (t³ - t⁴/2)` with
/// `t = (0.4 - J)/0.4`, 0 above `t = 0`, and continuing straight below `J = 0`.
#[inline(always)]
pub(crate) fn barrier<A: Arithmetic>(j: f64) -> [f64; 3] {
    const FROM: f64 = BARRIER_VOLUME_RATIO;
    let (t, inverted) = (((FROM - j) * (1.0 / FROM)).clamp(0.0, 1.0), j.min(0.0));
    let square = t * t;
    [
        A::add(FROM * square * t, A::add(-0.5, t, 1.0), -inverted),
        -square * A::add(-2.0, t, 3.0),
        t * (6.0 / FROM) * (1.0 - t),
    ]
}

impl Volumetric {
    /// Value and two derivatives at `J`.
    #[inline(always)]
    pub(crate) fn at(&self, j: f64) -> [f64; 3] {
        if !self.has_logarithm() {
            return self.with_polynomial(j, [0.0; 3]);
        }
        if j < EXTENSION_VOLUME_RATIO {
            return self.extended(j);
        }
        self.with_polynomial(j, self.logarithmic(j))
    }

    /// Whether `ln J` has a part in it; else it is a polynomial.
    #[inline(always)]
    #[allow(
        clippy::float_cmp,
        reason = "a coefficient that is not there is exactly zero"
    )]
    pub(crate) fn has_logarithm(&self) -> bool {
        self.log != 0.0 || self.log_squared != 0.0
    }

    /// Whether a law in Green's strain has a volumetric part beside it.
    fn resists(&self) -> bool {
        self.constant > 0.0 || self.barrier > 0.0
    }

    #[inline(always)]
    fn logarithmic(&self, j: f64) -> [f64; 3] {
        let (a, b) = (self.log, self.log_squared);
        let ln = ln::<Separate>(j);
        let inverse = j.recip();
        [
            ln * (0.5 * b * ln - a),
            (b * ln - a) * inverse,
            (a + b * (1.0 - ln)) * inverse * inverse,
        ]
    }

    #[inline(always)]
    fn with_polynomial(&self, j: f64, [h, h1, h2]: [f64; 3]) -> [f64; 3] {
        let (k, l, off) = (self.constant, self.linear, j - 1.0);
        let [b, b1, b2] = barrier::<Separate>(j).map(|part| self.barrier * part);
        [
            h + off * (0.5 * k * off - l) + b,
            h1 + (k * off - l) + b1,
            h2 + k + b2,
        ]
    }

    #[cold]
    fn extended(&self, j: f64) -> [f64; 3] {
        let [h, h1, h2] = self.logarithmic(EXTENSION_VOLUME_RATIO);
        let below = j - EXTENSION_VOLUME_RATIO;
        let extended = [h + below * (h1 + 0.5 * h2 * below), h1 + h2 * below, h2];
        self.with_polynomial(j, extended)
    }
}

impl Coefficients {
    pub(crate) fn new(material: &Material) -> Self {
        let mut constant = material.volume_constant;
        let mut linear = 0.0;
        let (mu, lambda) = (material.lame_mu(), material.lame_lambda());
        let (green, c10, c01, log, log_squared) = match material.law {
            Law::NeoHookean { .. } => (false, 0.5 * mu, 0.0, mu, lambda),
            Law::StableNeoHookean { .. } => {
                linear = mu;
                constant += lambda + mu;
                (false, 0.5 * mu, 0.0, 0.0, 0.0)
            }
            Law::SaintVenantKirchhoff { .. } => (true, mu, lambda, 0.0, 0.0),
            Law::MooneyRivlin { c10, c01, .. } => {
                let log = 2.0 * (c10 + 2.0 * c01);
                (false, c10, c01, log, lambda - 4.0 * c01)
            }
        };
        Self {
            plain: !green && c01 == 0.0 && material.fiber.is_none(),
            green,
            c10,
            c01,
            volumetric: Volumetric {
                log,
                log_squared,
                linear,
                constant,
                barrier: material.barrier,
            },
            fiber: material.fiber,
        }
    }

    /// Takes the part of the energy that resists a change of volume out, for mean dilatation. What
    /// stays, `c10 (I1-3)` with the term that makes it stress-free, resists no small dilatation less
    /// than `2/3` of the shear modulus: of the stable law's `(lambda + mu)/2 (J-1)²` the `mu` stays.
    pub(crate) fn split_volumetric(&mut self) -> Volumetric {
        let local = self.volumetric.linear;
        let Volumetric {
            log_squared,
            constant,
            ..
        } = self.volumetric;
        self.volumetric.log_squared = 0.0;
        self.volumetric.constant = local;
        Volumetric {
            log: 0.0,
            log_squared,
            linear: 0.0,
            constant: constant - local,
            barrier: 0.0,
        }
    }

    #[inline(always)]
    pub(crate) fn is_plain(&self) -> bool {
        self.plain
    }

    /// Whether `ln J` has a part in the energy.
    #[inline(always)]
    pub(crate) fn has_logarithm(&self) -> bool {
        self.volumetric.has_logarithm()
    }

    /// `2 c10`, `a`, `b`, `l`, `k` and the barrier of a plain law.
    #[inline(always)]
    pub(crate) fn plain_constants(&self) -> [f64; 6] {
        let v = &self.volumetric;
        [
            2.0 * self.c10,
            v.log,
            v.log_squared,
            v.linear,
            v.constant,
            v.barrier,
        ]
    }

    /// Bound on the largest eigenvalue (Pa) of the tangent `d²W/dF²` at `F` without fibers: `2 c10 +
    /// max(h'', 0) |cof F|² + |h'| |F|` for the neo-Hookean laws, with what `I2` and Green's strain add
    /// by their norms.
    pub(crate) fn tangent_bound(&self, f: DMat3) -> f64 {
        let squares = double_dot(f, f);
        let cof = cofactor(f);
        let [_, h1, h2] = self.volumetric.at(f.x_axis.dot(cof.x_axis));
        let volumetric = h2.max(0.0) * double_dot(cof, cof) + h1.abs() * squares.sqrt();
        if self.green {
            let (mu, lambda) = (self.c10, self.c01);
            let e = (f.transpose() * f - DMat3::IDENTITY) * 0.5;
            let s = self.hooke(e);
            return double_dot(s, s).sqrt()
                + (2.0 * mu + 3.0 * lambda.max(0.0)) * squares
                + volumetric;
        }
        2.0 * self.c10 + 6.0 * self.c01 * squares + volumetric
    }

    /// `c10 (I1 - 3) + h(J)` and its stress; transposes with `F`.
    #[inline(always)]
    pub(crate) fn neo_hookean(&self, f: DMat3) -> (f64, DMat3) {
        let cof = cofactor(f);
        let [h, h1, _] = self.volumetric.at(f.x_axis.dot(cof.x_axis));
        let energy = self.c10 * (double_dot(f, f) - 3.0) + h;
        (energy, f * (2.0 * self.c10) + cof * h1)
    }

    /// Its tangent; transposes with `F` and `dF`.
    #[inline(always)]
    pub(crate) fn neo_hookean_change(&self, f: DMat3, df: DMat3) -> DMat3 {
        let cof = cofactor(f);
        let [_, h1, h2] = self.volumetric.at(f.x_axis.dot(cof.x_axis));
        df * (2.0 * self.c10) + cof * (h2 * double_dot(cof, df)) + cofactor_change(f, df) * h1
    }

    pub(crate) fn energy_and_stress(&self, f: DMat3) -> (f64, DMat3) {
        let (mut energy, mut stress);
        if self.green {
            (energy, stress) = self.green_energy_and_stress(f);
        } else {
            (energy, stress) = self.neo_hookean(f);
            if self.c01 != 0.0 {
                let c = f.transpose() * f;
                let i1 = double_dot(f, f);
                energy += self.c01 * (0.5 * (i1 * i1 - double_dot(c, c)) - 3.0);
                stress += (f * i1 - f * c) * (2.0 * self.c01);
            }
        }
        if let Some(fiber) = &self.fiber {
            let (more, pull) = fiber.energy_and_stress(f);
            energy += more;
            stress += pull;
        }
        (energy, stress)
    }

    fn green_energy_and_stress(&self, f: DMat3) -> (f64, DMat3) {
        let e = (f.transpose() * f - DMat3::IDENTITY) * 0.5;
        let s = self.hooke(e);
        let mut energy = 0.5 * double_dot(s, e);
        let mut stress = f * s;
        if self.volumetric.resists() {
            let cof = cofactor(f);
            let [h, h1, _] = self.volumetric.at(f.x_axis.dot(cof.x_axis));
            energy += h;
            stress += cof * h1;
        }
        (energy, stress)
    }

    /// `lambda tr(E) I + 2 mu E`.
    fn hooke(&self, e: DMat3) -> DMat3 {
        let (mu, lambda) = (self.c10, self.c01);
        let trace = e.x_axis.x + e.y_axis.y + e.z_axis.z;
        e * (2.0 * mu) + DMat3::from_diagonal(DVec3::splat(lambda * trace))
    }

    pub(crate) fn stress_change(&self, f: DMat3, df: DMat3) -> DMat3 {
        let mut change;
        if self.green {
            let e = (f.transpose() * f - DMat3::IDENTITY) * 0.5;
            let ftdf = f.transpose() * df;
            let de = (ftdf + ftdf.transpose()) * 0.5;
            change = df * self.hooke(e) + f * self.hooke(de);
            if self.volumetric.resists() {
                let cof = cofactor(f);
                let [_, h1, h2] = self.volumetric.at(f.x_axis.dot(cof.x_axis));
                change += cof * (h2 * double_dot(cof, df)) + cofactor_change(f, df) * h1;
            }
        } else {
            change = self.neo_hookean_change(f, df);
            if self.c01 != 0.0 {
                let c = f.transpose() * f;
                let ftdf = f.transpose() * df;
                let dc = ftdf + ftdf.transpose();
                change += (f * (2.0 * double_dot(f, df)) + df * double_dot(f, f) - df * c - f * dc)
                    * (2.0 * self.c01);
            }
        }
        if let Some(fiber) = &self.fiber {
            change += fiber.stress_change(f, df);
        }
        change
    }
}

impl Material {
    /// Energy density `W` (Pa) and first Piola–Kirchhoff stress `P = dW/dF` (Pa).
    ///
    /// Finite for every finite `F`, also inverted: below `J = 0.1` the terms in `ln J` continue as
    /// their second-order expansion there; the stable neo-Hookean law has none.
    #[must_use]
    pub fn energy_and_stress(&self, deformation_gradient: DMat3) -> (f64, DMat3) {
        Coefficients::new(self).energy_and_stress(deformation_gradient)
    }

    /// Cauchy stress `sigma = P Fᵀ / J` (Pa).
    ///
    /// Undefined for `J = 0`, where it is returned as not finite.
    #[must_use]
    pub fn cauchy_stress(&self, deformation_gradient: DMat3) -> DMat3 {
        let (_, stress) = self.energy_and_stress(deformation_gradient);
        stress * deformation_gradient.transpose() * deformation_gradient.determinant().recip()
    }

    /// Change of `P` for a change `dF`: `dP = (d²W/dF²) : dF`, symmetric as a form in `dF`.
    #[must_use]
    pub fn stress_change(&self, deformation_gradient: DMat3, change: DMat3) -> DMat3 {
        Coefficients::new(self).stress_change(deformation_gradient, change)
    }
}

/// Natural logarithm of a positive, normal number, to about one unit in the last place.
///
/// `x = 2^e m` with `m` between the square roots of 1/2 and 2, `ln m = 2 artanh s`,
/// `s = (m - 1)/(m + 1)`. Without branches or tables, so that a compiler runs it over lanes; the same
/// bits on every machine of the same arithmetic.
#[inline(always)]
pub(crate) fn ln<A: Arithmetic>(x: f64) -> f64 {
    /// Bits of the square root of 1/2.
    const LOW: u64 = 0x3fe6_a09e_667f_3bcd;
    /// Exponent of one in place.
    const ONE: u64 = 0x3ff0_0000_0000_0000;
    /// `2^52`, whose last bits count units.
    const UNITS: u64 = 0x4330_0000_0000_0000;
    /// ln 2 in two parts, the first with room for a product with any exponent.
    const LN2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
    let bits = x.to_bits();
    let exponent = bits.wrapping_add(ONE - LOW) >> 52;
    let m = f64::from_bits(bits.wrapping_sub(exponent.wrapping_sub(1023) << 52));
    let e = f64::from_bits(UNITS | exponent) - (4_503_599_627_370_496.0 + 1023.0);
    let f = m - 1.0;
    let s = f / (m + 1.0);
    let z = s * s;
    let mut series = 1.0 / 21.0;
    for odd in [19.0, 17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0] {
        series = A::add(series, z, 1.0 / odd);
    }
    // 2 s = f - s f: the larger part is exact.
    let rest = A::add(s, A::add(2.0 * z, series, -f), e * LN2[1]);
    A::add(e, LN2[0], f + rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::arithmetic::Fused;
    use testkit::cloud::Random;

    #[test]
    fn logarithm_is_that_of_the_library() {
        let mut random = Random::new(3);
        for k in 0..20_000 {
            let x = match k % 4 {
                0 => 1.0 + random.range(-1e-3, 1e-3),
                1 => random.range(0.1, 10.0),
                2 => 1.0 + random.range(-1e-12, 1e-12),
                _ => random.range(-300.0, 300.0).exp(),
            };
            for (own, library) in [(ln::<Separate>(x), x.ln()), (ln::<Fused>(x), x.ln())] {
                let near = (own - library).abs() <= 2.0 * f64::EPSILON * library.abs();
                assert!(near, "ln {x:e}: {own:e}, {library:e}");
            }
        }
        assert_eq!(ln::<Separate>(1.0).to_bits(), 0);
        assert_eq!(ln::<Fused>(1.0).to_bits(), 0);
    }
}
