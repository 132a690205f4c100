//! Why a study did not end.

use std::path::PathBuf;

/// A study that did not end. A scene that does not end is a row, not an error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A scene of a study is not valid.
    #[error(transparent)]
    Scene(#[from] phyxel_scene::SceneError),
    /// A change of a study's scene does not fit.
    #[error(transparent)]
    Override(#[from] phyxel_scene::OverrideError),
    /// A body of a study cannot be built or moved.
    #[error("{0}")]
    World(Box<phyxel::WorldError>),
    /// A body of a study cannot be drawn.
    #[error(transparent)]
    Picture(#[from] phyxel_cli::picture::PictureError),
    /// A snapshot does not read as it was written.
    #[error("a snapshot: {0}")]
    State(#[source] serde_json::Error),
    /// Findings cannot be put into JSON.
    #[error("cannot put what was found into JSON: {0}")]
    Json(#[source] serde_json::Error),
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
    /// A result cannot be written.
    #[error(transparent)]
    Output(#[from] phyxel_cli::output::OutputError),
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
    Body(Box<dyn std::error::Error + Send + Sync>),
}

/// What crates say of studies' bodies.
macro_rules! of_bodies {
    ($($error:ty),* $(,)?) => {
        $(impl From<$error> for StudyError {
            fn from(error: $error) -> Self {
                Self::Body(Box::new(error))
            }
        })*
    };
}

of_bodies![
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
    phyxel_splat::ImageError,
    phyxel_splat::SurfelError,
];

impl From<phyxel::WorldError> for StudyError {
    fn from(error: phyxel::WorldError) -> Self {
        Self::World(Box::new(error))
    }
}
