//! `phyxel study`.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;

use super::CliError;
use crate::output::OutputFolder;
use crate::study::{Effort, STUDIES, Study, write_page};

#[derive(Debug, Args)]
pub(super) struct StudyArguments {
    /// The study to run; all of them where not given.
    name: Option<String>,
    /// Folder for tables, plots and the page.
    #[arg(long, value_name = "DIR", default_value = "out/study")]
    out: PathBuf,
    /// Only the small sizes: the same code in seconds.
    #[arg(long)]
    quick: bool,
    /// List the studies and the question each one asks.
    #[arg(long, conflicts_with_all = ["name", "quick"])]
    list: bool,
    /// Show nothing but errors.
    #[arg(long)]
    quiet: bool,
    /// Print what was found as JSON on stdout, one object per study.
    #[arg(long)]
    json: bool,
}

/// Runs one study or all of them.
pub(super) fn study(arguments: &StudyArguments) -> Result<(), CliError> {
    let mut out = io::stdout().lock();
    if arguments.list {
        for study in STUDIES {
            writeln!(out, "{:12}{}", study.name, study.question)?;
        }
        return Ok(());
    }
    let chosen: Vec<&Study> = match &arguments.name {
        Some(name) => vec![Study::named(name)?],
        None => STUDIES.iter().collect(),
    };
    let effort = if arguments.quick {
        Effort::Quick
    } else {
        Effort::Full
    };
    let folder = OutputFolder::claim(&arguments.out)?;
    let mut all = Vec::new();
    for study in chosen {
        let findings = study.run(&folder, effort)?;
        if !arguments.quiet {
            let mut terminal = io::stderr().lock();
            for table in &findings.report.tables {
                writeln!(terminal, "{table}").map_err(CliError::Stderr)?;
            }
        }
        if arguments.json {
            writeln!(out, "{}", serde_json::to_string(&findings)?)?;
        }
        all.push(findings);
    }
    let page = write_page(&folder, &all)?;
    if !arguments.quiet {
        writeln!(io::stderr(), "{}", page.display()).map_err(CliError::Stderr)?;
    }
    Ok(())
}
