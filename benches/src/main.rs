//! `cargo run --release -p benches -- NAME [--quick] [--out DIR]`.
//!
//! Two kinds of studies: those that end in a verdict (`matrix`, `random`, ..) say what must hold of scenes
//! and fail if it does not; those of [`STUDIES`] tabulate error beside time and write one page.

use std::io::{self, Write};
use std::num::NonZero;
use std::path::PathBuf;
use std::process::ExitCode;
use std::thread;
use std::time::Instant;

use benches::batch::{Case, Sheet, chosen, run_all};
use benches::cracks::Fronts;
use benches::draw::Drawing;
use benches::studies::{STUDIES, write_page};
use benches::{
    Effort, Options, Row, Study, StudyError, cook, cracks, grids, griffith, incision, matrix,
    organs, prove, random, spin,
};
use clap::{Args, Command, FromArgMatches, Subcommand};
use phyxel_cli::output::OutputFolder;
use serde::Serialize;

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
    /// The embedded scenes with the dissertation's enrichment grid, at three node counts each.
    Grids(Batch),
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
    /// A free block that spins while it is cut keeps its momenta.
    Spin(One),
    /// Cook's membrane, compressible, in plane stress.
    Cook(One),
    /// The plots of the READMEs.
    Draw {
        /// Which one.
        drawing: Drawing,
        /// Folder of the plot.
        #[arg(long, default_value = "out/benches", value_name = "DIR")]
        out: PathBuf,
    },
    /// Claims that take too long for a test, checked on all cores: each figure with its limit.
    Prove {
        /// Only claims with this in their names.
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
    /// Print what was found as JSON on stdout, one object per study.
    #[arg(long)]
    json: bool,
}

