//! `phyxel sweep`.

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use clap::Args;

use super::source::Source;
use super::{CliError, say};
use crate::output::{Interrupt, OutputError, OutputFolder};
use crate::run::machine_threads;
use crate::sweep::{
    Case, Outcome, Plan, PoolOptions, SweepError, Tally, all_cases, collect, one_case, place_of,
    run_case, run_cases, write_cases,
};
use phyxel::scene::Scene;

#[derive(Debug, Args)]
pub(super) struct SweepArguments {
    /// The plan (.ron): `(scene: .., design: .., keys: [..], results: [..])`; sim/docs/sweep.md has its format
    #[arg(value_name = "PLAN")]
    plan: PathBuf,
    /// Folder for the results [default: out/NAME with the plan's name]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write the list of cases and run none.
    #[arg(long, conflicts_with_all = ["case", "collect", "jobs", "retry"])]
    list: bool,
    /// Run this case alone, counted from 1, such as the number of a task in an array of jobs.
    #[arg(long, value_name = "K", conflicts_with_all = ["collect", "jobs"])]
    case: Option<usize>,
    /// Put the results of the finished cases into tables, and run none.
    #[arg(long, conflicts_with_all = ["jobs", "retry"])]
    collect: bool,
    /// Cases at a time, each a process of its own [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Total threads across concurrent cases [default: all of the machine's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Run failed cases again.
    #[arg(long)]
    retry: bool,
    /// Show nothing but errors.
    #[arg(long)]
    quiet: bool,
    /// End when the process at the other end of stdin does.
    #[arg(long, hide = true, requires = "case")]
    tied: bool,
}

/// Longest that a case waits for its folder: for the end of a process whose own starter is gone.
const PATIENCE: Duration = Duration::from_secs(10);

/// Lists, runs or collects the cases of a plan.
pub(super) fn sweep(arguments: &SweepArguments) -> Result<(), CliError> {
    let plan = Plan::load(&arguments.plan)?;
    let out = arguments.out.clone();
    let out = out.unwrap_or_else(|| PathBuf::from("out").join(plan.name()));
    let scene = scene(&plan)?;
    if let Some(number) = arguments.case {
        return one(arguments, &plan, &scene, &out, number);
    }
    let cases = all_cases(&plan, &scene)?;
    let folder = OutputFolder::claim(&out)?;
    write_cases(&plan, &cases, &folder)?;
    if arguments.list {
        return tell(arguments, &format!("{} cases", cases.len()));
    }
    if arguments.collect {
        return tell(arguments, &collect(&plan, &cases, &folder)?);
    }
    let tally = run_all(arguments, &cases, &out)?;
    if tally.failed.is_empty() {
        return Ok(());
    }
    for outcome in &tally.failed {
        let error = outcome.error.as_deref().unwrap_or_default();
        say(&format!("case {} failed: {error}", outcome.case))?;
    }
    Err(CliError::Said(format!(
        "{} of {} cases failed, as listed; --collect puts the rest into tables, --retry runs \
         the failed ones again",
        tally.failed.len(),
        cases.len()
    )))
}

/// The plan's scene with the changes that all cases share.
fn scene(plan: &Plan) -> Result<Scene, CliError> {
    let source = Source::of(Some(plan.scene.as_os_str()));
    let scene = source.map_err(CliError::from);
    let scene = scene.and_then(|source| source.scene(&plan.set));
    let scene = scene.map_err(|error| CliError::At {
        place: match &error {
            CliError::Scene(error) => place_of(plan, Some(error)),
            _ => place_of(plan, None),
        },
        error: Box::new(error),
    });
    Ok(scene?.0)
}

fn tell(arguments: &SweepArguments, line: &str) -> Result<(), CliError> {
    if arguments.quiet { Ok(()) } else { say(line) }
}

/// Runs one case in this process.
fn one(
    arguments: &SweepArguments,
    plan: &Plan,
    scene: &Scene,
    out: &Path,
    number: usize,
) -> Result<(), CliError> {
    let missing = || {
        let cases = plan.case_count();
        CliError::Said(format!("--case {number}: the plan has cases 1 to {cases}"))
    };
    let (case, resolved) = one_case(plan, scene, number)?.ok_or_else(missing)?;
    if !case.is_listed(plan, out) {
        write_cases(plan, &all_cases(plan, scene)?, &OutputFolder::create(out)?)?;
    }
    let outcome = match case.outcome(out) {
        Some(outcome) if !(arguments.retry && outcome.error.is_some()) => outcome,
        _ => {
            if arguments.tied {
                end_with_stdin();
            }
            patient(arguments, &case, &resolved, out)?
        }
    };
    match outcome.error {
        None => tell(arguments, &format!("case {number} ended")),
        Some(error) => Err(CliError::Said(format!(
            "case {number}: {error}; to run it again: --retry"
        ))),
    }
}

/// Runs a case, once its folder is free.
fn patient(
    arguments: &SweepArguments,
    case: &Case,
    scene: &Scene,
    out: &Path,
) -> Result<Outcome, SweepError> {
    let interrupt = Interrupt::listen();
    let begun = Instant::now();
    loop {
        let threads = arguments.threads.map(usize::from);
        match run_case(case, scene, out, threads, &interrupt) {
            Err(SweepError::Output(OutputError::InUse { .. }))
                if arguments.tied && begun.elapsed() < PATIENCE =>
            {
                thread::sleep(Duration::from_millis(50));
            }
            ended => return ended,
        }
    }
}

/// Ends the program when nothing can come from stdin any more: the process that started it is gone, or wants it to
/// end. Files appear whole or not at all, so any moment will do.
fn end_with_stdin() {
    thread::spawn(|| {
        let _ = io::copy(&mut io::stdin(), &mut io::sink());
        std::process::exit(1);
    });
}

/// Runs what is not finished.
fn run_all(arguments: &SweepArguments, cases: &[Case], out: &Path) -> Result<Tally, CliError> {
    let jobs = arguments.jobs.map_or(1, usize::from);
    let threads = arguments.threads.map(usize::from);
    let threads = threads.unwrap_or_else(machine_threads);
    let share = (threads / jobs).max(1);
    let program = std::env::current_exe().map_err(CliError::Program)?;
    let mut command: Vec<OsString> = vec![program.into(), "sweep".into()];
    command.push(arguments.plan.clone().into());
    command.extend(["--out".into(), out.to_owned().into_os_string()]);
    command.extend(["--threads".into(), share.to_string().into()]);
    command.extend(["--tied", "--quiet"].map(OsString::from));
    if arguments.retry {
        command.push("--retry".into());
    }
    command.push("--case".into());
    let options = PoolOptions {
        command,
        jobs,
        retry: arguments.retry,
        interrupt: Interrupt::listen(),
    };
    let told = |outcome: &Outcome, left: usize| {
        let failed = outcome
            .error
            .as_deref()
            .map(|error| format!("failed: {error}"));
        let how = failed.unwrap_or_else(|| "ended".to_owned());
        let line = format!("case {} {how}; {left} left", outcome.case);
        // Who does not listen does not keep a case from ending.
        let _ = tell(arguments, &line);
    };
    let tally = run_cases(cases, out, &options, &told)?;
    let line = format!(
        "{} cases: {} finished before, {} now, {} failed of all; for tables: --collect",
        cases.len(),
        tally.before,
        tally.run,
        tally.failed.len()
    );
    tell(arguments, &line)?;
    Ok(tally)
}
