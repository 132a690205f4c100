#![doc = include_str!("../README.md")]

mod chart;
mod design;
mod plan;
mod statistics;
mod tables;

pub use design::{Sequence, cases};
pub use plan::{Design, Plan, PlanError, ResultColumn, SweptKey, Values};
pub use statistics::{Quantiles, SHARES, Sensitivity, quantiles, sensitivity};
pub use tables::{FinishedCase, Tables, tables};
