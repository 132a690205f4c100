#![doc = include_str!("../README.md")]

mod command;
mod estimate;
mod front;
mod layout;
mod memory;
mod package;
mod report;
mod share;
mod traffic;
mod vtu;
mod wire;
mod worker;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};

use clap::Parser;
use mpi::Threading;
use phyxel::scene::Scene;
use phyxel_cli::output::{Interrupt, read_checkpoint};
use phyxel_cli::run::{RunOptions, RunState, run_shared, table};
use phyxel_scene::Override;

use front::Front;

/// Runs a scene of one body on all ranks of an MPI job.
#[derive(Debug, Parser)]
#[command(name = "phyxel-ranks", version)]
struct Arguments {
    /// Embedded scene or scene file (.ron).
    #[arg(value_name = "SCENE", required_unless_present_any = ["resume", "ping"])]
    scene: Option<String>,
    /// Folder for the results [default: out/NAME with the scene's name]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Changes a value of the scene; may be given again.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Continue from a checkpoint, of any number of ranks or of `phyxel run`.
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    resume: Option<PathBuf>,
    /// Threads of each rank.
    #[arg(long, value_name = "N", default_value_t = 1)]
    threads: usize,
    /// Threads with which rank 0 builds the body while the others wait [default: those of all ranks on its machine, as far
    /// as it may use the cores]
    #[arg(long, value_name = "N")]
    builders: Option<usize>,
    /// Write every rank's nodes at the end: nodes.pvtu and a .vtu of each rank.
    #[arg(long)]
    vtu: bool,
    /// Measure the latency and the bandwidth between the first two ranks instead.
    #[arg(long)]
    ping: bool,
    /// Show nothing but errors.
    #[arg(long)]
    quiet: bool,
}

type Failure = Box<dyn std::error::Error + Send + Sync>;

fn main() -> ExitCode {
    let Some((universe, level)) = mpi::initialize_with_threading(Threading::Serialized) else {
        eprintln!("error: MPI cannot be started");
        return ExitCode::FAILURE;
    };
    if level < Threading::Serialized {
        eprintln!("error: this MPI does not allow calls from other threads than the first");
        return ExitCode::FAILURE;
    }
    let is_front = wire::rank() == wire::FRONT;
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            if is_front {
                let _ = error.print();
            }
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    if arguments.ping {
        if let Some((latency, bandwidth)) = wire::ping() {
            println!("{:.2} us, {:.2} GB/s", 1e6 * latency, 1e-9 * bandwidth);
        }
        drop(universe);
        return ExitCode::SUCCESS;
    }
    let ranks_here = wire::ranks_here();
    let outcome = if is_front {
        lead(&arguments, ranks_here)
    } else {
        follow(arguments.threads)
    };
    match outcome {
        Ok(()) => {
            drop(universe);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            if !is_front {
                // The job ends when a rank leaves without a word.
                std::process::exit(1);
            }
            drop(universe);
            ExitCode::FAILURE
        }
    }
}

/// A rank that does what rank 0 says.
fn follow(threads: usize) -> Result<(), Failure> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()?;
    Ok(pool.install(worker::serve)?)
}

/// As many threads as all ranks of this machine have, which wait meanwhile; not more than the cores that this process is
/// bound to.
fn usual_builders(ranks_here: usize, threads: usize) -> usize {
    let cores = std::thread::available_parallelism().map_or(1, Into::into);
    (ranks_here * threads).min(cores).max(threads)
}

/// Rank 0.
fn lead(arguments: &Arguments, ranks_here: usize) -> Result<(), Failure> {
    let front = Arc::new(Mutex::new(Front::default()));
    let outcome = run(arguments, ranks_here, &front);
    let mut front = front.lock().unwrap_or_else(PoisonError::into_inner);
    let written = match &outcome {
        Ok(out) if arguments.vtu => front.write(out),
        _ => Ok(()),
    };
    let (counted, traffic) = front.end();
    outcome?;
    written?;
    if !arguments.quiet {
        eprint!("{}", report::table(&counted, &traffic));
    }
    Ok(())
}

/// Runs the scene; the folder of its results.
fn run(
    arguments: &Arguments,
    ranks_here: usize,
    front: &Arc<Mutex<Front>>,
) -> Result<PathBuf, Failure> {
    let overrides = arguments.set.iter().map(|text| Override::parse(text));
    let overrides = overrides.collect::<Result<Vec<_>, _>>()?;
    let (scene, state, folder): (Scene, Option<RunState>, PathBuf) =
        match (&arguments.resume, &arguments.scene) {
            (Some(file), _) => {
                let (scene, state) = read_checkpoint(file, &overrides)?;
                let folder = file.parent().map(PathBuf::from).unwrap_or_default();
                (scene, Some(state), folder)
            }
            (None, name) => {
                let name = name.as_deref().unwrap_or_default();
                let scene = if name.ends_with(".ron") {
                    phyxel_scene::load(name, &overrides)?
                } else {
                    phyxel_scene::embedded(name, &overrides)?
                };
                let folder = PathBuf::from("out").join(&scene.name);
                (scene, None, folder)
            }
        };
    if scene.bodies.len() != 1 {
        return Err(format!(
            "the scene has {} bodies; on ranks it must have one: run it with `phyxel run`",
            scene.bodies.len()
        )
        .into());
    }
    let options = RunOptions {
        out: arguments.out.clone().unwrap_or(folder),
        threads: Some(arguments.threads),
        quiet: arguments.quiet,
        interrupt: Some(Interrupt::listen()),
    };
    let shares = front.clone();
    let builders = arguments.builders;
    let builders = builders.unwrap_or_else(|| usual_builders(ranks_here, arguments.threads));
    let summary = run_shared(&scene, state, &options, shares, builders)?;
    if !arguments.quiet {
        eprint!("{}", table(&summary, &options.out));
    }
    Ok(options.out)
}
