//! Strain energies: density, first Piola–Kirchhoff stress and tangent at one deformation gradient.

use glam::DMat3;

use crate::error::ElasticError;

/// Below this volume ratio the volumetric energy continues as its own second-order expansion.
///
/// `ln J` ends at `J = 0`. A node squeezed to a tenth of its volume is outside what a soft tissue
/// model claims; what matters there is that energy and stress stay finite, continuous and push back.
const EXTENSION_VOLUME_RATIO: f64 = 0.1;

/// The law that gives the energy density `W(F)` (Pa = J/m³).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Law {
    /// `W = mu/2 (F:F - 3) - mu ln J + lambda/2 (ln J)²`.
    NeoHookean {
        /// Shear modulus (Pa).
        lame_mu: f64,
        /// First Lamé parameter (Pa).
        lame_lambda: f64,
    },
    /// `W = mu E:E + lambda/2 (tr E)²`, `E = (FᵀF - I)/2`: Aras 2014, eqs (3), (6) and (7) with the
    /// factor ½ of Green's strain that eq. (3) leaves out. Softens under compression beyond 42 %.
    SaintVenantKirchhoff {
        /// Shear modulus (Pa).
        lame_mu: f64,
        /// First Lamé parameter (Pa).
        lame_lambda: f64,
    },
    /// `W = c10 (I1 - 3) + c01 (I2 - 3) - 2 (c10 + 2 c01) ln J + (lambda - 4 c01)/2 (ln J)²`; its
    /// small-strain moduli are `mu = 2 (c10 + c01)` and `lambda`.
    MooneyRivlin {
        /// Coefficient of `I1 - 3` (Pa).
        c10: f64,
        /// Coefficient of `I2 - 3` (Pa).
        c01: f64,
        /// First Lamé parameter at small strain (Pa), at least `4 c01`.
        lame_lambda: f64,
    },
}

/// A material: a law and what is added to it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Material {
    /// The strain-energy law.
    pub law: Law,
    /// `k_v` (Pa) of the volume-restoring energy `k_v/2 (J - 1)²` (Aras 2014, eq. (30)); 0 for none.
    pub volume_constant: f64,
}

impl Material {
    /// A material of this law alone.
    #[must_use]
    pub const fn new(law: Law) -> Self {
        Self {
            law,
            volume_constant: 0.0,
        }
    }

    /// Compressible neo-Hookean material from Young's modulus (Pa) and Poisson's ratio.
    #[must_use]
    pub fn neo_hookean(youngs_modulus: f64, poissons_ratio: f64) -> Self {
        let (lame_mu, lame_lambda) = lame(youngs_modulus, poissons_ratio);
        Self::new(Law::NeoHookean {
            lame_mu,
            lame_lambda,
        })
    }

    /// Saint Venant–Kirchhoff material from Young's modulus (Pa) and Poisson's ratio.
    #[must_use]
    pub fn saint_venant_kirchhoff(youngs_modulus: f64, poissons_ratio: f64) -> Self {
        let (lame_mu, lame_lambda) = lame(youngs_modulus, poissons_ratio);
        Self::new(Law::SaintVenantKirchhoff {
            lame_mu,
            lame_lambda,
        })
    }

    /// Mooney–Rivlin material with the small-strain moduli of `youngs_modulus` (Pa) and
    /// `poissons_ratio`, and `c01 = c01_share · mu/2`.
    #[must_use]
    pub fn mooney_rivlin(youngs_modulus: f64, poissons_ratio: f64, c01_share: f64) -> Self {
        let (lame_mu, lame_lambda) = lame(youngs_modulus, poissons_ratio);
        Self::new(Law::MooneyRivlin {
            c10: 0.5 * lame_mu * (1.0 - c01_share),
            c01: 0.5 * lame_mu * c01_share,
            lame_lambda,
        })
    }

    /// The same with the volume-restoring energy of Aras 2014, eq. (30).
    #[must_use]
    pub const fn with_volume_constant(mut self, volume_constant: f64) -> Self {
        self.volume_constant = volume_constant;
        self
    }

    /// Shear modulus (Pa) at small strain.
    #[must_use]
    pub fn lame_mu(&self) -> f64 {
        match self.law {
            Law::NeoHookean { lame_mu, .. } | Law::SaintVenantKirchhoff { lame_mu, .. } => lame_mu,
            Law::MooneyRivlin { c10, c01, .. } => 2.0 * (c10 + c01),
        }
    }

