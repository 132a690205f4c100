//! Scenes: what is simulated, as plain types with their checks. `phyxel-scene` reads them from texts.

mod body;
mod check;
mod contact;
mod event;
mod material;
mod method;
mod path;
mod region;
mod rigid;
mod scheme;
mod settings;
mod tool;

use serde::{Deserialize, Serialize};

pub use body::{
    Body, Form, ImageFile, PointFile, Sampling, SurfelSettings, SurfelSpacing, SurfelTarget, Target,
};
pub use check::{DidYouMean, Fault, nearest};
pub use contact::{Between, BodyContact};
pub use event::{Capture, Cut, Gravity, Support, SupportMotion};
pub use material::Inclusion;
pub use method::Method;
pub use path::{Key, pose_at};
pub use phyxel_discretize::{Axis, Refinement, Shape, UnitGuess};
pub use phyxel_elastic::{Dilatation, Fiber, MaterialSettings, Model, Preset, PronyTerm};
pub use phyxel_enrich::CutRule;
pub use phyxel_integrate::{Pose, RigidShape as ToolShape};
pub use phyxel_splat::{DrawMode, InsideTest, Measure, RadiusRule, View, WeightLaw};
pub use region::Region;
pub use rigid::RigidMesh;
pub use scheme::Scheme;
pub use settings::{Backdrop, Coloring, Integration, Observe, Pictures, Rest, Settle, Show};
pub use tool::{Release, Tool};

/// The version of the scene format.
pub const VERSION: u32 = 1;

/// A scene: bodies, what acts on them, how time passes and what is written down.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Version of the format; 1.
    pub version: u32,
    /// Name in reports and of the default output folder.
    #[serde(default = "Scene::default_name")]
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// The deformable bodies, at least one.
    pub bodies: Vec<Body>,
    /// Regions that are held or driven.
    #[serde(default)]
    pub supports: Vec<Support>,
    /// Uniform gravity; `None` for weightlessness.
    #[serde(default = "Scene::default_gravity")]
    pub gravity: Option<Gravity>,
    /// Rigid tools.
    #[serde(default)]
    pub tools: Vec<Tool>,
    /// Contact of the bodies with each other and of the flanks of their cuts; without it all pass through each other.
    #[serde(default)]
    pub contact: Option<BodyContact>,
    /// Strokes of blades.
    #[serde(default)]
    pub cuts: Vec<Cut>,
    /// Time stepping.
    #[serde(default)]
    pub integration: Integration,
    /// What is written down.
    #[serde(default)]
    pub observe: Observe,
    /// What is drawn; `None` draws nothing and computes no surfels.
    #[serde(default)]
    pub pictures: Option<Pictures>,
}

impl Scene {
    /// A scene of `bodies` with everything else at its default.
    #[must_use]
    pub fn new(name: &str, bodies: Vec<Body>) -> Self {
        Self {
            version: VERSION,
            name: name.to_owned(),
            description: String::new(),
            bodies,
            supports: Vec::new(),
            gravity: Self::default_gravity(),
            tools: Vec::new(),
            contact: None,
            cuts: Vec::new(),
            integration: Integration::default(),
            observe: Observe::default(),
            pictures: None,
        }
    }

    fn default_name() -> String {
        "scene".to_owned()
    }

    #[allow(
        clippy::unnecessary_wraps,
        reason = "serde asks for a value of the field's type"
    )]
    fn default_gravity() -> Option<Gravity> {
        Some(Gravity::default())
    }
}

/// An embedded scene, of the package above that reads texts.
#[cfg(test)]
pub(crate) fn embedded(name: &str) -> Scene {
    let file = format!("{}/scene/scenes/{name}.ron", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(file).expect("the scene is there");
    let options = ron::Options::default();
    let options = options.with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    options.from_str(&text).expect("it can be read")
}
