//! Runs killed at any moment: resuming gives what a run gives that nothing disturbed, bit for bit.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::scenes::{entries, leftovers};
use crate::watch;
use testkit::cloud::Random;

pub(crate) const SCENE: &str = include_str!("killed.ron");

pub(crate) const START: &str = "run scene.ron --out out --threads 1 --quiet";
const RESUME: &str = "run --resume out/state.checkpoint --threads 1 --quiet";

/// A run in one go, to compare with, and the time (s) that it took.
pub(crate) struct Whole(tempfile::TempDir, f64);

impl Whole {
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("scene.ron"), SCENE).unwrap();
        let begun = Instant::now();
        let ended = watch::run(folder.path(), START);
        assert!(ended.failure().is_none(), "{}", ended.stderr);
        Self(folder, begun.elapsed().as_secs_f64())
    }

    /// The folder of its results.
    pub(crate) fn out(&self) -> PathBuf {
        self.0.path().join("out")
    }
}

pub(crate) fn case(whole: &Whole, folder: &Path, random: &mut Random) -> Option<String> {
    std::fs::write(folder.join("scene.ron"), SCENE).unwrap();
    let mut times = Vec::new();
    for attempt in 0..10 {
        let kept = folder.join("out/state.checkpoint").exists();
        let line = if kept { RESUME } else { START };
        // Twice at most, then it may come to its end.
        let after = if attempt < 1 + random.below(2) {
            random.range(0.0, 1.1 * whole.1)
        } else {
            1e4
        };
        times.push(after);
        let after = Duration::from_secs_f64(after);
        let (ended, killed) = watch::run_and_kill(folder, line, after);
        let fault = ended.fault();
        if killed && (fault.as_ref()).is_some_and(|fault| fault.contains("signal 9")) {
            continue;
        }
        if let Some(fault) = ended.failure() {
            return Some(format!("after {times:.3?} s: {fault}"));
        }
        let fault = leftovers(folder).or_else(|| differs(&whole.out(), &folder.join("out")));
        return fault.map(|fault| format!("after {times:.3?} s: {fault}"));
    }
    Some("it never came to its end".to_owned())
}

/// The first file that is not as in the other folder.
fn differs(one: &Path, other: &Path) -> Option<String> {
    let names = |folder: &Path| -> BTreeSet<PathBuf> {
        let name = |path: PathBuf| path.strip_prefix(folder).unwrap().to_owned();
        entries(folder).into_iter().map(name).collect()
    };
    let (expected, found) = (names(one), names(other));
    if expected != found {
        return Some(format!("{found:?} and not {expected:?}"));
    }
    // The wall time of the runs before is in the checkpoint.
    let mut files = found
        .iter()
        .filter(|name| one.join(name).is_file() && name.as_path() != Path::new("state.checkpoint"));
    let differs = files.find(|name| content(&one.join(name)) != content(&other.join(name)));
    differs.map(|name| format!("{} differs", name.display()))
}

/// What a file holds, but for times in a summary.
fn content(file: &Path) -> Vec<u8> {
    let bytes = std::fs::read(file).unwrap();
    if !file.ends_with("summary.json") {
        return bytes;
    }
    let mut json: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    json.as_object_mut().unwrap().remove("timings");
    json.to_string().into_bytes()
}