    /// First Lamé parameter (Pa) at small strain, without the volume-restoring energy.
    #[must_use]
    pub const fn lame_lambda(&self) -> f64 {
        match self.law {
            Law::NeoHookean { lame_lambda, .. }
            | Law::SaintVenantKirchhoff { lame_lambda, .. }
            | Law::MooneyRivlin { lame_lambda, .. } => lame_lambda,
        }
    }

    /// Largest modulus (Pa) with which a small strain is resisted: `lambda + 2 mu + k_v`.
    #[must_use]
    pub fn modulus_bound(&self) -> f64 {
        self.lame_lambda().max(0.0) + 2.0 * self.lame_mu() + self.volume_constant
    }

    /// Energy density `W` (Pa) and first Piola–Kirchhoff stress `P = dW/dF` (Pa).
    ///
    /// Finite for every finite `F`, also inverted: below `J = 0.1` the terms in `ln J` continue as
    /// their second-order expansion there.
    #[must_use]
    pub fn energy_and_stress(&self, deformation_gradient: DMat3) -> (f64, DMat3) {
        Prepared::new(self).energy_and_stress(deformation_gradient)
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
        Prepared::new(self).stress_change(deformation_gradient, change)
    }

    pub(crate) fn validate(&self, material: usize) -> Result<(), ElasticError> {
        let check = |ok: bool, parameter, value: f64, allowed| {
            if ok && value.is_finite() {
                Ok(())
            } else {
                Err(ElasticError::BadMaterial {
                    material,
                    parameter,
                    value,
                    allowed,
                })
            }
        };
        let (mu, lambda) = (self.lame_mu(), self.lame_lambda());
        check(mu > 0.0, "lame_mu", mu, "must be positive and finite")?;
        check(
            3.0 * lambda + 2.0 * mu > 0.0,
            "lame_lambda",
            lambda,
            "must exceed -2/3 of the shear modulus (Poisson's ratio between -1 and 0.5)",
        )?;
        if let Law::MooneyRivlin { c10, c01, .. } = self.law {
            check(c10 >= 0.0, "c10", c10, "must not be negative")?;
            check(c01 >= 0.0, "c01", c01, "must not be negative")?;
            check(
                lambda >= 4.0 * c01,
                "lame_lambda",
                lambda,
                "must be at least 4 c01",
            )?;
        }
        check(
            self.volume_constant >= 0.0,
            "volume_constant",
            self.volume_constant,
            "must not be negative",
        )
    }
}

/// `(mu, lambda)` of Young's modulus and Poisson's ratio.
fn lame(youngs_modulus: f64, poissons_ratio: f64) -> (f64, f64) {
    (
        youngs_modulus / (2.0 * (1.0 + poissons_ratio)),
        youngs_modulus * poissons_ratio / ((1.0 + poissons_ratio) * (1.0 - 2.0 * poissons_ratio)),
    )
}

/// Coefficients in the form the kernel evaluates:
/// `W = c10 (I1-3) + c01 (I2-3) + h(J)`, `h = -a ln J + b/2 ln²J` (extended), `+ k_v/2 (J-1)²`,
/// or Saint Venant–Kirchhoff with `mu`, `lambda` in place of `c10`, `c01`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prepared {
    green: bool,
    c10: f64,
    c01: f64,
    log: f64,
    log_squared: f64,
    volume_constant: f64,
}

impl Prepared {
    pub(crate) fn new(material: &Material) -> Self {
        let volume_constant = material.volume_constant;
        match material.law {
            Law::NeoHookean {
                lame_mu,
                lame_lambda,
            } => Self {
                green: false,
                c10: 0.5 * lame_mu,
                c01: 0.0,
                log: lame_mu,
                log_squared: lame_lambda,
                volume_constant,
            },
            Law::SaintVenantKirchhoff {
                lame_mu,
                lame_lambda,
            } => Self {
                green: true,
                c10: lame_mu,
                c01: lame_lambda,
                log: 0.0,
                log_squared: 0.0,
                volume_constant,
            },
            Law::MooneyRivlin {
                c10,
                c01,
                lame_lambda,
            } => Self {
                green: false,
                c10,
                c01,
                log: 2.0 * (c10 + 2.0 * c01),
                log_squared: lame_lambda - 4.0 * c01,
                volume_constant,
            },
        }
    }

    /// `h`, `h'`, `h''` at `J`.
    fn volumetric(&self, j: f64) -> [f64; 3] {
        let (a, b) = (self.log, self.log_squared);
        let at = j.max(EXTENSION_VOLUME_RATIO);
        let ln = at.ln();
        let inverse = at.recip();
        let mut h = ln * (0.5 * b * ln - a);
        let mut h1 = (b * ln - a) * inverse;
        let h2 = (a + b * (1.0 - ln)) * inverse * inverse;
        let below = j - at;
        h += below * (h1 + 0.5 * h2 * below);
        h1 += h2 * below;
        let k = self.volume_constant;
        let off = j - 1.0;
        [h + 0.5 * k * off * off, h1 + k * off, h2 + k]
    }

