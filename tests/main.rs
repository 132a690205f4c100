//! What needs two crates or more: one test binary, one module per subject.
#![allow(
    clippy::missing_assert_message,
    reason = "a failing test names its line; messages are given where the values are not in sight"
)]

mod elastic_accuracy;
mod organ_stencils;
