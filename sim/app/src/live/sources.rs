//! Scenes that a session can be about.

use std::path::{Path, PathBuf};

use phyxel::scene::Scene;
use phyxel_scene::{EMBEDDED, TextError};

/// Reads the default scene of a mesh file, with so many metres per unit of it or as its size suggests; the words of a
/// failure are for people.
pub type MeshReader = dyn Fn(&Path, Option<f64>) -> Result<(Scene, String), String> + Send;

/// The embedded scenes and more, and how mesh files are understood.
pub struct Sources {
    /// Those beside the embedded ones, newest first, with the mesh files that they were made for.
    own: Vec<(Scene, Option<PathBuf>)>,
    meshes: Box<MeshReader>,
}

impl std::fmt::Debug for Sources {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut out = out.debug_struct("Sources");
        out.field("own", &self.own).finish_non_exhaustive()
    }
}

impl Sources {
    /// The embedded scenes, with `first` before them, which was made for a mesh file or for none.
    #[must_use]
    pub fn new(first: &Scene, mesh: Option<PathBuf>, meshes: Box<MeshReader>) -> Self {
        Self {
            own: vec![(first.clone(), mesh)],
            meshes,
        }
    }

    /// Names and summaries.
    pub(super) fn names(&self) -> Vec<[String; 2]> {
        let own = self.own.iter().map(|(scene, _)| scene);
        let own = own.map(|scene| [scene.name.clone(), scene.description.clone()]);
        let is_new = |name: &str| self.own.iter().all(|(scene, _)| scene.name != name);
        let embedded = EMBEDDED.iter().filter(|scene| is_new(scene.name));
        let embedded = embedded.map(|scene| [scene.name, scene.summary].map(str::to_owned));
        own.chain(embedded).collect()
    }

    fn find(&self, name: &str) -> Option<&(Scene, Option<PathBuf>)> {
        self.own.iter().find(|(scene, _)| scene.name == name)
    }

    /// The scene of a name.
    pub(super) fn scene(&self, name: &str) -> Result<Scene, TextError> {
        match self.find(name) {
            Some((scene, _)) => Ok(scene.clone()),
            None => phyxel_scene::embedded(name, &[]),
        }
    }

    /// The default scene of a mesh file, which can be asked for from now on; as [`MeshReader`].
    pub(super) fn take_mesh(
        &mut self,
        file: &Path,
        scale: Option<f64>,
    ) -> Result<(Scene, String), String> {
        let (scene, note) = (self.meshes)(file, scale)?;
        self.own.retain(|(own, _)| own.name != scene.name);
        let made = (scene.clone(), Some(file.to_owned()));
        self.own.insert(0, made);
        Ok((scene, note))
    }

    /// The mesh file that the scene of a name was made for.
    pub(super) fn mesh_of(&self, name: &str) -> Option<&Path> {
        self.find(name)?.1.as_deref()
    }
}
