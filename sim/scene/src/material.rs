//! Parts of a body that are made of something else.

use phyxel_elastic::{Fiber, MaterialSettings};
use serde::{Deserialize, Serialize};

use super::region::Region;

/// A part of a body of another stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
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

impl Inclusion {
    /// What it is made of in a body of a material.
    #[must_use]
    pub fn within(&self, body: &MaterialSettings) -> MaterialSettings {
        MaterialSettings {
            youngs_modulus: self.youngs_modulus.unwrap_or(body.youngs_modulus),
            poissons_ratio: self.poissons_ratio.unwrap_or(body.poissons_ratio),
            density: self.density.unwrap_or(body.density),
            fiber: self.fiber.or(body.fiber),
            ..body.clone()
        }
    }
}
