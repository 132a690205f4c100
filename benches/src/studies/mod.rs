//! Studies: error beside time, reproduced by one command each.
//!
//! A study answers one question with tables and plots. Running one writes every table as CSV, every
//! plot as SVG, and one HTML page with all of them and the machine.

mod chapter6;
mod contact;
mod convergence;
mod crack;
mod field;
mod figures;
mod hertz;
mod opening;
mod sag;
mod splat;

use std::path::PathBuf;

use phyxel::scene::Scene;
use phyxel_cli::output::OutputFolder;
use phyxel_scene::Override;

use crate::StudyError;
use crate::report::{Report, draw, html};

/// An embedded scene with changes of its text.
pub(crate) fn embedded(name: &str, changes: &[&str]) -> Result<Scene, StudyError> {
    let changes = changes.iter().map(|change| Override::parse(change));
    let changes = changes.collect::<Result<Vec<_>, _>>()?;
    Ok(phyxel_scene::embedded(name, &changes)?)
}

/// How much is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// Everything that the page shows.
    Full,
    /// The small sizes only: the same code in seconds.
    Quick,
}

impl Effort {
    pub(crate) fn choose<T>(self, full: T, quick: T) -> T {
        match self {
            Self::Full => full,
            Self::Quick => quick,
        }
    }
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

/// The studies of a table: name, function, title and question.
macro_rules! studies {
    ($($name:literal $run:path, $title:literal, $question:literal;)*) => {
        &[$(Study { name: $name, title: $title, question: $question, run: $run }),*]
    };
}

/// Every study.
pub const STUDIES: &[Study] = studies! {
    "convergence" convergence::run, "Moving least squares on smooth data",
        "how fast do errors of value and gradient fall with the spacing, by order of the basis?";
    "hertz" hertz::run, "A sphere pressed into a block",
        "how far off is the force of a tool, against half-space theory and finite elements?";
    "field" field::run, "Displacements under a sphere, as nodal values and as read",
        "how far are nodes' displacements off, and how far those that are drawn and written?";
    "contact" contact::run, "Bodies and flanks that touch",
        "how far off are forces, times and distances of deformable bodies in contact?";
    "crack" crack::run, "Cracks with a known answer",
        "how far off are stress intensity and opening of a cut, and what does it cost?";
    "opening" opening::run, "A body cut while it is drawn out",
        "how far off are opening and energy of a dynamic cut at finite strain, against finite elements?";
    "chapter6" chapter6::run, "The dissertation's chapter 6 again",
        "how do its model and phyxel do on its bodies: error, speed, energy of the cuts?";
    "splat" splat::run, "Surfaces drawn as splats",
        "how far is a picture of splats from the exact one, and what does it cost?";
    "figures" figures::run, "The dissertation's figures",
        "what does each figure with data show there, and what does it show here?";
};

/// What a study found.
#[derive(Debug, Clone)]
pub struct Findings {
    /// The study.
    pub study: Study,
    /// How much was computed.
    pub effort: Effort,
    /// Wall time of the study (s).
    pub seconds: f64,
    /// Tables, plots and words.
    pub report: Report,
}

impl Study {
    /// The study `name`, if there is one.
    pub fn named(name: &str) -> Option<&'static Self> {
        STUDIES.iter().find(|study| study.name == name)
    }

    /// Runs the study and writes its tables and plots into `folder`.
    pub fn run(&self, folder: &OutputFolder, effort: Effort) -> Result<Findings, StudyError> {
        let start = std::time::Instant::now();
        let report = (self.run)(effort)?;
        let seconds = start.elapsed().as_secs_f64();
        for table in &report.tables {
            let name = format!("{}-{}.csv", self.name, table.name);
            folder.write(&name, &table.to_csv())?;
        }
        for plot in &report.plots {
            let name = format!("{}-{}.svg", self.name, plot.name);
            folder.write(&name, draw(plot)?.as_bytes())?;
        }
        Ok(Findings {
            study: *self,
            effort,
            seconds,
            report,
        })
    }
}

/// Writes the page `index.html` of some findings into `folder`; returns its path.
pub fn write_page(folder: &OutputFolder, findings: &[Findings]) -> Result<PathBuf, StudyError> {
    folder.write("index.html", html(findings)?.as_bytes())?;
    Ok(folder.path().join("index.html"))
}
