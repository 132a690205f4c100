//! Scenes: broken values, broken texts; they are checked, or run for a moment.

use std::path::{Path, PathBuf};

use crate::watch;
use testkit::broken::broken;
use testkit::cloud::Random;

pub(crate) const BLOCK: &str = include_str!("block.ron");

const PAIR: &str = include_str!("pair.ron");

/// Values that something may not expect.
const VALUES: &str = "0 -0.0 -1 1 3 1e-3 1e-6 1e-300 1e300 1e6 1000 nan inf -inf 4294967295 18446744073709551615 65536 \
    0.4999999 0.5 None \"\" () [] (0,0,0) true Fixed \"\u{1b}[2J\" 120 0.01 -0.5";

/// Changes a number, takes a key or a whole group out, or puts it in twice.
fn changed(text: &str, random: &mut Random) -> String {
    let bytes = text.as_bytes();
    let starts: Vec<usize> = (1..bytes.len())
        .filter(|k| {
            let before = bytes[k - 1];
            bytes[*k].is_ascii_digit()
                && !before.is_ascii_alphanumeric()
                && !b".-+".contains(&before)
        })
        .collect();
    let keys: Vec<usize> = (1..bytes.len())
        .filter(|k| bytes[*k].is_ascii_lowercase() && b" (".contains(&bytes[k - 1]))
        .collect();
    let mut out = text.to_owned();
    match random.below(8) {
        0 => {
            // The rest of a line is gone, or there twice.
            let key = *random.pick(&keys);
            let end = text[key..].find('\n').map_or(text.len(), |k| key + k);
            if random.chance(0.5) {
                out.replace_range(key..end, "");
            } else {
                out.insert_str(key, &text[key..end]);
            }
        }
        1 => {
            // A group is nested, or one of its brackets is missing.
            let opens: Vec<usize> = text.match_indices(['(', '[']).map(|(k, _)| k).collect();
            let open = *random.pick(&opens);
            let depth = [0, 1, 3, 200, 30_000][random.below(5)];
            out.replace_range(open..=open, &text[open..=open].repeat(depth));
        }
        _ => {
            let start = *random.pick(&starts);
            let number = |b: &u8| b.is_ascii_digit() || b".e-".contains(b);
            let end = (start..bytes.len())
                .find(|k| !number(&bytes[*k]))
                .unwrap_or(bytes.len());
            let values: Vec<&str> = VALUES.split(' ').collect();
            out.replace_range(start..end, random.pick::<&str>(&values));
        }
    }
    out
}

/// A text changed once to four times, and broken in one of five cases.
pub(crate) fn spoiled(text: &str, random: &mut Random) -> Vec<u8> {
    let mut text = text.to_owned();
    for _ in 0..=random.below(3) {
        text = changed(&text, random);
    }
    let bytes = text.into_bytes();
    match random.chance(0.2) {
        true => broken(bytes, random),
        false => bytes,
    }
}

pub(crate) fn case(folder: &Path, random: &mut Random) -> Option<String> {
    let text = if random.chance(0.5) { BLOCK } else { PAIR };
    let mut bytes = spoiled(text, random);
    if random.chance(0.05) {
        bytes = [&b"\xef\xbb\xbf"[..], &bytes].concat();
    }
    std::fs::write(folder.join("scene.ron"), &bytes).unwrap();
    let run = random.chance(0.5);
    let line = if run {
        // What is long on purpose is no hang.
        "run scene.ron --out out --threads 1 --quiet --json --set integration.settle=None \
         --set integration.step_factor=0.5"
    } else {
        "check scene.ron --json"
    };
    let ended = watch::run(folder, line);
    let fault = ended.fault().or_else(|| {
        let text = String::from_utf8_lossy(&bytes);
        let said = ended.stderr.contains("scene.ron") || ended.stderr.contains("--set");
        (!ended.status.success() && !said && !text.is_empty())
            .then(|| format!("no file is named: {}", ended.stderr))
    });
    fault
        .or_else(|| leftovers(folder))
        .map(|fault| format!("{line}: {fault}"))
}

/// All that is in a folder and those in it.
pub(crate) fn entries(folder: &Path) -> Vec<PathBuf> {
    let (mut found, mut open) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            open.extend(path.is_dir().then(|| path.clone()));
            found.push(path);
        }
    }
    found
}

/// Locks or parts of files that stayed.
pub(crate) fn leftovers(folder: &Path) -> Option<String> {
    let entries = entries(&folder.join("out"));
    let mut names = entries.iter().filter_map(|path| path.file_name());
    let left = names.find(|name| name.to_string_lossy().starts_with('.'));
    left.map(|name| format!("{} was left", name.display()))
}
