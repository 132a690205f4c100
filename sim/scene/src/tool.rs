//! Rigid tools: their path through the world, and how they touch.

use glam::DVec3;
use phyxel_integrate::{
    Contact, ContactSettings, ContactSurface, Pose, RigidShape as ToolShape, RigidTool, penalty,
};
use serde::{Deserialize, Serialize};

use super::path::{Key, one, pose_at};
use super::rigid::RigidMesh;

/// A rigid tool that touches the bodies.
///
/// It is in the world from the first step on: while the bodies settle it stands at its first key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Tool {
    /// Name in reports; unique among the tools.
    #[serde(default = "Tool::default_name")]
    pub name: String,
    /// Name of the body that it touches; every body where not given.
    #[serde(default)]
    pub body: Option<String>,
    /// What the tool occupies in its own frame.
    pub shape: ToolShape,
    /// Translation (m) of the tool with its whole path.
    #[serde(default)]
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub position: DVec3,
    /// Size of the tool over that which its shape says; its path stays.
    #[serde(default = "one")]
    pub scale: f64,
    /// What pictures show instead of its shape, in its own frame and at its scale; contact is with the shape.
    #[serde(default)]
    pub looks: Option<RigidMesh>,
    /// How the tool moves through the world. Without keys it stands still; a released tool has one at most.
    #[serde(default)]
    pub path: Vec<Key>,
    /// Lets the tool go at scene time 0 from its only key: forces move it from then on.
    #[serde(default)]
    pub release: Option<Release>,
    /// Coulomb's coefficient of friction.
    #[serde(default)]
    pub friction: f64,
    /// Pressure over penetration (N/m^3); 40 E over the node spacing where not given.
    #[serde(default)]
    pub penalty: Option<f64>,
}

impl Tool {
    /// A tool on a path, without friction, that touches every body; a fixed obstacle where the path has no key.
    #[must_use]
    pub fn new(shape: ToolShape, path: Vec<Key>) -> Self {
        Self {
            name: Self::default_name(),
            body: None,
            shape,
            position: DVec3::ZERO,
            scale: 1.0,
            looks: None,
            path,
            release: None,
            friction: 0.0,
            penalty: None,
        }
    }

    /// Its shape at its scale.
    #[must_use]
    pub fn solid(&self) -> ToolShape {
        self.shape.scaled(self.scale)
    }

    /// Where its path has it at a scene time (s).
    #[must_use]
    pub fn pose_at(&self, time: f64) -> Pose {
        let mut pose = pose_at(&self.path, time);
        pose.position += self.position;
        pose
    }

    /// The tool at its first key, in contact with the surface of a body of a modulus (Pa) whose nodes are `spacing` (m) apart.
    #[must_use]
    pub fn standing(
        &self,
        surface: ContactSurface,
        youngs_modulus: f64,
        spacing: f64,
    ) -> RigidTool {
        let usual = || penalty(youngs_modulus, spacing);
        let settings = ContactSettings {
            friction: self.friction,
            ..ContactSettings::new(self.penalty.unwrap_or_else(usual))
        };
        let contact = Contact::new(surface, settings);
        RigidTool::standing(self.solid(), self.pose_at(0.0), contact)
    }

    fn default_name() -> String {
        "tool".to_owned()
    }
}

/// What moves a tool that no path moves, beside the contact; it does not turn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Release {
    /// Mass (kg); the scene's gravity acts on it.
    pub mass: f64,
    /// Constant force (N), as of a hand.
    #[serde(default)]
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub force: DVec3,
    /// Mass-proportional damping (1/s).
    #[serde(default)]
    pub damping: f64,
}
