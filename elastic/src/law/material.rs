//! Strain energies: density, first Piola–Kirchhoff stress and tangent at one deformation gradient.

use crate::error::ElasticError;
use crate::law::fiber::Fiber;
use crate::law::prony::{MAX_PRONY_TERMS, PronyTerm};

/// The law that gives the energy density `W(F)` (Pa = J/m³).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Law {
    /// `W = mu/2 (F:F - 3) - mu ln J + lambda/2 (ln J)²`.
    NeoHookean {
        /// Shear modulus (Pa).
        lame_mu: f64,
        /// First Lamé parameter (Pa).
        lame_lambda: f64,
    },
    /// `W = mu/2 (F:F - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)²`: the stable neo-Hookean law
    /// (Smith, de Goes and Kim 2018, section 3.3, with `lambda + mu` instead of `lambda`, which
    /// gives it the small-strain moduli of Hooke's law). A polynomial in `F`: smooth, and with a
    /// bounded tangent modulus, through `J = 0` and for inverted `F`.
    StableNeoHookean {
        /// Shear modulus (Pa).
        lame_mu: f64,
        /// First Lamé parameter (Pa), above `-mu`.
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
///
/// # Examples
/// ```
/// use phyxel_elastic::{Fiber, Material, PronyTerm, glam::DVec3};
///
/// let mut liver = Material::stable_neo_hookean(3e3, 0.45).with_barrier(2e3);
/// assert!((liver.lame_mu() - 3e3 / 2.9).abs() < 1e-9);
/// liver = liver.with_prony(&[PronyTerm { ratio: 0.5, relaxation_time: 0.1 }]);
/// let muscle = Material::neo_hookean(1e4, 0.4).with_fiber(Fiber {
///     direction: DVec3::X, stiffness: 2e3, exponent: 1.0, dispersion: 0.1,
/// });
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Material {
    /// The strain-energy law.
    pub law: Law,
    /// `k_v` (Pa) of the volume-restoring energy `k_v/2 (J - 1)²` (Aras 2014, eq. (30)); 0 for none.
    pub volume_constant: f64,
    /// Pressure (Pa) of the barrier against collapse (see [`Material::with_barrier`]); 0 for none.
    pub barrier: f64,
    /// Fibers on top of the law.
    pub fiber: Option<Fiber>,
    /// Viscous part as a Prony series; unused terms have ratio 0.
    pub prony: [PronyTerm; MAX_PRONY_TERMS],
}

impl Material {
    /// A material of this law alone.
    #[must_use]
    pub const fn new(law: Law) -> Self {
        Self {
            law,
            volume_constant: 0.0,
            barrier: 0.0,
            fiber: None,
            prony: [PronyTerm::NONE; MAX_PRONY_TERMS],
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

    /// Stable neo-Hookean material from Young's modulus (Pa) and Poisson's ratio; what a body that is
    /// cut or falls freely wants. Values out of range are refused by [`crate::Elastic::new`].
    #[must_use]
    pub fn stable_neo_hookean(youngs_modulus: f64, poissons_ratio: f64) -> Self {
        let (lame_mu, lame_lambda) = lame(youngs_modulus, poissons_ratio);
        Self::new(Law::StableNeoHookean {
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

    /// The same with a barrier against collapse: below a volume ratio of `J = 0.4` an energy
    /// `0.4 p (t³ - t⁴/2)`, `t = (0.4 - J)/0.4`, whose pressure rises smoothly to `p` (`barrier`, Pa) at `J = 0` and
    /// stays so for inverted `F`; nothing above 0.4, so that moderate strain has the bits that it has without.
    /// Twice differentiable; its curvature is at most `3.75 p`, and zero where `F` is inverted.
    ///
    /// A polynomial law such as [`Law::StableNeoHookean`] lets a pressure of `lambda + 2 mu` squeeze a volume to
    /// nothing.
    #[must_use]
    pub const fn with_barrier(mut self, barrier: f64) -> Self {
        self.barrier = barrier;
        self
    }

    /// The same with a family of fibers along `direction` (normalised here; see [`Fiber`]).
    #[must_use]
    pub fn with_fiber(mut self, fiber: Fiber) -> Self {
        let direction = fiber.direction.normalize_or_zero();
        self.fiber = Some(Fiber { direction, ..fiber });
        self
    }

    /// The same with a viscous part: the first [`MAX_PRONY_TERMS`] of `terms`.
    ///
    /// # Panics
    /// If there are more terms than that.
    #[must_use]
    pub fn with_prony(mut self, terms: &[PronyTerm]) -> Self {
        assert!(
            terms.len() <= MAX_PRONY_TERMS,
            "{} Prony terms, at most {MAX_PRONY_TERMS}",
            terms.len()
        );
        self.prony = [PronyTerm::NONE; MAX_PRONY_TERMS];
        self.prony[..terms.len()].copy_from_slice(terms);
        self
    }

    /// Shear modulus (Pa) at small strain.
    #[must_use]
    pub fn lame_mu(&self) -> f64 {
        match self.law {
            Law::NeoHookean { lame_mu, .. }
            | Law::StableNeoHookean { lame_mu, .. }
            | Law::SaintVenantKirchhoff { lame_mu, .. } => lame_mu,
            Law::MooneyRivlin { c10, c01, .. } => 2.0 * (c10 + c01),
        }
    }

    /// First Lamé parameter (Pa) at small strain, without the volume-restoring energy.
    #[must_use]
    pub const fn lame_lambda(&self) -> f64 {
        match self.law {
            Law::NeoHookean { lame_lambda, .. }
            | Law::StableNeoHookean { lame_lambda, .. }
            | Law::SaintVenantKirchhoff { lame_lambda, .. }
            | Law::MooneyRivlin { lame_lambda, .. } => lame_lambda,
        }
    }

    /// Largest modulus (Pa) with which a small strain is resisted: `lambda + 2 mu + k_v`, plus the
    /// fibers' `4 k1`, times what the viscous part adds at once.
    #[must_use]
    pub fn modulus_bound(&self) -> f64 {
        let fibers = self.fiber.map_or(0.0, |fiber| 4.0 * fiber.stiffness);
        let elastic =
            self.lame_lambda().max(0.0) + 2.0 * self.lame_mu() + self.volume_constant + fibers;
        elastic * (1.0 + self.prony.iter().map(|term| term.ratio).sum::<f64>())
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
        let not_negative =
            |parameter, value: f64| check(value >= 0.0, parameter, value, "must not be negative");
        let (mu, lambda) = (self.lame_mu(), self.lame_lambda());
        let sound = mu > 0.0 && 3.0 * lambda + 2.0 * mu > 0.0;
        if !(sound && mu.is_finite() && lambda.is_finite()) {
            let (modulus, ratio) = hooke(mu, lambda);
            if mu.is_finite() && (ratio <= -1.0 || ratio >= 0.5) {
                let allowed = "must lie between -1 and 0.5; lambda / (2 (lambda + mu)) of a law by Lamé's parameters";
                check(false, "Poisson's ratio", ratio, allowed)?;
            }
            let allowed = "must be positive and finite; mu (3 lambda + 2 mu) / (lambda + mu) of a law by Lamé's parameters";
            check(false, "Young's modulus", modulus, allowed)?;
        }
        if let Law::MooneyRivlin { c10, c01, .. } = self.law {
            not_negative("c10", c10)?;
            not_negative("c01", c01)?;
            let high = lambda >= 4.0 * c01;
            check(high, "lame_lambda", lambda, "must be at least 4 c01")?;
        }
        not_negative("volume_constant", self.volume_constant)?;
        not_negative("barrier", self.barrier)?;
        if let Some(fiber) = self.fiber {
            let (k1, k2, kappa) = (fiber.stiffness, fiber.exponent, fiber.dispersion);
            not_negative("fiber.stiffness", k1)?;
            check(k2 > 0.0, "fiber.exponent", k2, "must be positive")?;
            let range = (0.0..=1.0 / 3.0).contains(&kappa);
            check(range, "fiber.dispersion", kappa, "must lie in [0, 1/3]")?;
            let length = fiber.direction.length();
            let unit = (length - 1.0).abs() < 1e-6;
            check(unit, "fiber.direction", length, "must be a unit vector")?;
        }
        for term in &self.prony {
            let (name, time) = ("prony.relaxation_time", term.relaxation_time);
            not_negative("prony.ratio", term.ratio)?;
            check(time > 0.0, name, time, "must be positive")?;
        }
        Ok(())
    }

    /// Number of Prony terms up to the last one in use.
    pub(crate) fn prony_count(&self) -> usize {
        let used = self.prony.iter().rposition(|term| term.ratio > 0.0);
        used.map_or(0, |last| last + 1)
    }
}

/// `(mu, lambda)` of Young's modulus and Poisson's ratio.
fn lame(youngs_modulus: f64, poissons_ratio: f64) -> (f64, f64) {
    (
        youngs_modulus / (2.0 * (1.0 + poissons_ratio)),
        youngs_modulus * poissons_ratio / ((1.0 + poissons_ratio) * (1.0 - 2.0 * poissons_ratio)),
    )
}

/// `(E, nu)` of Lamé's parameters; nu is 0.5 where lambda is infinite.
fn hooke(mu: f64, lambda: f64) -> (f64, f64) {
    if lambda.is_infinite() {
        return (3.0 * mu, 0.5);
    }
    let ratio = lambda / (2.0 * (lambda + mu));
    let modulus = 2.0 * mu * (1.0 + ratio);
    (if ratio.is_nan() { mu } else { modulus }, ratio)
}

#[cfg(test)]
mod tests;
