//! A material as settings say it: moduli and model, and tissues with published properties.

use crate::input::Dilatation;
use crate::law::checks::{BadSetting, SettingChecks};
use crate::law::fiber::Fiber;
use crate::law::material::Material;
use crate::law::prony::{MAX_PRONY_TERMS, PronyTerm};

/// Pressure of the barrier against collapse, in shear moduli. Of the 18 liver rows of `benches -- matrix` six have nodes with
/// `det F <= 0` without it (down to -0.39); with 15, 25 and 40 none, none and one. Steeper ones take shorter steps where
/// soft tissue hangs by a thread: a scene of `random --seed 8808` of load 1.4 takes steps 83 times shorter with 15, 250 with 25.
const BARRIER: f64 = 15.0;

/// A hyperelastic material.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(default, deny_unknown_fields, rename = "Material")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct MaterialSettings {
    /// Tissue whose Young's modulus and density hold where they are not given.
    pub tissue: Option<Preset>,
    /// Strain energy.
    pub model: Model,
    /// Young's modulus E at small strain (Pa).
    pub youngs_modulus: f64,
    /// Poisson's ratio nu at small strain, above -1 and below 0.5.
    pub poissons_ratio: f64,
    /// Mass density at rest (kg/m^3).
    pub density: f64,
    /// Constant `k` (Pa) of the volume-restoring energy `k/2 (J - 1)^2` (Aras 2014, eq. (30)), beside
    /// what the model does; 0 for none.
    pub volume_constant: f64,
    /// Fibres added to the model, all in one direction.
    pub fiber: Option<Fiber>,
    /// Viscosity as a Prony series of up to four terms; the moduli are those of the long term.
    pub viscosity: Vec<PronyTerm>,
    /// Where changes of volume are resisted.
    pub dilatation: Dilatation,
    /// Strength of the hourglass stabilization, as a fraction of the shear modulus.
    pub stabilization: f64,
    /// Toughness (J/m^2): a cut runs ahead of its blade where the energy release rate is above it. Livers have 76 to
    /// 225, 164 by Gokgol et al. (2012, Medical Engineering & Physics 34, 882–891). Fronts that no blade has made do not tear, nor those out of which a blade was drawn again. Without it tissue never
    /// tears.
    pub toughness: Option<f64>,
}

impl Default for MaterialSettings {
    /// Stable neo-Hookean, 5 kPa, Poisson's ratio 0.45, 1,060 kg/m³, stabilization 0.1; no fibres, no viscosity.
    fn default() -> Self {
        Self {
            tissue: None,
            model: Model::StableNeoHookean,
            youngs_modulus: 5.0e3,
            poissons_ratio: 0.45,
            density: 1060.0,
            volume_constant: 0.0,
            fiber: None,
            viscosity: Vec::new(),
            dilatation: Dilatation::Local,
            stabilization: 0.1,
            toughness: None,
        }
    }
}

impl MaterialSettings {
    /// A tissue with its published properties and the other keys' defaults.
    #[must_use]
    pub fn of(tissue: Preset) -> Self {
        let (youngs_modulus, density) = tissue.properties();
        Self {
            tissue: Some(tissue),
            youngs_modulus,
            density,
            ..Self::default()
        }
    }

    /// The fields that are out of their bounds; none in valid settings.
    #[must_use]
    pub fn check(&self) -> Vec<BadSetting> {
        let mut checks = SettingChecks::default();
        let hint = " (Pa), such as 5e3 for liver";
        checks.positive("youngs_modulus", self.youngs_modulus, hint);
        let hint = " (kg/m^3), such as 1060 for soft tissue";
        checks.positive("density", self.density, hint);
        let ratio = self.poissons_ratio;
        let holds = ratio > -1.0 && ratio < 0.5;
        let must = "it must be above -1 and below 0.5, such as 0.45 for soft tissue";
        checks.require("poissons_ratio", ratio, holds, must, &[]);
        if let Model::MooneyRivlin { share } = self.model {
            // lambda >= 4 c01 keeps the energy's minimum at rest.
            let most = (ratio / (1.0 - 2.0 * ratio)).clamp(0.0, 1.0);
            let must = format_args!(
                "it must be from 0 to {most:.3}, the most for a Poisson's ratio of {ratio}"
            );
            let holds = (0.0..=most).contains(&share);
            checks.require("model.share", share, holds, must, &["poissons_ratio"]);
        }
        checks.not_negative("volume_constant", self.volume_constant, " (Pa)");
        if let Some(fiber) = &self.fiber {
            fiber.check(&mut checks);
        }
        let terms = self.viscosity.len();
        let found = format_args!("a list of {terms} terms");
        let must = format_args!("it may have {MAX_PRONY_TERMS} terms");
        checks.require("viscosity", found, terms <= MAX_PRONY_TERMS, must, &[]);
        for (index, term) in self.viscosity.iter().enumerate() {
            let hint = ", such as 0.5 for half the long-term stiffness more";
            checks.not_negative(format_args!("viscosity[{index}].ratio"), term.ratio, hint);
            let time = term.relaxation_time;
            checks.positive(format_args!("viscosity[{index}].time"), time, " (s)");
        }
        checks.require(
            "dilatation",
            "Mean",
            self.dilatation == Dilatation::Local || self.model != Model::SaintVenantKirchhoff,
            "the model SaintVenantKirchhoff has no part of its own for changes of volume; take Local or \
             another model",
            &["model"],
        );
        let hint = ", 0.1 is the measured choice";
        checks.not_negative("stabilization", self.stabilization, hint);
        if let Some(toughness) = self.toughness {
            checks.positive("toughness", toughness, " (J/m^2), such as 164 for liver");
        }
        checks.0
    }