/// Where the CSV file of one problem goes, and how much of it is computed.
#[derive(Debug, Args)]
struct One {
    /// The coarse bodies only.
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
    /// A few small scenes only: the same code in a minute.
    #[arg(long)]
    quick: bool,
    /// Folder of the CSV file.
    #[arg(long, default_value = "out/benches", value_name = "DIR")]
    out: PathBuf,
    /// List the scenes and run none.
    #[arg(long)]
    list: bool,
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

fn main() -> ExitCode {
    let matches = command().get_matches();
    let (name, of_study) = matches
        .subcommand()
        .expect("a command is required of every command line");
    let chosen: Vec<&Study> = STUDIES
        .iter()
        .filter(|study| name == ALL || name == study.name)
        .collect();
    let done = if chosen.is_empty() {
        let verdict = Verdict::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
        run_verdict(&verdict)
    } else {
        let page = Page::from_arg_matches(of_study).unwrap_or_else(|error| error.exit());
        run_pages(&chosen, &page).map(|()| true)
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        // Whoever reads stdout or stderr has heard enough.
        Err(StudyError::Print(error)) if error.kind() == io::ErrorKind::BrokenPipe => {
            ExitCode::SUCCESS
        }
        Err(error) => {
            // Nothing can be done where the terminal does not take it.
            let _ = writeln!(io::stderr(), "error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run_verdict(study: &Verdict) -> Result<bool, StudyError> {
    match study {
        Verdict::Matrix(batch) => run_matrix(batch),
        Verdict::Random {
            all,
            seed,
            count,
            batch,
        } => run_random(*all, *seed, *count, batch),
        Verdict::Organs(batch) => run_organs(batch),
        Verdict::Grids(batch) => run_grids(batch),
        Verdict::Griffith(one) => run_griffith(one),
        Verdict::Incision { filter, one } => run_incision(filter.as_deref(), one),
        Verdict::Spin(one) => run_spin(one),
        Verdict::Cook(one) => run_cook(one),
        Verdict::Draw { drawing, out } => drawing.draw(out).map(|()| true),
        Verdict::Prove { name, list, jobs } => run_prove(name.as_deref(), *list, *jobs),
        Verdict::Cracks {
            filter,
            without_fronts,
            one,
        } => run_cracks(filter.as_deref(), *without_fronts, one),
    }
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
        if asked.json {
            let text = serde_json::to_string(&findings).map_err(StudyError::Json)?;
            writeln!(io::stdout(), "{text}")?;
        }
        all.push(findings);
    }
    let page = write_page(&folder, &all)?;
    if !asked.quiet {
        writeln!(io::stderr(), "{}", page.display())?;
    }
    Ok(())
}

/// Runs a batch and prints its rows; none if they were only listed.
fn run_batch(cases: Vec<Case>, batch: &Batch, file: &str) -> Result<Option<Vec<Row>>, StudyError> {
    let cases = chosen(cases, batch.filter.as_deref())?;
    if batch.list {
        for case in &cases {
            writeln!(io::stdout(), "{}", case.name)?;
        }
        return Ok(None);
    }
    let mut sheet = Sheet::create(&batch.out, file)?;
    let options = Options {
        eigenvalues: batch.eigenvalues,
    };
    writeln!(io::stdout(), "{}", Row::header())?;
    let rows = run_all(&cases, batch.jobs, options, |row| {
        writeln!(io::stdout(), "{row}")?;
        sheet.add(row)
    })?;
    Ok(Some(rows))
}

fn run_matrix(batch: &Batch) -> Result<bool, StudyError> {
    let mut cases = matrix::cases()?;
    if batch.quick {
        cases.retain(|case| matrix::QUICK.contains(&&*case.name));
    }
    let Some(rows) = run_batch(cases, batch, "matrix.csv")? else {
        return Ok(true);
    };
    for line in matrix::set_free(&rows) {
        writeln!(io::stdout(), "{line}")?;
    }
    verdict(&matrix::breaches(&rows))
}

fn run_random(all: bool, seed: u64, count: u32, batch: &Batch) -> Result<bool, StudyError> {
    let count = if batch.quick { count.min(5) } else { count };
    let cases = random::cases(seed, count, all)?;
    let Some(rows) = run_batch(cases.clone(), batch, "random.csv")? else {
        return Ok(true);
    };
    for class in random::summary(&rows) {
        writeln!(
            io::stdout(),
            "rho g L / E below {:<4} {:>3} scenes, {:>3} end, {:>3} of them calm; worst added by a stroke \
             {:.1e}, energy-balance error {:.1e}, shrink {:.1}",
            class.below,
            class.scenes,
            class.ended,
            class.calm,
            class.worst_added,
            class.worst_imbalance,
            class.worst_shrink
        )?;
    }
    // Scenes that anyone can run again by themselves.
    for case in &cases {
        let row = rows.iter().find(|row| row.scene == case.name);
        if row.is_some_and(|row| !random::breaches(std::slice::from_ref(row)).is_empty()) {
            let path = batch.out.join(format!("{}.ron", case.name));
            let written = std::fs::write(&path, phyxel_scene::to_ron(&case.scene));
            written.map_err(|source| StudyError::Folder { path, source })?;
        }
    }
    verdict(&random::breaches(&rows))
}

fn run_organs(batch: &Batch) -> Result<bool, StudyError> {
    let folder = organs::folder().ok_or(StudyError::NoMeshes)?;
    let mut cases = organs::cases(&folder)?;
    if batch.quick {
        cases.retain(|case| case.name.ends_with(" 600 nodes"));
    }
    let Some(rows) = run_batch(cases, batch, "organs.csv")? else {
        return Ok(true);
    };
    let mut found = Vec::new();
    for row in &rows {
        let breaches = row.breaches(&organs::BARS);
        found.extend(
            breaches
                .iter()
                .map(|breach| format!("{}: {breach}", row.scene)),
        );
    }
    verdict(&found)
}

fn run_grids(batch: &Batch) -> Result<bool, StudyError> {
    let mut cases = grids::cases()?;
    if batch.quick {
        cases.truncate(1);
    }
    let Some(rows) = run_batch(cases, batch, "grids.csv")? else {
        return Ok(true);
    };
    for row in &rows {
        if let Some((lattices, without)) = row.lattices.zip(row.without_lattice) {
            writeln!(
                io::stdout(),
                "{}: {lattices} lattices, {} pairs severed, {without} pairs left to Diffraction",
                row.scene,
                row.severed
            )?;
        }
    }
    verdict(&grids::breaches(&rows))
}

fn run_griffith(one: &One) -> Result<bool, StudyError> {
    let mut sheet = Sheet::create(&one.out, "griffith.csv")?;
    let mut found = Vec::new();
    for spacings in [4.0, 6.0, 8.0]
        .into_iter()
        .take(if one.quick { 1 } else { 3 })
    {
        let finding = griffith::measure(spacings);
        writeln!(
            io::stdout(),
            "{:4} across an arm: stored before the cut {:.3} of the closed form; released per area \
             {:.3} G by the load, {:.3} by the closed form, {:.3} of it by updates; worst update {:+.1e} of what is stored",
            spacings,
            finding.stored,
            finding.ratio,
            finding.ratio_of_closed_form,
            finding.by_updates,
            finding.row.added
        )?;
        sheet.add(&finding)?;
        found.extend(griffith::breaches(&finding));
    }
    verdict(&found)
}

/// A line of the table of incisions.
#[derive(Debug, Serialize)]
struct Incision<'a> {
    scene: &'a str,
    incision_ratio: f64,
    resection_ratio: f64,
    incision_backwards: f64,
    resection_backwards: f64,
    severed_pairs: usize,
    severed_area: f64,
    overlap: Option<f64>,
    opening: f64,
    opening_difference: Option<f64>,
    missed: usize,
    ties: usize,
    pieces: usize,
    second_piece: u32,
    latency: f64,
}

fn run_incision(filter: Option<&str>, one: &One) -> Result<bool, StudyError> {
    let mut cases = incision::cases()?;
    if one.quick {
        cases.truncate(1);
    }
    let mut sheet = Sheet::create(&one.out, "incision.csv")?;
    let mut found = Vec::new();
    let mut first = None;
    for case in chosen(cases, filter)? {
        let finding = incision::measure(&case.name, case.scene);
        let [incision, resection] = finding.sheets;
        // The same nodes cut the same way otherwise.
        let overlap = first.as_ref().and_then(|first| finding.overlap(first));
        let difference = first.as_ref();
        let difference = difference.map(|first| finding.opening_difference(first));
        writeln!(
            io::stdout(),
            "{:<34} area over vector area: incision {:.4}, resection {:.4}, backwards {:.3} and {:.3} cm2; incision: \
             {} pairs severed ({:.2} cm2), overlap {:.3}, opens {:.2} mm, over time {:.3} off the first; {} missed, {} ties, pieces {:?}, \
             blade to step {:.2} ms, {:.0} s",
            case.name,
            incision.ratio(),
            resection.ratio(),
            1e4 * incision.backwards,
            1e4 * resection.backwards,
            finding.severed.len(),
            1e4 * finding.severed_area(),
            overlap.unwrap_or(f64::NAN),
            1e3 * finding.opening(),
            difference.unwrap_or(f64::NAN),
            finding.missed,
            finding.ties,
            finding.pieces,
            1e3 * finding.latency,
            finding.row.wall
        )?;
        sheet.add(&Incision {
            scene: &case.name,
            incision_ratio: incision.ratio(),
            resection_ratio: resection.ratio(),
            incision_backwards: incision.backwards,
            resection_backwards: resection.backwards,
            severed_pairs: finding.severed.len(),
            severed_area: finding.severed_area(),
            overlap,
            opening: finding.opening(),
            opening_difference: difference,
            missed: finding.missed,
            ties: finding.ties,
            pieces: finding.pieces.len(),
            second_piece: finding.pieces.get(1).copied().unwrap_or(0),
            latency: finding.latency,
        })?;
        found.extend(incision::breaches(&finding));
        first.get_or_insert(finding);
    }
    verdict(&found)
}

fn run_spin(one: &One) -> Result<bool, StudyError> {
    let mut sheet = Sheet::create(&one.out, "spin.csv")?;
    let mut found = Vec::new();
    for (damping, ratio) in spin::DAMPINGS {
        let finding = spin::measure(damping, ratio)?;
        writeln!(
            io::stdout(),
            "damping {damping} /s, ratio {ratio}: {} pairs severed; angular momentum changes by {:.1e}, \
             linear by {:.1e}",
            finding.severed,
            finding.angular,
            finding.linear
        )?;
        sheet.add(&finding)?;
        found.extend(spin::breaches(&finding));
    }
    verdict(&found)
}

fn run_cook(one: &One) -> Result<bool, StudyError> {
    let mut sheet = Sheet::create(&one.out, "cook.csv")?;
    let mut found = Vec::new();
    let finest = if one.quick { 3 } else { 4 };
    for cells in [8, 16, 32, 64].into_iter().take(finest) {
        let finding = cook::measure(cells)?;
        writeln!(
            io::stdout(),
            "{:3} cells, {:5} nodes: rises by {:.3}, of {} {:.4}",
            finding.cells,
            finding.nodes,
            finding.rise,
            cook::RISE,
            finding.rise / cook::RISE
        )?;
        sheet.add(&finding)?;
        if cells >= 32 {
            found.extend(cook::breaches(&finding));
        }
    }
    verdict(&found)
}

fn run_cracks(filter: Option<&str>, without_fronts: bool, one: &One) -> Result<bool, StudyError> {
    let fronts = if without_fronts {
        Fronts::Without
    } else {
        Fronts::OfScenes
    };
    let count = if one.quick {
        cracks::QUICK
    } else {
        cracks::FAMILIES.len()
    };
    let families = &cracks::FAMILIES[..count];
    let parts: Vec<&str> = filter.map_or_else(Vec::new, |filter| filter.split(',').collect());
    let wanted = |name: &str| parts.is_empty() || parts.iter().any(|part| name.contains(part));
    if !families.iter().any(|(name, _)| wanted(name)) {
        return Err(StudyError::NoScene {
            filter: filter.unwrap_or_default().to_owned(),
            names: families
                .iter()
                .map(|(name, _)| *name)
                .collect::<Vec<_>>()
                .join(", "),
        });
    }
    let mut sheet = Sheet::create(&one.out, "cracks.csv")?;
    let mut all = Vec::new();
    for (_, family) in families.iter().filter(|(name, _)| wanted(name)) {
        for finding in family(fronts)? {
            writeln!(
                io::stdout(),
                "{:<44} {:6} nodes  {:<22} {:.3}  bar {:.2}{}",
                finding.case,
                finding.nodes,
                finding.quantity,
                finding.ratio,
                finding.bar,
                if finding.misses() { "  MISSED" } else { "" }
            )?;
            sheet.add(&finding)?;
            all.push(finding);
        }
    }
    verdict(&cracks::breaches(&all))
}

fn run_prove(name: Option<&str>, list: bool, jobs: Option<usize>) -> Result<bool, StudyError> {
    let claims = prove::chosen(name)?;
    if list {
        for claim in &claims {
            writeln!(io::stdout(), "{:<18} {}", claim.name, claim.about)?;
        }
        return Ok(true);
    }
    let jobs = jobs.unwrap_or_else(|| thread::available_parallelism().map_or(1, NonZero::get));
    let (start, mut failed) = (Instant::now(), 0);
    let all = prove::run(&claims, jobs, |outcome| {
        failed += usize::from(!outcome.holds());
        Ok(write!(io::stdout(), "{outcome}")?)
    })?;
    writeln!(
        io::stdout(),
        "{} passed, {failed} failed\nin {:.1} s",
        claims.len() - failed,
        start.elapsed().as_secs_f64()
    )?;
    Ok(all)
}

/// Prints what exceeds a limit; whether nothing does.
fn verdict(breaches: &[String]) -> Result<bool, StudyError> {
    for breach in breaches {
        writeln!(io::stdout(), "MISSED {breach}")?;
    }
    Ok(breaches.is_empty())
}
