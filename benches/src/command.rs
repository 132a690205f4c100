//! `cargo run --release -p benches -- NAME [--quick] [--out DIR]`.
//!
//! Two kinds of studies: those that end in a verdict (`matrix`, `random`, ..) say what must hold of scenes
//! and fail if it does not; those of [`STUDIES`] tabulate error beside time and write one page.

use std::fmt::Display;
use std::io::{self, Write};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::thread;
use std::time::Instant;

use clap::{Args, Command, FromArgMatches, Subcommand};
use phyxel_cli::output::OutputFolder;
use serde::Serialize;

use crate::batch::{Case, Sheet, chosen, run_all};
use crate::cracks::Fronts;
use crate::error::of_file;
use crate::report::in_words;
use crate::row::Row;
use crate::studies::{Effort, STUDIES, Study, write_page};
use crate::watch::Options;
use crate::{
    StudyError, cook, cracks, griffith, incision, matrix, mechanics, organs, prove, random,
};

/// Name of the command that runs all of [`STUDIES`].
const ALL: &str = "all";

/// Studies that end in a verdict.
#[derive(Debug, Subcommand)]
enum Verdict {
    /// The embedded bodies over node counts, stiffnesses and cuts.
    Matrix(Batch),
    /// Scenes of a seeded generator: block and liver, any stiffness and gravity, three random strokes
    /// (one where steps are implicit).
    Random {
        /// All that scenes can say: shapes, meshes of `PHYXEL_MESHES`, laws, samplings, moving supports, tools, contact,
        /// schemes.
        #[arg(long)]
        all: bool,
        /// Seed of the generator.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Scenes.
        #[arg(long, default_value_t = 100)]
        count: u32,
        #[command(flatten)]
        batch: Batch,
    },
    /// The organ meshes of the folder that `PHYXEL_MESHES` names, in the default scene.
    Organs(Batch),
    /// A double cantilever cut along its middle: energy released per area is the energy release rate.
    Griffith(One),
    /// The embedded liver's cuts over node counts, captures and step factors: flat, and the same?
    Incision {
        /// Only scenes with one of these comma-separated parts in their names.
        #[arg(long, value_name = "PARTS")]
        filter: Option<String>,
        #[command(flatten)]
        one: One,
    },
    /// Cook's membrane, compressible, in plane stress.
    Cook(One),
    /// Error against processor time of phyxel and of finite elements in lanes: the tasks that
    /// `benches/peers/mechanics.py` gives to other simulators, as CSV.
    Mechanics {
        /// Draw the chart of such a file, and compute nothing.
        #[arg(long, value_name = "FILE")]
        chart: Option<PathBuf>,
        #[command(flatten)]
        one: One,
    },
    /// Claims that take too long for a test, checked on all cores: each figure with its limit.
    Prove {
        /// Only claims with one of these comma-separated parts in their names.
        name: Option<String>,
        /// List the claims and check none.
        #[arg(long)]
        list: bool,
        /// Claims at a time, with one thread each; all cores without it.
        #[arg(long, value_name = "N")]
        jobs: Option<usize>,
    },
    /// Cracks with a known answer, cut by a blade in a scene: stress intensities, mouths and works.
    Cracks {
        /// Only families with one of these comma-separated parts in their names.
        #[arg(long, value_name = "PARTS")]
        filter: Option<String>,
        /// Without the control of the cut's front.
        #[arg(long)]
        without_fronts: bool,
        #[command(flatten)]
        one: One,
    },
}

/// What a study of [`STUDIES`] writes, and how much of it is computed.
#[derive(Debug, Args)]
struct Page {
    /// Only the small sizes: the same code in seconds.
    #[arg(long)]
    quick: bool,
    /// Folder for tables, plots and the page.
    #[arg(long, default_value = "out/study", value_name = "DIR")]
    out: PathBuf,
    /// Show nothing but errors.
    #[arg(long)]
    quiet: bool,
}

/// Where the CSV file goes, and how much of it is computed.
#[derive(Debug, Args)]
struct One {
    /// The coarse bodies or a few small scenes only: the same code in a minute.
    #[arg(long)]
    quick: bool,
    /// Folder of the CSV file.
    #[arg(long, default_value = "out/benches", value_name = "DIR")]
    out: PathBuf,
}

/// How scenes are run, of studies that run many.
#[derive(Debug, Args)]
struct Batch {
    /// Only scenes with one of these comma-separated parts in their names.
    #[arg(long, value_name = "PARTS")]
    filter: Option<String>,
    /// Scenes at a time, with one thread each.
    #[arg(long, default_value_t = 1, value_name = "N")]
    jobs: usize,
    /// Check the step every 50 steps against an independent estimate of the largest eigenvalue; takes
    /// about three times as long.
    #[arg(long)]
    eigenvalues: bool,
    /// List the scenes and run none.
    #[arg(long)]
    list: bool,
    #[command(flatten)]
    one: One,
}

