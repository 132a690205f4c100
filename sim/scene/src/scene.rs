//! The whole of a scene.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::{
    Body, BodyContact, Cut, Gravity, Integration, Observe, Pictures, Shape, Support, Tool,
};

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

    /// Files that it names: meshes, images and points.
    pub fn files_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let bodies = self.bodies.iter_mut().flat_map(|body| {
            let mesh = match &mut body.shape {
                Shape::Mesh { file, .. } => Some(file),
                _ => None,
            };
            let surfels = &mut body.surfels;
            let images = [&mut surfels.image, &mut surfels.cut_image].into_iter();
            let images = images.flatten().map(|image| &mut image.file);
            let points = surfels.points.as_mut().map(|points| &mut points.file);
            mesh.into_iter().chain(images).chain(points)
        });
        let looks = self.tools.iter_mut().flat_map(|tool| &mut tool.looks);
        let drawn = self.pictures.iter_mut();
        let drawn = drawn.flat_map(|pictures| &mut pictures.meshes);
        bodies.chain(looks.chain(drawn).map(|mesh| &mut mesh.file))
    }

    fn default_name() -> String {
        "scene".to_owned()
    }

    fn default_gravity() -> Option<Gravity> {
        Some(Gravity::default())
    }
}
