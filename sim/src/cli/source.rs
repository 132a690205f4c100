//! What a scene argument names: an embedded scene, a scene file or a mesh.

use std::path::{Path, PathBuf};

use crate::scene::{EMBEDDED, Override, Scene, SceneError};

use super::CliError;

/// Extensions of mesh files.
const MESH_EXTENSIONS: [&str; 6] = ["obj", "stl", "ply", "off", "vtk", "msh"];

/// An argument that names nothing that can be run.
#[derive(Debug, thiserror::Error)]
pub(super) enum SourceError {
    #[error(
        "{}: neither a scene (.ron) nor a mesh ({})",
        file.display(),
        MESH_EXTENSIONS.map(|extension| format!(".{extension}")).join(", ")
    )]
    Extension { file: PathBuf },
}

/// What an argument names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Source {
    Embedded(String),
    File(PathBuf),
    Mesh(PathBuf),
}

impl Source {
    /// Understands `argument`; the first embedded scene where there is none.
    pub(super) fn of(argument: Option<&str>) -> Result<Self, SourceError> {
        let Some(argument) = argument else {
            return Ok(Self::Embedded(EMBEDDED[0].name.to_owned()));
        };
        let path = Path::new(argument);
        let extension = path
            .extension()
            .map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("ron") => Ok(Self::File(path.to_owned())),
            Some(extension) if MESH_EXTENSIONS.contains(&extension) => {
                Ok(Self::Mesh(path.to_owned()))
            }
            None if !path.exists() && path.components().count() == 1 => {
                Ok(Self::Embedded(argument.to_owned()))
            }
            None if EMBEDDED.iter().any(|scene| scene.name == argument) => {
                Ok(Self::Embedded(argument.to_owned()))
            }
            _ => Err(SourceError::Extension {
                file: path.to_owned(),
            }),
        }
    }

    /// The scene, changed and validated.
    pub(super) fn scene(&self, overrides: &[Override]) -> Result<Scene, CliError> {
        match self {
            Self::Embedded(name) => Ok(Scene::embedded(name, overrides)?),
            Self::File(file) => Ok(Scene::load(file, overrides)?),
            Self::Mesh(file) => Err(CliError::Scene(SceneError::Read {
                file: file.clone(),
                source: std::io::ErrorKind::Unsupported.into(),
            })),
        }
    }
}
