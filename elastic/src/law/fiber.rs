//! One family of fibers after Holzapfel, Gasser and Ogden.

use glam::{DMat3, DVec3};

use crate::law::checks::SettingChecks;
use crate::law::tensor::{double_dot, outer};

/// Exponent `k2 E²` beyond which the energy continues as its second-order expansion in `E`:
/// e²⁰ is already 10⁸ times the initial stiffness, and a solver's wild trial step must stay finite.
const LARGEST_EXPONENT: f64 = 20.0;

/// Strain about 0 at which the tangent is that of stretched fibres: steps are estimated at rest, where round-off is some
/// 1e-16; the strain of a load is far above.
const ROUND_OFF: f64 = 1e-12;

/// Strain up to which fibres straighten; from there on their stress is that of the formula. Where stiffness jumped at strain
/// 0, severed pieces that vibrate about rest gained 1.4 and 1.6 % of what they stored (`random --all`, seed 105, scene 022 and
/// seed 103, scene 073). With 3e-4 the two gain 0.08 and 2.1 %, with 1e-3 0.32 and 0.24 %, with 3e-3 0.18 and 0.1 %.
const TOE: f64 = 3e-3;

/// Fibres that stiffen exponentially when stretched and carry nothing when slack:
/// `W_f = k1/(2 k2) (exp(k2 <E>²) - 1)`, `E = kappa (I1 - 3) + (1 - 3 kappa) (I4 - 1)`,
/// `I4 = a·C a` (Holzapfel, Gasser and Ogden 2000; dispersion `kappa` of Gasser, Ogden and
/// Holzapfel 2006), with `<E>` the positive part. Up to a strain `E` of 3e-3 the stress is a cubic in it, so that stiffness
/// rises from 0 to that of the formula without a jump.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Fiber {
    /// Direction `a` at rest: of unit length in a force law, of any above zero in settings.
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub direction: DVec3,
    /// `k1` (Pa), a quarter of the stiffness along the fibres at small stretch where `kappa` is 0.
    pub stiffness: f64,
    /// `k2`, positive: how fast they stiffen.
    #[cfg_attr(feature = "serde", serde(default = "Fiber::default_exponent"))]
    pub exponent: f64,
    /// `kappa`, spread of the directions: 0 for none, 1/3 for every direction alike.
    #[cfg_attr(feature = "serde", serde(default))]
    pub dispersion: f64,
}

#[cfg(feature = "serde")]
impl Fiber {
    const fn default_exponent() -> f64 {
        1.0
    }
}

impl Fiber {
    /// Checks the fields as those of `fiber` in settings.
    pub(crate) fn check(&self, checks: &mut SettingChecks) {
        checks.direction("fiber.direction", self.direction);
        checks.not_negative("fiber.stiffness", self.stiffness, " (Pa)");
        checks.positive("fiber.exponent", self.exponent, "");
        let holds = (0.0..=1.0 / 3.0).contains(&self.dispersion);
        let must = "it must be from 0 (all parallel) to 1/3 (every direction alike)";
        checks.require("fiber.dispersion", self.dispersion, holds, must, &[]);
    }

    /// `psi`, `psi'`, `psi''` at `E`; the second derivative at 0 is that of stretched fibres.
    fn response(&self, e: f64) -> [f64; 3] {
        let is_rest = e.abs() <= ROUND_OFF;
        if e <= 0.0 || is_rest {
            return [0.0, 0.0, if is_rest { self.stiffness } else { 0.0 }];
        }
        let toe = TOE.min(0.5 / self.exponent.sqrt());
        let [psi, psi1, psi2] = self.taut(toe);
        let (a, b) = (3.0 * psi1 - toe * psi2, toe * psi2 - 2.0 * psi1);
        let straightened = |t: f64| toe * t.powi(3) * (a / 3.0 + b * t / 4.0);
        if e >= toe {
            let [taut, psi1, psi2] = self.taut(e);
            return [taut - psi + straightened(1.0), psi1, psi2];
        }
        let t = e / toe;
        [
            straightened(t),
            t * t * (a + b * t),
            t * (2.0 * a + 3.0 * b * t) / toe,
        ]
    }

    /// The same of the formula, at `E` above 0.
    fn taut(&self, e: f64) -> [f64; 3] {
        let (k1, k2) = (self.stiffness, self.exponent);
        let seam = (LARGEST_EXPONENT / k2).sqrt();
        let at = e.min(seam);
        let beyond = e - at;
        let grown = (k2 * at * at).exp_m1();
        let growth = 1.0 + grown;
        let psi1 = k1 * at * growth;
        let psi2 = k1 * growth * (1.0 + 2.0 * k2 * at * at);
        let psi = 0.5 * k1 / k2 * grown;
        [
            psi + beyond * (psi1 + 0.5 * psi2 * beyond),
            psi1 + psi2 * beyond,
            psi2,
        ]
    }

    /// `E` and `dE/dF`.
    fn strain(&self, f: DMat3) -> (f64, DMat3) {
        let (kappa, along) = (self.dispersion, 1.0 - 3.0 * self.dispersion);
        let stretched = f * self.direction;
        let e = kappa * (double_dot(f, f) - 3.0) + along * (stretched.length_squared() - 1.0);
        let gradient = f * (2.0 * kappa) + outer(stretched, self.direction) * (2.0 * along);
        (e, gradient)
    }

    pub(crate) fn energy_and_stress(&self, f: DMat3) -> (f64, DMat3) {
        let (e, gradient) = self.strain(f);
        let [psi, psi1, _] = self.response(e);
        (psi, gradient * psi1)
    }

    pub(crate) fn stress_change(&self, f: DMat3, df: DMat3) -> DMat3 {
        let (e, gradient) = self.strain(f);
        let [_, psi1, psi2] = self.response(e);
        // The strain is quadratic in F, its gradient linear.
        let (_, change) = self.strain(df);
        gradient * (psi2 * double_dot(gradient, df)) + change * psi1
    }
}
