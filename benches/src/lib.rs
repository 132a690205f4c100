//! The validation suite: scenes whose outcome is known or bounded, run through [`phyxel::World`] as a
//! user would run them, and the figures that say whether what must hold did hold.
//!
//! A scene is run by [`run`], which watches every step and gives a [`Row`]; [`batch::run_all`] runs
//! many and writes them as CSV. `cargo run --release -p benches -- NAME` runs one study.
#![allow(
    clippy::cast_possible_truncation,
    clippy::missing_assert_message,
    clippy::unwrap_used,
    reason = "counts of studies are small, and a proof fails by panicking where it cannot be made"
)]

pub mod batch;
mod combined;

pub mod cook;
pub mod cracks;
pub mod draw;
mod eigenvalue;
mod error;
pub mod grids;
pub mod griffith;
pub mod incision;
pub mod matrix;
pub mod organs;
pub mod problems;
pub mod prove;
pub mod random;
pub mod report;
mod row;
pub mod spin;
pub mod studies;
mod watch;

pub use eigenvalue::largest_eigenvalue;
pub use error::StudyError;
pub use row::{Bars, Row};
pub use studies::{Effort, Findings, Study};
pub use watch::{Options, run, run_with};
