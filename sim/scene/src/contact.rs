//! Contact of deformable bodies.

use serde::{Deserialize, Serialize};

/// How bodies touch each other and themselves: their surfaces and the flanks of their cuts. `contacts.csv` has their
/// forces, states in VTK the pressure at nodes.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct BodyContact {
    /// Coulomb's coefficient of friction.
    #[serde(default)]
    pub friction: f64,
    /// Which bodies touch.
    #[serde(default)]
    pub between: Between,
}

/// Which bodies touch.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Between {
    /// All, each with itself too.
    #[default]
    All,
    /// Pairs of names; a name twice for the flanks of one body.
    Pairs(Vec<(String, String)>),
}
