//! The plots of the READMEs, each drawn by `cargo run --release -p benches -- draw NAME --out FOLDER`.

mod convergence;
mod force;

use std::path::Path;

use clap::ValueEnum;

use crate::StudyError;
use crate::error::of_file;

/// A plot of a README.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Drawing {
    /// Moving least squares: error against spacing (`mls/convergence.svg`).
    Convergence,
    /// Force against indentation (`integrate/force_indentation.svg`).
    Force,
}

impl Drawing {
    /// Draws into `folder`, which is made if it is not there.
    pub fn draw(self, folder: &Path) -> Result<(), StudyError> {
        std::fs::create_dir_all(folder).map_err(of_file(folder))?;
        match self {
            Self::Convergence => convergence::draw(folder),
            Self::Force => force::draw(folder),
        }
    }
}