/// The command line: every study is a command.
fn command() -> Command {
    let pages = STUDIES
        .iter()
        .map(|study| (study.name, study.question))
        .chain([(ALL, "all that write a page, on one")])
        // After the arguments, whose own description would replace it.
        .map(|(name, about)| {
            Page::augment_args(Command::new(name))
                .about(about)
                .long_about(None::<&str>)
        });
    let command = Command::new("benches")
        .about("Studies: what must hold of whole scenes, and error beside time")
        .max_term_width(100)
        .subcommand_required(true)
        .arg_required_else_help(true);
    Verdict::augment_subcommands(command).subcommands(pages)
}

/// Runs the command that the program's arguments name.
///
/// # Panics
/// Never: a command line without a command ends before.
pub fn main() -> ExitCode {
    let matches = command().get_matches();
    let (name, of_study) = matches
        .subcommand()
        .expect("a command is required of every command line");
    let chosen = STUDIES
        .iter()
        .filter(|study| name == ALL || name == study.name);
    let chosen: Vec<&Study> = chosen.collect();
    let done = if chosen.is_empty() {
        let verdict = Verdict::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
        run_verdict(verdict)
    } else {
        let page = Page::from_arg_matches(of_study).unwrap_or_else(|error| error.exit());
        run_pages(&chosen, &page).map(|()| true)
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        // Whoever reads stdout or stderr has heard enough.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            // Nothing can be done where the terminal does not take it.
            let _ = writeln!(io::stderr(), "error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn is_broken_pipe(error: &StudyError) -> bool {
    let printing = error.downcast_ref::<io::Error>();
    printing.is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

fn run_verdict(study: Verdict) -> Result<bool, StudyError> {
    match study {
        Verdict::Matrix(batch) => run_matrix(&batch),
        Verdict::Random {
            all,
            seed,
            count,
            batch,
        } => run_random(all, seed, count, &batch),
        Verdict::Organs(batch) => run_organs(&batch),
        Verdict::Griffith(one) => {
            let spacings = [4.0, 6.0, 8.0].into_iter();
            let found = spacings.take(if one.quick { 1 } else { 3 });
            let found = found.map(|spacings| Ok(griffith::measure(spacings)));
            judge(&one.out, "griffith.csv", found, griffith::breaches)
        }
        Verdict::Incision { filter, one } => run_incision(filter.as_deref(), &one),
        Verdict::Cook(one) => {
            let cells = [8, 16, 32, 64].into_iter();
            let found = cells.take(if one.quick { 3 } else { 4 }).map(cook::measure);
            judge(&one.out, "cook.csv", found, cook::breaches)
        }
        Verdict::Mechanics { chart, one, .. } if chart.is_some() => {
            mechanics::chart(&chart.unwrap_or_default(), &one.out).map(|()| true)
        }
        Verdict::Mechanics { one, .. } => run_mechanics(&one),
        Verdict::Prove { name, list, jobs } => run_prove(name.as_deref(), list, jobs),
        Verdict::Cracks {
            filter,
            without_fronts,
            one,
        } => run_cracks(filter.as_deref(), without_fronts, &one),
    }
}

/// Prints a line.
fn say(line: impl Display) -> Result<(), StudyError> {
    Ok(writeln!(io::stdout(), "{line}")?)
}

/// Prints what exceeds a limit; whether nothing does.
fn verdict(breaches: &[String]) -> Result<bool, StudyError> {
    for breach in breaches {
        say(format_args!("MISSED {breach}"))?;
    }
    Ok(breaches.is_empty())
}

/// Prints findings and keeps them in a file, then prints what exceeds a limit; whether nothing does.
fn judge<F: Serialize>(
    out: &Path,
    file: &str,
    findings: impl Iterator<Item = Result<F, StudyError>>,
    breaches: impl Fn(&F) -> Vec<String>,
) -> Result<bool, StudyError> {
    let mut sheet = Sheet::create(out, file)?;
    let mut found = Vec::new();
    for finding in findings {
        let finding = finding?;
        say(in_words(&finding)?)?;
        sheet.add(&finding)?;
        found.extend(breaches(&finding));
    }
    verdict(&found)
}

/// Runs studies, writes their files and one page of all of them.
fn run_pages(chosen: &[&Study], asked: &Page) -> Result<(), StudyError> {
    let effort = if asked.quick {
        Effort::Quick
    } else {
        Effort::Full
    };
    let folder = OutputFolder::claim(&asked.out)?;
    let mut all = Vec::new();
    for study in chosen {
        let findings = study.run(&folder, effort)?;
        if !asked.quiet {
            for table in &findings.report.tables {
                writeln!(io::stderr(), "{table}")?;
            }
        }
        all.push(findings);
    }
    let page = write_page(&folder, &all)?;
    if !asked.quiet {
        writeln!(io::stderr(), "{}", page.display())?;
    }
    Ok(())
}

/// Runs a batch and prints its rows and what `seen` says of them, then what `breaches` does; whether that is nothing, as
/// where they are only listed.
fn run_batch(
    cases: &[Case],
    batch: &Batch,
    file: &str,
    seen: impl FnOnce(&[Row]) -> Result<(), StudyError>,
    breaches: impl FnOnce(&[Row]) -> Vec<String>,
) -> Result<bool, StudyError> {
    let cases = chosen(cases, batch.filter.as_deref(), |case| &case.name, "; ")?;
    if batch.list {
        for case in &cases {
            say(&case.name)?;
        }
        return Ok(true);
    }
    let mut sheet = Sheet::create(&batch.one.out, file)?;
    let options = Options {
        eigenvalues: batch.eigenvalues,
    };
    say(Row::header())?;
    let rows = run_all(&cases, batch.jobs, options, |row| {
        say(row)?;
        sheet.add(row)
    })?;
    seen(&rows)?;
    verdict(&breaches(&rows))
}

fn run_matrix(batch: &Batch) -> Result<bool, StudyError> {
    let mut cases = matrix::cases()?;
    if batch.one.quick {
        cases.retain(|case| matrix::QUICK.contains(&&*case.name));
    }
    let seen = |rows: &[Row]| matrix::set_free(rows).iter().try_for_each(say);
    run_batch(&cases, batch, "matrix.csv", seen, matrix::breaches)
}

fn run_random(all: bool, seed: u64, count: u32, batch: &Batch) -> Result<bool, StudyError> {
    let count = if batch.one.quick { count.min(5) } else { count };
    let cases = random::cases(seed, count, all)?;
    let seen = |rows: &[Row]| {
        random::summary(rows)
            .iter()
            .try_for_each(|class| say(&class.words))?;
        // Scenes that anyone can run again by themselves.
        for case in &cases {
            let row = rows.iter().find(|row| row.scene == case.name);
            if row.is_some_and(|row| !random::breaches(std::slice::from_ref(row)).is_empty()) {
                let path = batch.one.out.join(format!("{}.ron", case.name));
                let written = std::fs::write(&path, phyxel_scene::to_ron(&case.scene));
                written.map_err(of_file(&path))?;
            }
        }
        Ok(())
    };
    run_batch(&cases, batch, "random.csv", seen, random::breaches)
}

fn run_organs(batch: &Batch) -> Result<bool, StudyError> {
    let folder = organs::folder().ok_or("PHYXEL_MESHES must name the folder of the meshes")?;
    let mut cases = organs::cases(&folder)?;
    if batch.one.quick {
        cases.retain(|case| case.name.ends_with(" 600 nodes"));
    }
    let breaches = |rows: &[Row]| Row::all_breaches(rows, |_| organs::BARS);
    run_batch(&cases, batch, "organs.csv", |_| Ok(()), breaches)
}

fn run_incision(filter: Option<&str>, one: &One) -> Result<bool, StudyError> {
    let mut cases = incision::cases()?;
    if one.quick {
        cases.truncate(1);
    }
    let mut first = None;
    let cases = chosen(&cases, filter, |case| &case.name, "; ")?;
    let found = cases.into_iter().map(|case| {
        let finding = incision::measure(&case.name, case.scene, first.as_ref());
        // The same nodes cut the same way otherwise.
        first.get_or_insert_with(|| finding.clone());
        Ok(finding)
    });
    judge(&one.out, "incision.csv", found, incision::breaches)
}

fn run_cracks(filter: Option<&str>, without_fronts: bool, one: &One) -> Result<bool, StudyError> {
    let fronts = [Fronts::OfScenes, Fronts::Without][usize::from(without_fronts)];
    let few = one.quick.then_some(cracks::QUICK);
    let families = &cracks::FAMILIES[..few.unwrap_or(cracks::FAMILIES.len())];
    let families = chosen(families, filter, |family| family.0, ", ")?;
    let found = families.into_iter().flat_map(|(_, family)| {
        let found = family(fronts).map(|all| all.into_iter().map(Ok).collect());
        found.unwrap_or_else(|error| vec![Err(error)])
    });
    judge(&one.out, "cracks.csv", found, cracks::breaches)
}

fn run_mechanics(one: &One) -> Result<bool, StudyError> {
    let mut sheet = Sheet::create(&one.out, "mechanics.csv")?;
    let each = |row: &mechanics::Row| {
        say(in_words(row)?)?;
        sheet.add(row)
    };
    mechanics::run(one.quick, &one.out, each).map(|()| true)
}

fn run_prove(name: Option<&str>, list: bool, jobs: Option<usize>) -> Result<bool, StudyError> {
    let claims = chosen(prove::CLAIMS, name, |claim| claim.name, ", ")?;
    if list {
        for claim in &claims {
            say(format_args!("{:<18} {}", claim.name, claim.about))?;
        }
        return Ok(true);
    }
    let jobs = jobs.unwrap_or_else(|| thread::available_parallelism().map_or(1, NonZero::get));
    let (start, mut failed) = (Instant::now(), 0);
    let all = prove::run(&claims, jobs, |outcome| {
        failed += usize::from(!outcome.holds());
        Ok(write!(io::stdout(), "{outcome}")?)
    })?;
    say(format_args!(
        "{} passed, {failed} failed\nin {:.1} s",
        claims.len() - failed,
        start.elapsed().as_secs_f64()
    ))?;
    Ok(all)
}
