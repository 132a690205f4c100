//! The command line.

mod check;
#[cfg(feature = "live")]
mod live;
mod run;
mod sample;
mod scenes;
mod source;
mod sweep;

pub use check::{load, run_time};

use std::io::{self, Write};
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};

use crate::output::{CheckpointError, InputFileError, OutputError};
use crate::run::RunError;
use crate::sweep::SweepError;
use phyxel_scene::{Place, TextError};

/// Point-based surgical simulation: runs scenes in which soft bodies deform and are cut.
#[derive(Debug, Parser)]
#[command(name = "phyxel", version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: run::RunFlags,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a scene, or the default scene of a mesh.
    Run(run::RunArguments),
    /// Read and validate a scene and say what it asks for; run nothing.
    Check(check::CheckArguments),
    /// List the embedded scenes, or print one as RON to start from.
    Scenes(scenes::ScenesArguments),
    /// Fill a mesh with nodes, write them and report their quality.
    Sample(sample::SampleArguments),
    /// Show a scene in a browser, to be cut, pressed and pulled by hand.
    #[cfg(feature = "live")]
    Live(live::LiveArguments),
    /// Run many cases of a scene, each by a process of its own, and put their results into tables.
    Sweep(sweep::SweepArguments),
}

/// Changes of a scene's values.
#[derive(Debug, Args)]
struct Overrides {
    /// Set one value of the scene; may be given several times.
    ///
    /// The value is RON, the path runs from the top of the scene:
    /// `--set 'bodies[0].material.youngs_modulus=3e3'`
    #[arg(long = "set", value_name = "PATH.TO.KEY=VALUE")]
    set: Vec<String>,
}

impl Overrides {
    fn parse(&self) -> Result<Vec<phyxel_scene::Override>, TextError> {
        self.set
            .iter()
            .map(|text| Ok(phyxel_scene::Override::parse(text)?))
            .collect()
    }
}

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
enum CliError {
    #[error(transparent)]
    Scene(#[from] TextError),
    #[error(transparent)]
    Source(#[from] source::SourceError),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    #[error(transparent)]
    Input(#[from] InputFileError),
    /// What of the arguments does not fit, or which cases failed.
    #[error("{0}")]
    Said(String),
    #[error(transparent)]
    Sample(#[from] sample::SampleProblem),
    #[cfg(feature = "live")]
    #[error(transparent)]
    Live(#[from] Box<crate::live::SessionError>),
    #[cfg(feature = "live")]
    #[error(transparent)]
    Server(#[from] phyxel_live::ServerError),
    #[error(transparent)]
    Sweep(#[from] SweepError),
    #[error("{place}: {error}")]
    At { place: Place, error: Box<CliError> },
    #[error("cannot find this program to run cases by: {0}; run them one by one with --case")]
    Program(io::Error),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("cannot write to stderr: {0}")]
    Stderr(io::Error),
    #[error("cannot write to stdout: {0}")]
    Stdout(#[from] io::Error),
    #[error("cannot put the result into JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// A text for a terminal: what a file may hold of control characters is shown and not obeyed.
pub(crate) fn printable(text: &str) -> String {
    let shown = |c: char| match c.is_control() && c != '\n' {
        true => c.escape_default().to_string(),
        false => c.to_string(),
    };
    text.chars().map(shown).collect()
}

/// Writes a line for people on stderr.
fn say(line: &str) -> Result<(), CliError> {
    writeln!(io::stderr(), "{}", printable(line)).map_err(CliError::Stderr)
}

/// Runs the program with the arguments it was started with.
#[must_use]
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let result = match cli.command {
        None => run::run(None, &cli.run),
        Some(Command::Run(arguments)) => run::run(arguments.scene.as_deref(), &arguments.flags),
        Some(Command::Check(arguments)) => check::check(&arguments),
        Some(Command::Scenes(arguments)) => scenes::scenes(&arguments),
        Some(Command::Sample(arguments)) => sample::sample(&arguments),
        #[cfg(feature = "live")]
        Some(Command::Live(arguments)) => live::live(&arguments),
        Some(Command::Sweep(arguments)) => sweep::sweep(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        // Whoever reads stdout or stderr has heard enough.
        Err(CliError::Stdout(error) | CliError::Stderr(error))
            if error.kind() == io::ErrorKind::BrokenPipe =>
        {
            ExitCode::SUCCESS
        }
        Err(error) => {
            for line in printable(&error.to_string()).lines() {
                // Nobody is left to tell if stderr is gone too; the status says it.
                let _ = writeln!(io::stderr(), "error: {line}");
            }
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::printable;

    #[test]
    fn control_characters_are_shown() {
        assert_eq!(
            printable("a\n\u{1b}[31mb\r\u{9b}c ä"),
            "a\n\\u{1b}[31mb\\r\\u{9b}c ä"
        );
    }
}
