//! Running cases by processes of their own.

use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use crate::output::Interrupt;

use super::SweepError;
use super::case::{Case, Outcome};

/// Between two looks at a process.
const NAP: Duration = Duration::from_millis(20);

/// How cases are run.
#[derive(Debug, Clone)]
pub(crate) struct PoolOptions {
    /// The program and its arguments that run a case; the number of the case follows.
    pub(crate) command: Vec<std::ffi::OsString>,
    /// Processes at a time.
    pub(crate) jobs: usize,
    /// Whether failed cases are run again.
    pub(crate) retry: bool,
    /// What may ask to stop.
    pub(crate) interrupt: Interrupt,
}

/// What became of the cases.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    /// Cases that were finished before.
    pub(crate) before: usize,
    /// Cases that came to an end, good or bad.
    pub(crate) run: usize,
    /// Every failed case, those of before too, in order.
    pub(crate) failed: Vec<Outcome>,
}

/// Runs what is not finished of `cases`, each by a process of its own, and says how each ended by `told`,
/// which may be called from any thread.
///
/// # Errors
/// [`SweepError`]; what was finished by then stays so.
pub(crate) fn run_cases(
    cases: &[Case],
    sweep: &Path,
    options: &PoolOptions,
    told: &(dyn Fn(&Outcome, usize) + Sync),
) -> Result<Tally, SweepError> {
    let is_open = |case: &&Case| match case.outcome(sweep) {
        None => true,
        Some(outcome) => options.retry && outcome.error.is_some(),
    };
    let open: Vec<&Case> = cases.iter().filter(is_open).collect();
    let (count, taken) = (open.len(), AtomicUsize::new(0));
    // Takes cases until there are none, someone asks to stop or something is wrong; how many came to an end.
    let work = || -> Result<usize, SweepError> {
        let mut ended = 0;
        while !options.interrupt.asked()
            && let Some(case) = open.get(taken.fetch_add(1, Ordering::SeqCst))
        {
            let one = run_one(case, sweep, options);
            if one.is_err() {
                taken.store(count, Ordering::SeqCst);
            }
            let Some(outcome) = one? else { break };
            ended += 1;
            told(&outcome, count.saturating_sub(taken.load(Ordering::SeqCst)));
        }
        Ok(ended)
    };
    let run: Vec<Result<usize, SweepError>> = thread::scope(|scope| {
        let workers: Vec<_> = (0..options.jobs.min(count))
            .map(|_| scope.spawn(work))
            .collect();
        let ends = workers.into_iter().map(|worker| worker.join());
        ends.map(|end| end.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect()
    });
    let run = run.into_iter().sum::<Result<usize, SweepError>>()?;
    if run < count {
        return Err(SweepError::Stopped(count - run));
    }
    let outcomes = cases.iter().filter_map(|case| case.outcome(sweep));
    Ok(Tally {
        before: cases.len() - count,
        run,
        failed: outcomes.filter(|o| o.error.is_some()).collect(),
    })
}

/// Runs a case by a process; nothing if it was asked to stop.
fn run_one(
    case: &Case,
    sweep: &Path,
    options: &PoolOptions,
) -> Result<Option<Outcome>, SweepError> {
    let program = options.command.first().map(PathBuf::from);
    let program = program.unwrap_or_default();
    let started = Command::new(&program)
        .args(options.command.iter().skip(1))
        .arg(case.number.to_string())
        // It ends when this pipe does, and so not after the program that started it.
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn();
    let mut child = started.map_err(|source| SweepError::Start { program, source })?;
    let listener = child.stderr.take().map(|mut stderr| {
        thread::spawn(move || {
            let mut said = Vec::new();
            // What cannot be read is not said.
            let _ = stderr.read_to_end(&mut said);
            String::from_utf8_lossy(&said).into_owned()
        })
    });
    let status = wait(&mut child, &options.interrupt);
    let said = listener.and_then(|listener| listener.join().ok());
    if let Some(outcome) = case.outcome(sweep) {
        return Ok(Some(outcome));
    }
    if options.interrupt.asked() {
        return Ok(None);
    }
    let said = said.unwrap_or_default();
    let failed = |said: &str| SweepError::Case {
        case: case.number,
        said: said.to_owned(),
    };
    match status {
        // It says itself why it could not begin or write.
        Ok(status) if status.code() == Some(1) => {
            Err(failed(said.trim_start_matches("error: ").trim()))
        }
        // Ended by the system, for want of memory say: that is how this case ends.
        Ok(status) => Ok(Some(
            case.end(sweep, Some(format!("the process ended with {status}")))?,
        )),
        Err(source) => Err(failed(&source.to_string())),
    }
}

/// Waits for a process; if someone asks to stop it is notified.
fn wait(child: &mut Child, interrupt: &Interrupt) -> io::Result<std::process::ExitStatus> {
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if interrupt.asked() {
            drop(child.stdin.take());
            return child.wait();
        }
        thread::sleep(NAP);
    }
}
