//! Many scenes, one thread each, and their rows as CSV.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

use phyxel::scene::Scene;

use crate::error::StudyError;
use crate::row::Row;
use crate::watch::{Options, run};

/// A scene of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Its name in the study.
    pub name: String,
    /// The scene.
    pub scene: Scene,
}

/// The cases that have one of the comma-separated parts of `filter` in their names; all without one.
///
/// # Errors
/// [`StudyError::NoScene`] if none has.
pub fn chosen(cases: Vec<Case>, filter: Option<&str>) -> Result<Vec<Case>, StudyError> {
    let Some(filter) = filter else {
        return Ok(cases);
    };
    let names: Vec<String> = cases.iter().map(|case| case.name.clone()).collect();
    let wanted = |case: &Case| filter.split(',').any(|part| case.name.contains(part));
    let chosen: Vec<Case> = cases.into_iter().filter(wanted).collect();
    if chosen.is_empty() {
        return Err(StudyError::NoScene {
            filter: filter.to_owned(),
            names: names.join("; "),
        });
    }
    Ok(chosen)
}

/// Runs the cases, `jobs` at a time with one thread each; `ended` sees each row as it is there. Rows
/// come in the order of the cases.
///
/// # Errors
/// [`StudyError::Threads`], and what `ended` returns.
pub fn run_all(
    cases: &[Case],
    jobs: usize,
    options: Options,
    mut ended: impl FnMut(&Row) -> Result<(), StudyError>,
) -> Result<Vec<Row>, StudyError> {
    let next = AtomicUsize::new(0);
    let (send, receive) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, cases.len().max(1)) {
            let (next, send) = (&next, send.clone());
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(case) = cases.get(index) else {
                        break;
                    };
                    let row = pool.install(|| run(&case.name, case.scene.clone(), options));
                    if send.send((index, row)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(send);
        let mut rows: Vec<Option<Row>> = cases.iter().map(|_| None).collect();
        for (index, row) in receive {
            ended(&row)?;
            rows[index] = Some(row);
        }
        Ok(rows.into_iter().flatten().collect())
    })
}

/// A CSV file that holds every row given so far.
#[derive(Debug)]
pub struct Sheet {
    file: std::path::PathBuf,
    writer: csv::Writer<fs::File>,
}

impl Sheet {
    /// Makes `folder` and the file `name` in it.
    ///
    /// # Errors
    /// [`StudyError::Folder`] and [`StudyError::Write`].
    pub fn create(folder: &Path, name: &str) -> Result<Self, StudyError> {
        fs::create_dir_all(folder).map_err(|source| StudyError::Folder {
            path: folder.to_owned(),
            source,
        })?;
        let file = folder.join(name);
        let writer = csv::Writer::from_path(&file).map_err(|source| StudyError::Write {
            file: file.clone(),
            source,
        })?;
        Ok(Self { file, writer })
    }

    /// Adds a row.
    ///
    /// # Errors
    /// [`StudyError::Write`].
    pub fn add(&mut self, row: &impl serde::Serialize) -> Result<(), StudyError> {
        let written = self.writer.serialize(row);
        let written = written.and_then(|()| self.writer.flush().map_err(csv::Error::from));
        written.map_err(|source| StudyError::Write {
            file: self.file.clone(),
            source,
        })
    }
}
