//! Why a world cannot be built or stepped.

use crate::memory::MemoryShortage;
use crate::scene::Fault;
use phyxel_discretize::{ReadError, SampleError, SolidError};
use phyxel_elastic::ElasticError;
use phyxel_enrich::CutError;
use phyxel_integrate::{EigenvalueError, MotionError, SolveError, StepError, SurfaceError};
use phyxel_mls::{CloudError, GraphError, MapError, StencilError};

/// What went wrong in one body.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BodyProblem {
    /// A mesh file or one of points cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The shape is not a solid.
    #[error(transparent)]
    Shape(#[from] SolidError),
    /// No nodes can be placed.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// No neighbours can be looked for.
    #[error(transparent)]
    Cloud(#[from] CloudError),
    /// The node graph is broken.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// The gradient stencils cannot be built.
    #[error(transparent)]
    Stencil(#[from] StencilError),
    /// The elastic model cannot be built or updated.
    #[error(transparent)]
    Elastic(#[from] ElasticError),
    /// The map from the world to the material fails.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The blade's edge cannot be captured.
    #[error(transparent)]
    Cut(#[from] CutError),
    /// The motion cannot be set up.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The stable step cannot be found.
    #[error(transparent)]
    Eigenvalue(#[from] EigenvalueError),
    /// A step failed.
    #[error(transparent)]
    Step(#[from] StepError),
    /// An implicit step or an equilibrium was not found.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The surface cannot be touched.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The surface cannot be sampled for contact with other bodies, or does not follow a cut.
    #[error(transparent)]
    Samples(#[from] phyxel_splat::SurfelError),
    /// The body's solid shows that a value of the scene is not as it must be.
    #[error(transparent)]
    Scene(#[from] Fault),
    /// Its nodes take more memory than there is.
    #[error("{0}; ask for fewer nodes")]
    Memory(#[from] MemoryShortage),
    /// Nothing resists motion, so no step is too large.
    #[error(
        "nothing resists motion: every node is supported or without stiffness; leave nodes free"
    )]
    NoStiffness,
    /// A step failed, and shorter ones from an earlier state did too.
    #[error(
        "{source}; steps of an eighth from an earlier state fail too. Such bodies hang or are pulled far \
         beyond what their material holds: raise material.youngs_modulus, lower gravity, or move \
         tools and blades more slowly"
    )]
    StepsFailed {
        /// What went wrong with the shortest steps.
        source: StepError,
    },
    /// The stable step has all but vanished.
    #[error(
        "its stable step has fallen from {first:.1e} s to {step:.1e} s: tissue is crushed, or pulled far beyond what its \
         material holds. Do not begin with a tool deep inside a body, move tools and blades more slowly, raise \
         material.youngs_modulus or lower gravity"
    )]
    StepVanishes {
        /// The first stable step (s).
        first: f64,
        /// What it is now (s).
        step: f64,
    },
    /// The scene would take more steps than can be taken.
    #[error(
        "the scene would take {steps:.0e} steps of {step:.1e} s: lower material.youngs_modulus, raise material.density, or ask \
         for fewer nodes"
    )]
    TooManySteps {
        /// How many.
        steps: f64,
        /// The first stable step (s).
        step: f64,
    },
    /// Energy appeared or vanished, and shorter steps did not help.
    #[error(
        "energy is not kept: {:.0} % of it appeared or vanished before {time:.4} s, in an eighth of the \
         step too; take more nodes where the body is thin, a stiffer material or a weaker load",
        100.0 * share
    )]
    Unbalanced {
        /// What appeared or vanished, relative to the energy there was.
        share: f64,
        /// Time (s), settling included.
        time: f64,
    },
    /// A snapshot belongs to another body.
    #[error(
        "its nodes are not where the snapshot has them: the mesh file has changed since; run the \
         scene from its start"
    )]
    OtherBody,
    /// The body has something that takes all of its nodes in one place.
    #[error("{0} cannot be shared out over ranks; run the scene with `phyxel run`")]
    NotShared(&'static str),
    /// A snapshot cannot be one of this scene.
    #[error("the snapshot is damaged: {0} do not fit; run the scene from its start")]
    Damaged(&'static str),
}

impl BodyProblem {
    /// The same with the body's name.
    pub(crate) fn of(self, body: &str) -> WorldError {
        WorldError::Body {
            body: body.to_owned(),
            problem: self,
        }
    }
}

/// What a part of a body gave, its problem with the body's name.
pub(crate) fn in_body<T>(
    result: Result<T, impl Into<BodyProblem>>,
    body: &str,
) -> Result<T, WorldError> {
    result.map_err(|problem| problem.into().of(body))
}

/// A world that cannot be built or stepped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WorldError {
    /// The scene is not valid.
    #[error("scene '{name}': {fault}")]
    Scene {
        /// Name of the scene.
        name: String,
        /// The value that is not as it must be.
        fault: Box<Fault>,
    },
    /// A body is at fault.
    #[error("body '{body}': {problem}")]
    Body {
        /// Name of the body.
        body: String,
        /// What went wrong.
        problem: BodyProblem,
    },
    /// The edge of a program's blade is none.
    #[error("the blade's edge needs two points or more, all finite")]
    BadEdge,
    /// The bodies have settled as long as they may, and nobody started the scene.
    #[error(
        "the bodies have settled for {limit} s (integration.settle.limit) and the scene was never \
         started; call World::settle or World::play, or set integration.settle to None"
    )]
    NeverStarted {
        /// Longest time (s) of settling.
        limit: f64,
    },
}
