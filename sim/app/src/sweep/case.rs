//! Cases: the plan made explicit, and what is left of each.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::output::{OutputError, OutputFolder};
use phyxel::scene::Scene;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::plan::Plan;

/// The list of cases, one a line.
const LIST: &str = "cases.jsonl";
/// What says in a case's folder that it is finished.
const OUTCOME: &str = "outcome.json";

/// One run of a sweep.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Case {
    /// Number, from 1.
    pub(crate) number: usize,
    /// Value of each key, as RON; the order is that of the plan's keys.
    pub(crate) values: Vec<String>,
    /// Of all that it is run with (`CaseHashes`).
    pub(crate) hash: String,
}

/// How a case ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Outcome {
    /// Number of the case.
    pub(crate) case: usize,
    /// Hash of what was run.
    pub(crate) hash: String,
    /// Why it failed; `None` if it came to its end.
    pub(crate) error: Option<String>,
}

/// A line of the list.
#[derive(Serialize)]
struct ListLine<'a> {
    case: usize,
    keys: Map<String, Value>,
    hash: &'a str,
}

impl Case {
    /// Its line of the list.
    fn line(&self, plan: &Plan) -> String {
        let names = plan.keys.iter().map(|key| key.name().to_owned());
        let values = self.values.iter().cloned().map(Value::String);
        let line = ListLine {
            case: self.number,
            keys: names.zip(values).collect(),
            hash: &self.hash,
        };
        // Strings and a number: there is nothing that JSON cannot say.
        serde_json::to_string(&line).unwrap_or_default()
    }

    /// Whether the list in a folder has this case as it is.
    pub(crate) fn is_listed(&self, plan: &Plan, folder: &Path) -> bool {
        fs::read_to_string(folder.join(LIST))
            .is_ok_and(|list| list.lines().nth(self.number - 1) == Some(&self.line(plan)))
    }

    /// Folder of the case in that of its sweep.
    pub(crate) fn folder(&self, sweep: &Path) -> PathBuf {
        sweep.join("cases").join(format!("{:06}", self.number))
    }

    /// How the case ended; `None` if it has not, if what ended was run with something else, or if its summary is gone.
    pub(crate) fn outcome(&self, sweep: &Path) -> Option<Outcome> {
        let text = fs::read(self.folder(sweep).join(OUTCOME)).ok()?;
        let outcome: Outcome = serde_json::from_slice(&text).ok()?;
        let summary = fs::metadata(self.folder(sweep).join("summary.json"));
        let is_whole = outcome.error.is_some() || summary.is_ok_and(|file| file.len() > 0);
        (outcome.hash == self.hash && is_whole).then_some(outcome)
    }

    /// Makes the case one of which nothing is known, and holds its folder while it does so.
    ///
    /// # Errors
    /// [`OutputError`] if someone else holds it or it cannot be written.
    pub(crate) fn begin(&self, sweep: &Path) -> Result<(), OutputError> {
        // Held before the outcome goes, so that no one else is about to write it.
        let folder = OutputFolder::claim(&self.folder(sweep))?;
        folder.remove(OUTCOME)?;
        Ok(())
    }

    /// Writes down how the case ended.
    ///
    /// # Errors
    /// [`OutputError`] if it cannot be written.
    pub(crate) fn end(&self, sweep: &Path, error: Option<String>) -> Result<Outcome, OutputError> {
        let outcome = Outcome {
            case: self.number,
            hash: self.hash.clone(),
            error,
        };
        let mut text = serde_json::to_vec(&outcome).unwrap_or_default();
        text.push(b'\n');
        OutputFolder::create(&self.folder(sweep))?.write(OUTCOME, &text)?;
        Ok(outcome)
    }
}

/// Writes the list of cases.
///
/// # Errors
/// [`OutputError`] if it cannot be written.
pub(crate) fn write_cases(
    plan: &Plan,
    cases: &[Case],
    folder: &OutputFolder,
) -> Result<(), OutputError> {
    let mut text = String::new();
    for case in cases {
        text.push_str(&case.line(plan));
        text.push('\n');
    }
    // Many may begin at once; what is there already is left in peace.
    if fs::read(folder.path().join(LIST)).is_ok_and(|there| there == text.as_bytes()) {
        return Ok(());
    }
    folder.write(LIST, text.as_bytes())
}

/// Hashes of what cases are run with; a file that many are run with is read once. They are the standard library's, with fixed
/// keys: a change that they overlook is one in 2^64.
#[derive(Debug, Default)]
pub(super) struct CaseHashes(Mutex<Vec<(PathBuf, u64)>>);

impl CaseHashes {
    /// The hash of a case: of the program's version, of all that its scene says, and of the files that this names.
    pub(super) fn of(&self, scene: &mut Scene) -> String {
        let mut hash = DefaultHasher::new();
        (env!("CARGO_PKG_VERSION"), &*phyxel_scene::to_ron(scene)).hash(&mut hash);
        for file in scene.files_mut() {
            self.of_file(file).hash(&mut hash);
        }
        format!("{:016x}", hash.finish())
    }

    fn of_file(&self, file: &Path) -> u64 {
        let mut read = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, hash)) = read.iter().find(|(known, _)| known == file) {
            return *hash;
        }
        let mut hash = DefaultHasher::new();
        // A file that cannot be read is an error of the run, not of its hash.
        fs::read(file).unwrap_or_default().hash(&mut hash);
        let hash = hash.finish();
        read.push((file.to_owned(), hash));
        hash
    }
}
