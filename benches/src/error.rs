//! Why a study did not end.

use std::path::PathBuf;

/// A study that did not end. A scene that does not end is a row, not an error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LabError {
    /// A scene of a study is not valid.
    #[error(transparent)]
    Scene(#[from] phyxel::scene::SceneError),
    /// A body of a study cannot be built or moved.
    #[error("{0}")]
    World(Box<phyxel::world::WorldError>),
    /// A body of a study cannot be built or solved for.
    #[error("{0}")]
    Study(Box<phyxel::study::StudyError>),
    /// A kept state does not read as it was written.
    #[error("a kept state: {0}")]
    State(#[source] serde_json::Error),
    /// Rows cannot be written.
    #[error("{}: {source}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: csv::Error,
    },
    /// A folder cannot be made or read.
    #[error("{}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A mesh is not a solid.
    #[error("{}: {problem}", file.display())]
    Mesh {
        /// The mesh file.
        file: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// Nothing says where the meshes are.
    #[error("PHYXEL_MESHES must name the folder of the meshes")]
    NoMeshes,
    /// The terminal does not take rows.
    #[error("cannot print: {0}")]
    Print(#[from] std::io::Error),
    /// The threads cannot be started.
    #[error("cannot start the threads of a scene: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// No scene has the name that was asked for.
    #[error("no scene of the study has '{filter}' in its name; they are: {names}")]
    NoScene {
        /// What was asked for.
        filter: String,
        /// All names.
        names: String,
    },
}

impl From<phyxel::study::StudyError> for LabError {
    fn from(error: phyxel::study::StudyError) -> Self {
        Self::Study(Box::new(error))
    }
}

impl From<phyxel::world::WorldError> for LabError {
    fn from(error: phyxel::world::WorldError) -> Self {
        Self::World(Box::new(error))
    }
}
