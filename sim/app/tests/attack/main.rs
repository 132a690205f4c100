//! An attack on the program: files made at random, broken at random, and runs ended at random.
//!
//! Whatever it is given, the program ends by itself, within limits of time and memory, with a result or
//! with one line that says why not. Every case follows from a seed and its number. `cargo test` runs a
//! few; an attack of its own runs as many as wanted:
//!
//! ```text
//! PHYXEL_ATTACK_SEED=7 PHYXEL_ATTACK_MESHES=5000 PHYXEL_ATTACK_SCENES=5000 PHYXEL_ATTACK_KILLS=40 \
//!     PHYXEL_ATTACK_PLANS=1000 PHYXEL_ATTACK_CHECKPOINTS=1000 cargo test --release -p phyxel-cli --test attack -- --nocapture
//! ```
//!
//! `PHYXEL_ATTACK_ONLY=N,M` runs these cases only and `PHYXEL_ATTACK_FROM=N` those from N on,
//! `PHYXEL_ATTACK_KEEP=FOLDER` keeps the files of cases that find something, and
//! `PHYXEL_ATTACK_PROGRAM=FILE` attacks that program instead of the one built with the test (so that an
//! attack of hours continues while the program is fixed).
#![cfg(target_os = "linux")]
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::cast_possible_truncation,
    reason = "a failing test names its line; random numbers are small; an attack tells its table"
)]

mod checkpoints;
mod disks;
mod kills;
mod meshes;
mod plans;
mod scenes;
mod shapes;
mod watch;
mod writers;

use std::fmt::Write;
use std::path::Path;

use testkit::cloud::Random;

/// Cases that found something once: kind, seed and number.
const KNOWN: [(&str, u64, u64); 1] = [
    // 592 nodes were advised, of which there was no sampling.
    ("meshes", 990_102, 2832),
];

/// Runs as many cases of a kind as its variable says, else a few; fails if any finds something.
///
/// A case is given a folder of its own and its random numbers, and returns what it found.
fn attack(kind: &str, few: u64, case: impl Fn(&Path, &mut Random) -> Option<String>) {
    let number = |name: &str| -> Option<u64> {
        let value = std::env::var(name).ok()?;
        Some((value.parse()).unwrap_or_else(|_| panic!("{name} is {value}")))
    };
    let cases = number(&format!("PHYXEL_ATTACK_{}", kind.to_uppercase())).unwrap_or(few);
    let seed = number("PHYXEL_ATTACK_SEED").unwrap_or(1);
    let from = number("PHYXEL_ATTACK_FROM").unwrap_or(0);
    let only: Option<Vec<u64>> = std::env::var("PHYXEL_ATTACK_ONLY")
        .ok()
        .map(|list| list.split(',').map(|n| n.parse().unwrap()).collect());
    let mut found = String::new();
    let mut count = 0;
    let mut tried = 0;
    let asked = (from..cases).filter(|at| only.as_ref().is_none_or(|only| only.contains(at)));
    let known = KNOWN.iter().filter(|known| known.0 == kind);
    let known = known.map(|&(_, seed, at)| (seed, at));
    for (seed, at) in known.chain(asked.map(|at| (seed, at))) {
        tried += 1;
        let folder = tempfile::tempdir().unwrap();
        let mut random = seeded(seed, kind, at);
        if let Some(what) = case(folder.path(), &mut random) {
            count += 1;
            writeln!(found, "{kind} {at} of seed {seed}: {what}").unwrap();
            println!("{kind} {at} of seed {seed}: {what}");
            if let Some(keep) = std::env::var_os("PHYXEL_ATTACK_KEEP") {
                let to = Path::new(&keep).join(format!("{kind}-{seed}-{at}"));
                let mut copy = std::process::Command::new("cp");
                copy.arg("-r").args([folder.path(), &to]).status().unwrap();
            }
        }
    }
    println!("| {kind} | {seed} | {tried} | {count} |");
    assert!(found.is_empty(), "{found}");
}

/// Random numbers that follow from a seed, for a case of a kind.
fn seeded(seed: u64, kind: &str, case: u64) -> Random {
    let kind = kind.bytes().fold(0, |sum: u64, byte| {
        sum.wrapping_mul(257).wrapping_add(u64::from(byte))
    });
    let first = Random::new(seed.wrapping_mul(0x5851_f42d_4c95_7f2d) ^ kind).bits();
    let mut random = Random::new(first.wrapping_add(case.wrapping_mul(0x2545_f491_4f6c_dd1d)));
    random.bits();
    random
}

#[test]
fn meshes() {
    attack("meshes", 24, meshes::case);
}

#[test]
fn scenes() {
    attack("scenes", 40, scenes::case);
}

#[test]
fn plans() {
    attack("plans", 40, plans::case);
}

#[test]
fn disks() {
    let whole = kills::Whole::new();
    attack("disks", 6, |folder, random| {
        disks::case(&whole, folder, random)
    });
}

#[test]
fn kills() {
    let whole = kills::Whole::new();
    attack("kills", 2, |folder, random| {
        kills::case(&whole, folder, random)
    });
}

#[test]
fn checkpoints() {
    let kept = checkpoints::Kept::new();
    attack("checkpoints", 24, |folder, random| {
        kept.case(folder, random)
    });
}
