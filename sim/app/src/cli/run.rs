//! `phyxel run`.

use std::ffi::{OsStr, OsString};
use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;

use super::source::Source;
use super::{CliError, Overrides, say};
use crate::output::{Interrupt, read_checkpoint, read_input};
use crate::run::{RunError, RunOptions, replay, resume, run as run_scene, table};
use phyxel_scene::Override;

#[derive(Debug, Args)]
pub(super) struct RunArguments {
    /// Embedded scene, scene file (.ron) or mesh file.
    #[arg(value_name = "SCENE|MESH")]
    pub(super) scene: Option<OsString>,
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
    /// Continue from a checkpoint, in its folder unless --out names another. Only `integration` and
    /// `observe` of its scene can be set.
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
    /// Let tools and blades do what a recording says (`input.csv` of a run with `observe.input`), in
    /// place of the scene's paths.
    #[arg(long, value_name = "FILE", conflicts_with = "resume")]
    replay: Option<PathBuf>,
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
pub(super) fn run(argument: Option<&OsStr>, flags: &RunFlags) -> Result<(), CliError> {
    let overrides = flags.overrides.parse()?;
    let mut options = RunOptions {
        out: PathBuf::new(),
        threads: flags.threads.map(usize::from),
        quiet: flags.quiet,
        interrupt: Some(Interrupt::listen()),
    };
    let summary = if let Some(file) = &flags.resume {
        if let Some(scene) = argument {
            let scene = scene.to_string_lossy();
            let said = format!("--resume uses the scene in its checkpoint: leave out '{scene}'");
            return Err(CliError::Said(said));
        }
        if let Some(fixed) = overrides.iter().find(|change| !is_free(change)) {
            return Err(CliError::Said(format!(
                "--set {fixed}: a checkpoint allows changes of integration and observe only; run the changed \
                 scene from its start"
            )));
        }
        let (scene, state) = read_checkpoint(file, &overrides)?;
        let folder = file.parent().map(PathBuf::from).unwrap_or_default();
        options.out = flags.out.clone().unwrap_or(folder);
        resume(&scene, state, &options)?
    } else {
        let source = Source::of(argument)?;
        let (scene, note) = source.scene(&overrides)?;
        if let Some(note) = note.filter(|_| !flags.quiet) {
            say(&note)?;
        }
        let folder = || PathBuf::from("out").join(&scene.name);
        options.out = flags.out.clone().unwrap_or_else(folder);
        let outcome = match &flags.replay {
            Some(file) => replay(&scene, read_input(file, &scene)?, &options),
            None => run_scene(&scene, &options),
        };
        outcome.map_err(|error| match error {
            error @ (RunError::World(_) | RunError::Picture(_)) => {
                source.locate(&scene, &overrides, error)
            }
            error => error.into(),
        })?
    };
    if !flags.quiet {
        say(table(&summary, &options.out).trim_end())?;
    }
    if flags.json {
        let text = serde_json::to_string(&summary)?;
        writeln!(io::stdout(), "{text}")?;
    }
    Ok(())
}

/// Whether a checkpoint's state stays valid when this is changed.
fn is_free(change: &Override) -> bool {
    ["integration", "observe"].contains(&change.section())
}
