//! Disks that are full: writing fails for one file after the other, by a limit of their size.

use std::path::{Path, PathBuf};

use crate::kills::{SCENE, START, Whole};
use crate::scenes::{entries, leftovers};
use crate::watch;
use testkit::cloud::Random;

/// Files of which a shorter run has fewer rows or an earlier state.
const GROWING: [&str; 4] = ["history.csv", "tools.csv", "input.csv", "state.checkpoint"];

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = entries(folder);
    found.retain(|path| !path.is_dir());
    found
}

/// No file is there in part: each is that of the whole run, or grows over time.
pub(crate) fn case(whole: &Whole, folder: &Path, random: &mut Random) -> Option<String> {
    let out = whole.out();
    let sizes: Vec<u64> = files(&out)
        .iter()
        .map(|file| std::fs::metadata(file).unwrap().len())
        .collect();
    // One of them is a little too large.
    let blocks = (*random.pick(&sizes) as usize / 512).max(2);
    std::fs::write(folder.join("scene.ron"), SCENE).unwrap();
    let ended = watch::run_with_little_space(folder, START, blocks);
    if let Some(fault) = ended.fault().or_else(|| leftovers(folder)) {
        return Some(format!("{blocks} blocks: {fault}"));
    }
    let said = ended.status.success() || ended.stderr.contains("cannot write");
    if !said {
        return Some(format!("{blocks} blocks: {}", ended.stderr));
    }
    let here = folder.join("out");
    let torn = files(&here).into_iter().find(|file| {
        let name = file.strip_prefix(&here).unwrap();
        let bytes = std::fs::read(file).unwrap();
        let changes = GROWING.iter().any(|growing| name == Path::new(growing));
        let timed = name == Path::new("summary.json");
        match timed {
            true => bytes.is_empty(),
            false => !changes && std::fs::read(out.join(name)).unwrap() != bytes,
        }
    });
    torn.map(|file| format!("{blocks} blocks: {} is there in part", file.display()))
}
