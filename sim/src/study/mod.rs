//! Studies: error beside time, reproduced by one command each.
//!
//! A study answers one question with tables and plots. Running one writes every table as CSV, every
//! plot as SVG, and one HTML page with all of them and the machine.

mod beam;
pub mod block;
mod clock;
mod crack;
pub mod cracks;
mod cut;
mod gradient;
mod hanging;
mod hertz;
pub mod indentation;
pub mod model;
mod nearest;
mod noise;
mod page;
mod plot;
mod report;
mod splat;
mod stretch;
mod time;

use std::path::PathBuf;

use serde::Serialize;

pub use report::{Axis, Cell, Column, Picture, Plot, Report, Scale, Series, Table};

use crate::output::{OutputError, OutputFolder};
use crate::scene::SceneError;
use crate::world::WorldError;

/// How much is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Effort {
    /// Everything that the page shows.
    Full,
    /// The small sizes only: the same code in seconds.
    Quick,
}

/// A study.
#[derive(Debug, Clone, Copy)]
pub struct Study {
    /// Name on the command line.
    pub name: &'static str,
    /// Title of the page.
    pub title: &'static str,
    /// What the study asks, in one line.
    pub question: &'static str,
    run: fn(Effort) -> Result<Report, StudyError>,
}

/// Every study.
pub const STUDIES: &[Study] = &[
    Study {
        name: "gradient",
        title: "Gradients on scattered nodes",
        question: "how far off is the gradient of a smooth field, and what does it cost?",
        run: gradient::run,
    },
    Study {
        name: "beam",
        title: "A cantilever under a load at its end",
        question: "how far off is the deflection, and what does a simulated second cost?",
        run: beam::run,
    },
    Study {
        name: "stretch",
        title: "A cube stretched with free sides",
        question: "how far off is the stress of each material, and what does its solution cost?",
        run: stretch::run,
    },
    Study {
        name: "hertz",
        title: "A sphere pressed into a block",
        question: "how far off is the force of a tool, against half-space theory and finite elements?",
        run: hertz::run,
    },
    Study {
        name: "crack",
        title: "Cracks with a known answer",
        question: "how far off are stress intensity and opening of a cut, and what does it cost?",
        run: crack::run,
    },
    Study {
        name: "cut",
        title: "Cutting, and the dissertation's chapter 6 again",
        question: "what does a blade update cost, and how fast do the dissertation's bodies run?",
        run: cut::run,
    },
    Study {
        name: "splat",
        title: "Surfaces drawn as splats",
        question: "how far is a picture of splats from the exact one, and what does it cost?",
        run: splat::run,
    },
    Study {
        name: "time",
        title: "Time of a step",
        question: "what does a step cost as the body grows?",
        run: time::run,
    },
];

/// A study that did not end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// No study has this name.
    #[error(
        "no study is called '{name}'{}; there is {}",
        nearest.map_or_else(String::new, |name| format!(" (did you mean '{name}'?)")),
        STUDIES.iter().map(|study| study.name).collect::<Vec<_>>().join(", ")
    )]
    NoSuchStudy {
        /// The name asked for.
        name: String,
        /// The name most like it.
        nearest: Option<&'static str>,
    },
    /// A result cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A plot cannot be drawn.
    #[error("plot '{plot}': {reason}")]
    Plot {
        /// Title of the plot.
        plot: String,
        /// What the plotter said.
        reason: String,
    },
    /// A scene of the study is not valid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A body of the study cannot be built or moved.
    #[error(transparent)]
    World(#[from] WorldError),
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
    /// The surface could not be spread over the nodes.
    #[error("a study's body: {0}")]
    Boundary(#[from] phyxel_mls::BoundaryError),
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
    Path(#[from] phyxel_integrate::PathError),
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
    Mesh(#[from] phyxel_discretize::ReadError),
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
}

/// What a study found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Findings {
    /// Name of the study.
    pub study: &'static str,
    /// How much was computed.
    pub effort: Effort,
    /// The machine, in a line.
    pub machine: String,
    /// Wall time of the study (s).
    pub seconds: f64,
    /// Tables, plots and words.
    pub report: Report,
    /// Files written.
    pub files: Vec<PathBuf>,
}

impl Study {
    /// The study `name`.
    ///
    /// # Errors
    /// [`StudyError::NoSuchStudy`].
    pub fn named(name: &str) -> Result<&'static Self, StudyError> {
        STUDIES
            .iter()
            .find(|study| study.name == name)
            .ok_or_else(|| StudyError::NoSuchStudy {
                name: name.to_owned(),
                nearest: crate::scene::nearest(name, STUDIES.iter().map(|study| study.name)),
            })
    }

    /// Runs the study and writes its tables, plots and pictures into `folder`.
    ///
    /// # Errors
    /// [`StudyError`].
    pub fn run(&self, folder: &OutputFolder, effort: Effort) -> Result<Findings, StudyError> {
        let start = std::time::Instant::now();
        let report = (self.run)(effort)?;
        let seconds = start.elapsed().as_secs_f64();
        let mut files = Vec::new();
        for table in &report.tables {
            let name = format!("{}-{}.csv", self.name, table.name);
            folder.write(&name, table.to_csv().as_bytes())?;
            files.push(folder.path().join(name));
        }
        for plot in &report.plots {
            let name = format!("{}-{}.svg", self.name, plot.name);
            folder.write(&name, plot::draw(plot)?.as_bytes())?;
            files.push(folder.path().join(name));
        }
        for picture in &report.pictures {
            let name = picture.file(self.name);
            let mut png = Vec::new();
            picture.frame.write_png(&mut png)?;
            folder.write(&name, &png)?;
            files.push(folder.path().join(name));
        }
        Ok(Findings {
            study: self.name,
            effort,
            machine: clock::machine(),
            seconds,
            report,
            files,
        })
    }
}

/// Writes the page `index.html` of some findings into `folder`; returns its place.
///
/// # Errors
/// [`StudyError`].
pub fn write_page(folder: &OutputFolder, findings: &[Findings]) -> Result<PathBuf, StudyError> {
    folder.write("index.html", page::html(findings)?.as_bytes())?;
    Ok(folder.path().join("index.html"))
}
