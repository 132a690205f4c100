//! Test helpers for every crate of the workspace: tolerances that reject NaN, point clouds from
//! fixed seeds, derivative checks. Depends on none of the crates it helps to test.
#![allow(
    clippy::missing_panics_doc,
    reason = "helpers of tests fail by panicking"
)]

pub mod block;
pub mod cloud;
pub mod derivative;
pub mod kuhn;
mod octree;
pub mod strategies;
pub mod tol;
