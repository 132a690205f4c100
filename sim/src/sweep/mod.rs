//! Many runs of one scene: a plan says what changes from case to case, every case is run by a process of
//! its own, and their results are put into one table.
//!
//! A case is finished when its folder holds an outcome with the case's hash (of the scene as resolved, of
//! the files it names and of the program's version), so that whoever runs cases, in whatever order and on
//! whatever machine, shares nothing but a folder.

mod case;
mod collect;
mod outcome;
mod pool;

pub use case::{Case, RefusedCase, place_of, write_cases};
pub use collect::{CollectError, Collected, collect};
pub use outcome::{CaseError, Outcome, run_case};
pub use phyxel_sweep::{Plan, PlanError};
pub use pool::{PoolError, PoolOptions, Tally, run_cases};
