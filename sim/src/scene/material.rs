//! What bodies are made of.

use glam::DVec3;
use phyxel_elastic as elastic;
use serde::{Deserialize, Serialize};

use super::event::Region;

/// Coefficient of the barrier against collapse, in shear moduli. Of the 18 liver rows of `benches -- matrix` six have nodes
/// with `det F <= 0` without it (down to -0.39), with 100 one (-0.001) and with 200 none, but one takes steps 3.2 times shorter
/// than at rest (2.7 with 100); rows that stay above `J = 0.4` have the same bits with any.
const BARRIER: f64 = 150.0;

/// A hyperelastic material.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Material {
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
    /// Fibres beside the model, all in one direction.
    pub fiber: Option<Fiber>,
    /// Viscosity as a Prony series of up to four terms; the moduli are those of the long term.
    pub viscosity: Vec<Relaxation>,
    /// Where changes of volume are resisted.
    pub dilatation: Dilatation,
    /// Strength of the pair penalty against zero-energy modes, as a share of the shear modulus.
    pub stabilization: f64,
}

/// Keys of a material as they are given: what a tissue stands for is filled in afterwards.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, rename = "Material")]
struct Given {
    tissue: Option<Preset>,
    model: Model,
    youngs_modulus: Option<f64>,
    poissons_ratio: f64,
    density: Option<f64>,
    volume_constant: f64,
    fiber: Option<Fiber>,
    viscosity: Vec<Relaxation>,
    dilatation: Dilatation,
    stabilization: f64,
}

impl Default for Given {
    fn default() -> Self {
        let Material {
            tissue,
            model,
            poissons_ratio,
            volume_constant,
            fiber,
            viscosity,
            dilatation,
            stabilization,
            ..
        } = Material::default();
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
        }
    }
}

impl<'de> Deserialize<'de> for Material {
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
        })
    }
}

/// A tissue with published properties: means of healthy adults at small strain. Moduli of one tissue differ by
/// half of their value and more from person to person and from method to method.
///
/// Densities are those of ICRU 1989 for all but silicone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
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

impl Default for Material {
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
        }
    }
}

/// Strain energy of a material.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub enum Model {
    /// Stable neo-Hookean solid, whose energy and stiffness stay finite where a node is squeezed flat or
    /// turned inside out (Smith, de Goes and Kim 2018), with a barrier against collapse: `50 mu (0.4 - J)^3`
    /// below a volume ratio of 0.4, without which a pressure of `lambda + 2 mu` squeezes a volume to nothing.
    StableNeoHookean,
    /// Compressible neo-Hookean solid with `ln J`; for comparison with closed forms.
    NeoHookean,
    /// Saint Venant-Kirchhoff solid, the dissertation's; it gives way when pressed beyond 42 %.
    SaintVenantKirchhoff,
    /// Mooney-Rivlin solid.
    MooneyRivlin {
        /// Share of the second coefficient: `c01 = share mu / 2`, `c10 = (1 - share) mu / 2`.
        share: f64,
    },
}

/// Fibres that stiffen exponentially when stretched and carry nothing when slack (Holzapfel, Gasser and
/// Ogden 2000).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Fiber {
    /// Direction at rest, of any length above zero.
    #[cfg_attr(feature = "cli", schemars(with = "[f64; 3]"))]
    pub direction: DVec3,
    /// `k1` (Pa), a quarter of the stiffness along the fibres at small stretch.
    pub stiffness: f64,
    /// `k2`, how fast they stiffen.
    #[serde(default = "Fiber::default_exponent")]
    pub exponent: f64,
    /// Spread of the directions: 0 for none, 1/3 for every direction alike.
    #[serde(default)]
    pub dispersion: f64,
}

impl Fiber {
    const fn default_exponent() -> f64 {
        1.0
    }
}

/// One term of a Prony series: stress beyond that of the long term, which fades.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Relaxation {
    /// Stiffness of the term over that of the long term.
    pub ratio: f64,
    /// Time (s) in which its stress falls to 1/e.
    pub time: f64,
}

/// Where changes of volume are resisted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
pub enum Dilatation {
    /// At each node by itself.
    #[default]
    Local,
    /// By means over neighbourhoods, for confined bodies with a Poisson's ratio above 0.48; takes two
    /// more passes over the pairs. Not with `SaintVenantKirchhoff`.
    Mean,
}

/// A part of a body of another stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Inclusion {
    /// Part of space, in rest coordinates, whose nodes belong to it.
    pub region: Region,
    /// Young's modulus (Pa) there; the body's where not given.
    #[serde(default)]
    pub youngs_modulus: Option<f64>,
    /// Poisson's ratio there; the body's where not given.
    #[serde(default)]
    pub poissons_ratio: Option<f64>,
    /// Mass density (kg/m^3) there; the body's where not given.
    #[serde(default)]
    pub density: Option<f64>,
    /// Fibres there; the body's where not given.
    #[serde(default)]
    pub fiber: Option<Fiber>,
}

impl Material {
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

    /// The material as the elastic model has it.
    #[must_use]
    pub fn law(&self) -> elastic::Material {
        let (modulus, ratio) = (self.youngs_modulus, self.poissons_ratio);
        let law = match self.model {
            Model::StableNeoHookean => elastic::Material::stable_neo_hookean(modulus, ratio),
            Model::NeoHookean => elastic::Material::neo_hookean(modulus, ratio),
            Model::SaintVenantKirchhoff => {
                elastic::Material::saint_venant_kirchhoff(modulus, ratio)
            }
            Model::MooneyRivlin { share } => {
                elastic::Material::mooney_rivlin(modulus, ratio, share)
            }
        };
        let barrier = match self.model {
            Model::StableNeoHookean => BARRIER * law.lame_mu(),
            _ => 0.0,
        };
        let terms = self.viscosity.iter().map(|term| elastic::PronyTerm {
            ratio: term.ratio,
            relaxation_time: term.time,
        });
        let law = law
            .with_volume_constant(self.volume_constant)
            .with_barrier(barrier)
            .with_prony(&terms.collect::<Vec<_>>());
        match self.fiber {
            None => law,
            Some(fiber) => law.with_fiber(elastic::Fiber {
                direction: fiber.direction,
                stiffness: fiber.stiffness,
                exponent: fiber.exponent,
                dispersion: fiber.dispersion,
            }),
        }
    }

    /// The material of a part of the body.
    #[must_use]
    pub fn within(&self, part: &Inclusion) -> Self {
        Self {
            youngs_modulus: part.youngs_modulus.unwrap_or(self.youngs_modulus),
            poissons_ratio: part.poissons_ratio.unwrap_or(self.poissons_ratio),
            density: part.density.unwrap_or(self.density),
            fiber: part.fiber.or(self.fiber),
            ..self.clone()
        }
    }
}
