//! Why a study did not end.

use std::error::Error;
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// A study that did not end. A scene that does not end is a row, not an error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// What a scene, a change of it, a world, a picture or a folder of output says of itself.
    #[error("{0}")]
    Plain(Box<dyn Error + Send + Sync>),
    /// A snapshot does not read as it was written.
    #[error("a snapshot: {0}")]
    State(#[source] serde_json::Error),
    /// Findings cannot be put into JSON.
    #[error("cannot put what was found into JSON: {0}")]
    Json(#[source] serde_json::Error),
    /// A file or folder cannot be made, read or written, or a mesh is no solid.
    #[error("{}: {problem}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// The blade of a study touches nothing.
    #[error("the blade of a study cuts nothing")]
    Uncut,
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
    /// A plot cannot be drawn.
    #[error("plot '{plot}': {reason}")]
    Plot {
        /// Title of the plot.
        plot: String,
        /// What the plotter said.
        reason: String,
    },
    /// A body of a study finds no equilibrium.
    #[error("a study's body: {0}")]
    Equilibrium(#[from] phyxel_integrate::SolveError),
    /// A linear system of a study was not solved.
    #[error("a study's linear system stopped at a relative residual of {residual:e}")]
    NotSolved {
        /// Relative residual that was reached.
        residual: f64,
    },
    /// A body, surface or picture of a study is not as its crate needs it.
    #[error("a study's body: {0}")]
    Body(Box<dyn Error + Send + Sync>),
}

impl StudyError {
    /// Names the file or folder that a problem is of.
    pub(crate) fn of_file<E: Display>(path: &Path) -> impl Fn(E) -> Self {
        let path = path.to_owned();
        move |problem| Self::File {
            path: path.clone(),
            problem: problem.to_string(),
        }
    }
}

/// Errors that a variant holds as they are.
macro_rules! held {
    ($($variant:ident: $($error:ty),*;)*) => {
        $($(impl From<$error> for StudyError {
            fn from(error: $error) -> Self {
                Self::$variant(Box::new(error))
            }
        })*)*
    };
}

held! {
    Plain:
        phyxel::WorldError,
        phyxel_cli::output::OutputError,
        phyxel_cli::picture::PictureError,
        phyxel_scene::OverrideError,
        phyxel_scene::SceneError;
    Body:
        phyxel_discretize::ReadError,
        phyxel_discretize::SampleError,
        phyxel_elastic::ElasticError,
        phyxel_enrich::CutError,
        phyxel_enrich::GridError,
        phyxel_integrate::EigenvalueError,
        phyxel_integrate::MotionError,
        phyxel_integrate::StepError,
        phyxel_integrate::SurfaceError,
        phyxel_integrate::TrajectoryError,
        phyxel_mls::CloudError,
        phyxel_mls::GraphError,
        phyxel_mls::ShapeError,
        phyxel_mls::StencilError,
        phyxel_splat::SurfelError;
}
