//! `phyxel run`.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;

use super::source::Source;
use super::{CliError, Overrides};
use crate::run::{RunOptions, run as run_scene, table};

#[derive(Debug, Args)]
pub(super) struct RunArguments {
    /// Embedded scene, scene file (.ron) or mesh file.
    #[arg(value_name = "SCENE|MESH")]
    pub(super) scene: Option<String>,
    #[command(flatten)]
    pub(super) flags: RunFlags,
}

#[derive(Debug, Args)]
pub(super) struct RunFlags {
    /// Folder for the results [default: out/NAME with the scene's name]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    overrides: Overrides,
    /// Number of threads [default: all of the machine's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Show nothing but errors.
    #[arg(long)]
    quiet: bool,
    /// Print the summary as one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// Runs the scene that `argument` names, or the first embedded one.
pub(super) fn run(argument: Option<&str>, flags: &RunFlags) -> Result<(), CliError> {
    let overrides = flags.overrides.parse()?;
    let (scene, note) = Source::of(argument)?.scene(&overrides)?;
    if let Some(note) = note.filter(|_| !flags.quiet) {
        writeln!(io::stderr(), "{note}").map_err(CliError::Stderr)?;
    }
    let options = RunOptions {
        out: flags
            .out
            .clone()
            .unwrap_or_else(|| PathBuf::from("out").join(&scene.name)),
        threads: flags.threads.map(usize::from),
        quiet: flags.quiet,
    };
    let summary = run_scene(&scene, &options)?;
    if !flags.quiet {
        write!(io::stderr(), "{}", table(&summary, &options.out)).map_err(CliError::Stderr)?;
    }
    if flags.json {
        let text = serde_json::to_string(&summary)?;
        writeln!(io::stdout(), "{text}")?;
    }
    Ok(())
}
