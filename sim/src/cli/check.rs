//! `phyxel check`.

use std::io::{self, Write};

use clap::Args;

use super::source::Source;
use super::{CliError, Overrides};

#[derive(Debug, Args)]
pub(super) struct CheckArguments {
    /// Embedded scene, scene file (.ron) or mesh file.
    #[arg(value_name = "SCENE|MESH")]
    scene: String,
    #[command(flatten)]
    overrides: Overrides,
}

/// Validates a scene and prints it with all defaults written out.
pub(super) fn check(arguments: &CheckArguments) -> Result<(), CliError> {
    let overrides = arguments.overrides.parse()?;
    let (scene, note) = Source::of(Some(&arguments.scene))?.scene(&overrides)?;
    let mut out = io::stdout().lock();
    if let Some(note) = note {
        writeln!(out, "{note}")?;
    }
    writeln!(
        out,
        "{}: {} bodies, {} supports, {} cuts, {} s",
        scene.name,
        scene.bodies.len(),
        scene.supports.len(),
        scene.cuts.len(),
        scene.integration.duration
    )?;
    Ok(())
}
