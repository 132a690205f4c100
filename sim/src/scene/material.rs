//! What bodies are made of.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::event::Region;

/// A hyperelastic material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Material {
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

impl Default for Material {
    fn default() -> Self {
        Self {
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
    /// turned inside out (Smith, de Goes and Kim 2018).
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
