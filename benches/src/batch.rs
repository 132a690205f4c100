//! Many scenes, one thread each, and their rows as CSV.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

use phyxel::scene::Scene;

use crate::error::{StudyError, of_file};
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

/// The items that have one of the comma-separated parts of `filter` in their names; all without one.
///
/// # Errors
/// If none has; it lists the names with `between` them.
pub(crate) fn chosen<T: Clone>(
    items: &[T],
    filter: Option<&str>,
    name: impl Fn(&T) -> &str,
    between: &str,
) -> Result<Vec<T>, StudyError> {
    let Some(filter) = filter else {
        return Ok(items.to_vec());
    };
    let wanted = |item: &&T| filter.split(',').any(|part| name(item).contains(part));
    let chosen: Vec<T> = items.iter().filter(wanted).cloned().collect();
    if chosen.is_empty() {
        let names: Vec<&str> = items.iter().map(&name).collect();
        let names = names.join(between);
        return Err(
            format!("no scene of the study has '{filter}' in its name; they are: {names}").into(),
        );
    }
    Ok(chosen)
}

/// Runs the cases, `jobs` at a time with one thread each; `ended` sees each row as it is there. Rows
/// come in the order of the cases.
///
/// # Errors
/// If threads cannot be started, and what `ended` returns.
pub fn run_all(
    cases: &[Case],
    jobs: usize,
    options: Options,
    mut ended: impl FnMut(&Row) -> Result<(), StudyError>,
) -> Result<Vec<Row>, StudyError> {
    let mut rows: Vec<Option<Row>> = cases.iter().map(|_| None).collect();
    let work = |case: &Case| run(&case.name, case.scene.clone(), options);
    on_threads(cases, jobs, work, |index, row| {
        ended(&row)?;
        rows[index] = Some(row);
        Ok(())
    })?;
    Ok(rows.into_iter().flatten().collect())
}

/// Works on items, `jobs` at a time with one thread each; `ended` sees each result with its item's place.
///
/// # Errors
/// If threads cannot be started, and what `ended` returns.
pub(crate) fn on_threads<T: Sync, R: Send>(
    items: &[T],
    jobs: usize,
    work: impl Fn(&T) -> R + Sync,
    mut ended: impl FnMut(usize, R) -> Result<(), StudyError>,
) -> Result<(), StudyError> {
    let next = AtomicUsize::new(0);
    let (send, receive) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, items.len().max(1)) {
            let (next, work, send) = (&next, &work, send.clone());
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(index) else {
                        break;
                    };
                    if send.send((index, pool.install(|| work(item)))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(send);
        receive
            .into_iter()
            .try_for_each(|(index, found)| ended(index, found))
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
    pub fn create(folder: &Path, name: &str) -> Result<Self, StudyError> {
        fs::create_dir_all(folder).map_err(of_file(folder))?;
        let file = folder.join(name);
        let writer = csv::Writer::from_path(&file).map_err(of_file(&file))?;
        Ok(Self { file, writer })
    }

    /// Adds a row.
    pub fn add(&mut self, row: &impl serde::Serialize) -> Result<(), StudyError> {
        let written = self.writer.serialize(row);
        let written = written.and_then(|()| self.writer.flush().map_err(csv::Error::from));
        written.map_err(of_file(&self.file))
    }
}
