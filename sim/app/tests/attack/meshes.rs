//! Meshes: what is read has the volume that a signed sum gives, or is refused with a reason; a number
//! that is advised works.

use std::path::Path;

use crate::watch::{self, Ended};
use crate::{shapes, writers};
use testkit::broken::broken;
use testkit::cloud::Random;

/// Largest deviation of a volume: single precision, and vertices joined within 1e-9 of the size.
const VOLUME_TOLERANCE: f64 = 1e-4;

pub(crate) fn case(folder: &Path, random: &mut Random) -> Option<String> {
    let (mut surface, volume) = shapes::body(random);
    let covered = writers::is_covered_by_fans(&surface);
    let mut known = volume > 0.0 && covered;
    for _ in 0..random.below(3) {
        known &= shapes::spoil(&mut surface, random);
    }
    let (mut bytes, ending) = writers::written(&surface, random);
    if random.chance(0.4) {
        bytes = broken(bytes, random);
        known = false;
    }
    if random.chance(0.05) {
        bytes = [&b"\xef\xbb\xbf"[..], &bytes].concat();
    }
    if random.chance(0.05) {
        bytes = [&bytes[..], &bytes].concat();
        known = false;
    }
    let name = format!("body.{ending}");
    std::fs::write(folder.join(&name), &bytes).unwrap();
    let nodes = (30 + random.below(1500)).to_string();
    let spacing = surface.size().max_element() * random.range(0.03, 0.4);
    let spacing = format!("{spacing:?}");
    let target = format!("bodies[0].sampling.target=Nodes({nodes})");
    let mut arguments = match random.below(10) {
        0 => vec!["check", &name, "--json", "--set", &target],
        1 | 2 => vec!["sample", &name, "--spacing", &spacing],
        3 => vec!["sample", &name, "--points", "--nodes", &nodes],
        4 => vec!["sample", &name, "--coarsest", "4", "--nodes", &nodes],
        _ => vec!["sample", &name, "--nodes", &nodes],
    };
    let sampled = arguments[0] == "sample";
    if sampled {
        arguments.extend(["--out", "nodes.vtk"]);
    }
    let line = arguments.join(" ");
    let ended = watch::run(folder, &line);
    if let Some(fault) = ended.fault() {
        return Some(format!("{line}: {fault}"));
    }
    let fault = if !ended.status.success() {
        advice_fails(folder, &arguments, &ended)
    } else if sampled && known {
        wrong_volume(&ended, volume)
    } else {
        None
    };
    fault.map(|fault| format!("{line}: {fault}"))
}

/// The number that stands behind some words.
fn number_after(text: &str, words: &str) -> Option<f64> {
    let rest = text.split(words).nth(1)?.trim_start();
    let end = rest.find(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c)));
    rest[..end.unwrap_or(rest.len())]
        .trim_end_matches('.')
        .parse()
        .ok()
}

fn wrong_volume(ended: &Ended, volume: f64) -> Option<String> {
    let found = number_after(&ended.stderr, "; volume ")?;
    ((found / volume - 1.0).abs() > VOLUME_TOLERANCE)
        .then(|| format!("a volume of {found:e} and not {volume:e}: {}", ended.stderr))
}

/// Does what the message says.
fn advice_fails(folder: &Path, arguments: &[&str], ended: &Ended) -> Option<String> {
    let nodes = number_after(&ended.stderr, "ask for ").filter(|nodes| *nodes < 3e4);
    let spacing = number_after(&ended.stderr, ": use ");
    let fine = spacing.filter(|_| ended.stderr.contains(" or less"));
    let (key, value) = match (nodes, fine) {
        (Some(nodes), _) => ("--nodes", format!("{nodes}")),
        (None, Some(spacing)) => ("--spacing", format!("{spacing:e}")),
        (None, None) => return None,
    };
    let mut again: Vec<&str> = arguments.to_vec();
    let at = again
        .iter()
        .position(|word| ["--nodes", "--spacing"].contains(word))?;
    (again[at], again[at + 1]) = (key, &value);
    // The limits are those of bodies below 1e5 nodes; the estimate is good to a factor of two.
    if number_after(&ended.stderr, "(about ").is_some_and(|nodes| nodes > 5e4) {
        return None;
    }
    let line = again.join(" ");
    let second = watch::run(folder, &line);
    if let Some(fault) = second.fault() {
        return Some(format!("after '{}' {line}: {fault}", ended.stderr));
    }
    // A finer lattice may reveal a part that the coarser one lost with all the rest.
    let other = ["Slender", "parts vanish", "fills"];
    let still = !second.status.success() && !other.iter().any(|w| second.stderr.contains(w));
    let (first, second) = (&ended.stderr, &second.stderr);
    still.then(|| format!("its advice fails: {first} {line}: {second}"))
}
