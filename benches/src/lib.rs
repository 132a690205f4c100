//! The validation suite: scenes whose outcome is known or bounded, run through [`phyxel::World`] as a
//! user would run them, and the figures that say whether what must hold did hold.
//!
//! A scene is run by `watch::run`, which watches every step and gives a `Row`; `batch::run_all` runs
//! many and writes them as CSV. `cargo run --release -p benches -- NAME` runs one study.
//!
//! What leaves this crate is the command.
#![allow(
    unreachable_pub,
    clippy::cast_possible_truncation,
    clippy::missing_assert_message,
    clippy::unwrap_used,
    reason = "modules are the program's own, counts of studies are small, and a proof fails by panicking where it \
              cannot be made"
)]

mod batch;
mod combined;
mod command;
mod cook;
mod cracks;
mod eigenvalue;
mod error;
mod griffith;
mod incision;
mod matrix;
mod mechanics;
mod organs;
mod problems;
mod prove;
mod random;
mod report;
mod row;
mod studies;
mod watch;

pub use command::main;
use error::StudyError;
use row::Row;
use studies::{Effort, Findings, Study};
use watch::Options;