    /// The material as the elastic model has it.
    ///
    /// # Panics
    /// If there are more terms of viscosity than [`crate::MAX_PRONY_TERMS`].
    #[must_use]
    pub fn law(&self) -> Material {
        let (modulus, ratio) = (self.youngs_modulus, self.poissons_ratio);
        let law = match self.model {
            Model::StableNeoHookean => Material::stable_neo_hookean(modulus, ratio),
            Model::NeoHookean => Material::neo_hookean(modulus, ratio),
            Model::SaintVenantKirchhoff => Material::saint_venant_kirchhoff(modulus, ratio),
            Model::MooneyRivlin { share } => Material::mooney_rivlin(modulus, ratio, share),
        };
        let barrier = match self.model {
            Model::StableNeoHookean => BARRIER * law.lame_mu(),
            _ => 0.0,
        };
        let law = law
            .with_volume_constant(self.volume_constant)
            .with_barrier(barrier)
            .with_prony(&self.viscosity);
        self.fiber.map_or(law, |fiber| law.with_fiber(fiber))
    }
}

/// Strain energy of a material.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Model {
    /// Stable neo-Hookean solid, whose energy and stiffness stay finite where a node is squeezed flat or
    /// turned inside out (Smith, de Goes and Kim 2018), with a barrier against collapse: a pressure that rises to 15 mu
    /// below a volume ratio of 0.4, without which a pressure of `lambda + 2 mu` squeezes a volume to nothing.
    StableNeoHookean,
    /// Compressible neo-Hookean solid with `ln J`; for comparison with closed forms.
    NeoHookean,
    /// Saint Venant-Kirchhoff solid, the dissertation's; it softens when pressed beyond 42 %.
    SaintVenantKirchhoff,
    /// Mooney-Rivlin solid.
    MooneyRivlin {
        /// Fraction of the second coefficient: `c01 = share mu / 2`, `c10 = (1 - share) mu / 2`.
        share: f64,
    },
}

/// A tissue with published properties: means of healthy adults at small strain. Moduli of one tissue differ by
/// half of their value and more from person to person and from method to method.
///
/// Densities are those of ICRU 1989 for all but silicone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Preset {
    /// 5.49 kPa (± 1.59, transient elastography of 429 people: Roulot 2008), 1060 kg/m^3.
    Liver,
    /// Cortex: 5.0 kPa (± 2.9, shear waves in 127 people: Arda 2011), 1050 kg/m^3.
    Kidney,
    /// 2.9 kPa (± 1.8, Arda 2011), 1060 kg/m^3.
    Spleen,
    /// 4.8 kPa (± 3, Arda 2011), 1040 kg/m^3.
    Pancreas,
    /// Gastrocnemius at rest: 11.1 kPa (± 4.1, Arda 2011), 1050 kg/m^3.
    Muscle,
    /// 1.389 kPa (± 0.289, indentation of bovine slices: Budday 2015), 1040 kg/m^3.
    GrayMatter,
    /// 1.895 kPa (± 0.592, Budday 2015), 1040 kg/m^3.
    WhiteMatter,
    /// Of the breast: 3.25 kPa (± 0.91, indentation of samples: Samani 2007), 950 kg/m^3.
    Fat,
    /// Of the forearm: 6 kPa (4.5 to 8, indentation: Pailler-Mattei 2008), 1090 kg/m^3.
    Skin,
    /// Of phantoms (Ecoflex 00-30): 118 kPa, the neo-Hookean modulus of 69 kPa at 100 % (Smooth-On, technical bulletin),
    /// 1070 kg/m^3.
    Silicone,
}

impl Preset {
    /// Young's modulus (Pa) at small strain and mass density (kg/m³).
    #[must_use]
    pub const fn properties(self) -> (f64, f64) {
        match self {
            Self::Liver => (5490.0, 1060.0),
            Self::Kidney => (5000.0, 1050.0),
            Self::Spleen => (2900.0, 1060.0),
            Self::Pancreas => (4800.0, 1040.0),
            Self::Muscle => (11_100.0, 1050.0),
            Self::GrayMatter => (1389.0, 1040.0),
            Self::WhiteMatter => (1895.0, 1040.0),
            Self::Fat => (3250.0, 950.0),
            Self::Skin => (6000.0, 1090.0),
            Self::Silicone => (118_000.0, 1070.0),
        }
    }
}

