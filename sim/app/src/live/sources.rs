//! Scenes that a session can be about.

use std::path::{Path, PathBuf};

use phyxel::scene::Scene;
use phyxel_scene::{EMBEDDED, SceneError};

/// Reads the default scene of a mesh file, with so many metres per unit of it or as its size suggests; the words of a
/// failure are for people.
pub type MeshReader = dyn Fn(&Path, Option<f64>) -> Result<(Scene, String), String> + Send;

/// A scene that can be asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneSource {
    /// Name by which it is asked for.
    pub name: String,
    /// One line for people.
    pub summary: String,
    scene: Option<Scene>,
}

/// All of them, and how mesh files are understood.
pub struct Sources {
    list: Vec<SceneSource>,
    meshes: Box<MeshReader>,
    /// Names of scenes made for mesh files, and the files.
    made: Vec<(String, PathBuf)>,
}

impl std::fmt::Debug for Sources {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("Sources")
            .field("list", &self.list)
            .finish_non_exhaustive()
    }
}

impl Sources {
    /// The embedded scenes, with `first` before them, which was made for a mesh file or for none.
    #[must_use]
    pub fn new(first: &Scene, mesh: Option<PathBuf>, meshes: Box<MeshReader>) -> Self {
        let embedded = EMBEDDED.iter().map(|scene| SceneSource {
            name: scene.name.to_owned(),
            summary: scene.summary.to_owned(),
            scene: None,
        });
        let mut sources = Self {
            list: embedded.collect(),
            meshes,
            made: mesh
                .map(|file| (first.name.clone(), file))
                .into_iter()
                .collect(),
        };
        sources.add(first);
        sources
    }

    /// Adds a scene, or replaces the one of the same name.
    fn add(&mut self, scene: &Scene) {
        self.list.retain(|source| source.name != scene.name);
        let source = SceneSource {
            name: scene.name.clone(),
            summary: scene.description.clone(),
            scene: Some(scene.clone()),
        };
        self.list.insert(0, source);
    }

    /// Names and summaries.
    #[must_use]
    pub fn list(&self) -> &[SceneSource] {
        &self.list
    }

    /// The scene of a name.
    ///
    /// # Errors
    /// [`SceneError`] if there is none.
    pub fn scene(&self, name: &str) -> Result<Scene, SceneError> {
        let known = self.list.iter().find(|source| source.name == name);
        match known.and_then(|source| source.scene.as_ref()) {
            Some(scene) => Ok(scene.clone()),
            None => phyxel_scene::embedded(name, &[]),
        }
    }

    /// The default scene of a mesh file, which can be asked for from now on; as [`MeshReader`].
    ///
    /// # Errors
    /// Words for people.
    pub fn take_mesh(
        &mut self,
        file: &Path,
        scale: Option<f64>,
    ) -> Result<(Scene, String), String> {
        let (scene, note) = (self.meshes)(file, scale)?;
        self.add(&scene);
        self.made.retain(|(name, _)| *name != scene.name);
        self.made.push((scene.name.clone(), file.to_owned()));
        Ok((scene, note))
    }

    /// The mesh file that the scene of a name was made for.
    #[must_use]
    pub fn mesh_of(&self, name: &str) -> Option<&Path> {
        let made = self.made.iter().find(|(made, _)| made == name);
        made.map(|(_, file)| file.as_path())
    }
}
