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
    /// A cloud was not made as the stencils need it.
    #[error("a study's body: {0}")]
    Stencil(#[from] phyxel_mls::StencilError),
    /// Neighbours could not be searched.
    #[error("a study's body: {0}")]
    Cloud(#[from] phyxel_mls::CloudError),
    /// Neighbourhoods could not be made symmetric.
    #[error("a study's body: {0}")]
    Graph(#[from] phyxel_mls::GraphError),
    /// Shape functions do not exist at a node.
    #[error("a study's body: {0}")]
    Shape(#[from] phyxel_mls::ShapeError),
    /// The elastic model does not take a body.
    #[error("a study's body: {0}")]
    Elastic(#[from] phyxel_elastic::ElasticError),
    /// A body has no surface to press.
    #[error("a study's body: {0}")]
    Surface(#[from] phyxel_integrate::SurfaceError),
    /// A support of a study does not move as asked.
    #[error("a study's body: {0}")]
    Path(#[from] phyxel_integrate::TrajectoryError),
    /// A body of a study has no largest eigenvalue.
    #[error("a study's body: {0}")]
    Eigenvalue(#[from] phyxel_integrate::EigenvalueError),
    /// A body of a study does not move.
    #[error("a study's body: {0}")]
    Motion(#[from] phyxel_integrate::MotionError),
    /// A body of a study went astray.
    #[error("a study's body: {0}")]
    Step(#[from] phyxel_integrate::StepError),
    /// A mesh of a study cannot be read.
    #[error(transparent)]
    Read(#[from] phyxel_discretize::ReadError),
    /// A surface of a study cannot be sampled.
    #[error("a study's surface: {0}")]
    Sample(#[from] phyxel_discretize::SampleError),
    /// A picture of a study cannot be encoded or read.
    #[error("a study's picture: {0}")]
    Image(#[from] phyxel_splat::ImageError),
    /// Surfels of a study are not usable.
    #[error("a study's surface: {0}")]
    Surfel(#[from] phyxel_splat::SurfelError),
    /// A cut of a study is none.
    #[error("a study's cut: {0}")]
    Cut(#[from] phyxel_enrich::CutError),
    /// A cut of a study has no grid.
    #[error("a study's cut: {0}")]
    Grid(#[from] phyxel_enrich::GridError),
}

impl From<phyxel::WorldError> for StudyError {
    fn from(error: phyxel::WorldError) -> Self {
        Self::World(Box::new(error))
    }
}