/// Keys of a material as they are given: what a tissue stands for is filled in afterwards.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
#[serde(default, deny_unknown_fields, rename = "Material")]
struct Given {
    tissue: Option<Preset>,
    model: Model,
    youngs_modulus: Option<f64>,
    poissons_ratio: f64,
    density: Option<f64>,
    volume_constant: f64,
    fiber: Option<Fiber>,
    viscosity: Vec<PronyTerm>,
    dilatation: Dilatation,
    stabilization: f64,
    toughness: Option<f64>,
}

#[cfg(feature = "serde")]
impl Default for Given {
    fn default() -> Self {
        let MaterialSettings {
            tissue,
            model,
            poissons_ratio,
            volume_constant,
            fiber,
            viscosity,
            dilatation,
            stabilization,
            toughness,
            ..
        } = MaterialSettings::default();
        Self {
            tissue,
            model,
            youngs_modulus: None,
            poissons_ratio,
            density: None,
            volume_constant,
            fiber,
            viscosity,
            dilatation,
            stabilization,
            toughness,
        }
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for MaterialSettings {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let given = Given::deserialize(deserializer)?;
        let named = given.tissue.map_or_else(Self::default, Self::of);
        Ok(Self {
            tissue: given.tissue,
            model: given.model,
            youngs_modulus: given.youngs_modulus.unwrap_or(named.youngs_modulus),
            poissons_ratio: given.poissons_ratio,
            density: given.density.unwrap_or(named.density),
            volume_constant: given.volume_constant,
            fiber: given.fiber,
            viscosity: given.viscosity,
            dilatation: given.dilatation,
            stabilization: given.stabilization,
            toughness: given.toughness,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each key is the constructor's part of the material.
    #[test]
    fn every_model_is_the_law_of_its_name_with_the_moduli_asked() {
        let stable = Material::stable_neo_hookean(3.0e3, 0.4);
        for (model, law) in [
            (
                Model::StableNeoHookean,
                stable.with_barrier(15.0 * stable.lame_mu()),
            ),
            (Model::NeoHookean, Material::neo_hookean(3.0e3, 0.4)),
            (
                Model::SaintVenantKirchhoff,
                Material::saint_venant_kirchhoff(3.0e3, 0.4),
            ),
            (
                Model::MooneyRivlin { share: 0.3 },
                Material::mooney_rivlin(3.0e3, 0.4, 0.3),
            ),
        ] {
            let mut settings = MaterialSettings {
                model,
                youngs_modulus: 3.0e3,
                poissons_ratio: 0.4,
                ..MaterialSettings::of(Preset::Fat)
            };
            assert!((settings.density - 950.0).abs() < 1e-12, "that of fat");
            assert_eq!(settings.law(), law, "{model:?}");
            let (mu, lambda) = (law.lame_mu(), law.lame_lambda());
            let modulus = mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu);
            assert!((modulus - 3.0e3).abs() < 1e-9, "{model:?}: {modulus} Pa");
            let ratio = lambda / (2.0 * (lambda + mu));
            assert!((ratio - 0.4).abs() < 1e-12, "{model:?}: {ratio}");
            let fiber = Fiber {
                direction: glam::DVec3::new(0.0, 3.0, 4.0),
                stiffness: 100.0,
                exponent: 2.0,
                dispersion: 0.1,
            };
            let term = PronyTerm {
                ratio: 0.5,
                relaxation_time: 0.2,
            };
            settings.fiber = Some(fiber);
            settings.viscosity = vec![term];
            settings.volume_constant = 7.0;
            let more = law.with_fiber(fiber).with_prony(&[term]);
            assert_eq!(settings.law(), more.with_volume_constant(7.0));
            settings.law().validate(0).expect("a valid material");
            let unit = settings.law().fiber.expect("fibres").direction;
            assert!((unit.length() - 1.0).abs() < 1e-15, "unit");
        }
    }

    #[test]
    fn what_is_out_of_bounds_is_named_with_a_remedy() {
        assert_eq!(MaterialSettings::default().check(), []);
        let settings = MaterialSettings {
            model: Model::MooneyRivlin { share: 0.9 },
            poissons_ratio: 0.3,
            density: 0.0,
            fiber: Some(Fiber {
                direction: glam::DVec3::ZERO,
                stiffness: 1.0,
                exponent: 1.0,
                dispersion: 0.0,
            }),
            ..MaterialSettings::default()
        };
        let bad = settings.check();
        let fields: Vec<&str> = bad.iter().map(|bad| bad.field.as_str()).collect();
        assert_eq!(fields, ["density", "model.share", "fiber.direction"]);
        let (told, begin) = (
            bad[1].to_string(),
            "model.share is 0.9; it must be from 0 to 0.750",
        );
        assert!(told.starts_with(begin), "{told}");
        assert_eq!(bad[1].with, ["poissons_ratio"]);
    }
}