    #[inline]
    pub(crate) fn energy_and_stress(&self, f: DMat3) -> (f64, DMat3) {
        if self.green {
            return self.green_energy_and_stress(f);
        }
        let cof = cofactor(f);
        let j = f.x_axis.dot(cof.x_axis);
        let [h, h1, _] = self.volumetric(j);
        let i1 = double_dot(f, f);
        let mut energy = self.c10 * (i1 - 3.0) + h;
        let mut stress = f * (2.0 * self.c10) + cof * h1;
        if self.c01 != 0.0 {
            let c = f.transpose() * f;
            energy += self.c01 * (0.5 * (i1 * i1 - double_dot(c, c)) - 3.0);
            stress += (f * i1 - f * c) * (2.0 * self.c01);
        }
        (energy, stress)
    }

    fn green_energy_and_stress(&self, f: DMat3) -> (f64, DMat3) {
        let (mu, lambda) = (self.c10, self.c01);
        let e = (f.transpose() * f - DMat3::IDENTITY) * 0.5;
        let trace = e.x_axis.x + e.y_axis.y + e.z_axis.z;
        let mut energy = mu * double_dot(e, e) + 0.5 * lambda * trace * trace;
        let s = e * (2.0 * mu) + DMat3::from_diagonal(glam::DVec3::splat(lambda * trace));
        let mut stress = f * s;
        if self.volume_constant > 0.0 {
            let cof = cofactor(f);
            let off = f.x_axis.dot(cof.x_axis) - 1.0;
            energy += 0.5 * self.volume_constant * off * off;
            stress += cof * (self.volume_constant * off);
        }
        (energy, stress)
    }

    pub(crate) fn stress_change(&self, f: DMat3, df: DMat3) -> DMat3 {
        let cof = cofactor(f);
        let j = f.x_axis.dot(cof.x_axis);
        if self.green {
            let (mu, lambda) = (self.c10, self.c01);
            let stress = |e: DMat3| {
                let trace = e.x_axis.x + e.y_axis.y + e.z_axis.z;
                e * (2.0 * mu) + DMat3::from_diagonal(glam::DVec3::splat(lambda * trace))
            };
            let e = (f.transpose() * f - DMat3::IDENTITY) * 0.5;
            let ftdf = f.transpose() * df;
            let de = (ftdf + ftdf.transpose()) * 0.5;
            let mut change = df * stress(e) + f * stress(de);
            if self.volume_constant > 0.0 {
                change += cof * (self.volume_constant * double_dot(cof, df))
                    + cofactor_change(f, df) * (self.volume_constant * (j - 1.0));
            }
            return change;
        }
        let [_, h1, h2] = self.volumetric(j);
        let mut change =
            df * (2.0 * self.c10) + cof * (h2 * double_dot(cof, df)) + cofactor_change(f, df) * h1;
        if self.c01 != 0.0 {
            let c = f.transpose() * f;
            let ftdf = f.transpose() * df;
            let dc = ftdf + ftdf.transpose();
            change += (f * (2.0 * double_dot(f, df)) + df * double_dot(f, f) - df * c - f * dc)
                * (2.0 * self.c01);
        }
        change
    }
}

/// `A : B`.
#[inline]
pub(crate) fn double_dot(a: DMat3, b: DMat3) -> f64 {
    a.x_axis.dot(b.x_axis) + a.y_axis.dot(b.y_axis) + a.z_axis.dot(b.z_axis)
}

/// `cof F = J F⁻ᵀ = dJ/dF`, also where `F` is singular.
#[inline]
pub(crate) fn cofactor(f: DMat3) -> DMat3 {
    DMat3::from_cols(
        f.y_axis.cross(f.z_axis),
        f.z_axis.cross(f.x_axis),
        f.x_axis.cross(f.y_axis),
    )
}

/// Change of the cofactor for a change `dF`.
fn cofactor_change(f: DMat3, df: DMat3) -> DMat3 {
    DMat3::from_cols(
        df.y_axis.cross(f.z_axis) + f.y_axis.cross(df.z_axis),
        df.z_axis.cross(f.x_axis) + f.z_axis.cross(df.x_axis),
        df.x_axis.cross(f.y_axis) + f.x_axis.cross(df.y_axis),
    )
}

#[cfg(test)]
mod tests;
