#![doc = include_str!("../README.md")]

mod case;
mod chart;
mod collect;
mod design;
mod plan;
mod pool;
mod statistics;
mod tables;

pub use case::{Case, CaseHashes, Outcome, write_cases};
pub use collect::{CollectError, Collected, collect};
pub use design::{Sequence, cases};
pub use plan::{Design, Plan, PlanError, ResultColumn, SweptKey, Values};
pub use pool::{PoolError, PoolOptions, Tally, run_cases};
pub use statistics::{Quantiles, SHARES, Sensitivity, quantiles, sensitivity};
pub use tables::{FinishedCase, Tables, tables};
