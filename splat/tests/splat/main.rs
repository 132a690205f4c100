//! Surfels, their nodes, cuts and pictures, by what users call.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "counts of tests are small"
)]

mod carried;
mod exact;
mod faces;
mod oracle;
mod sampling;
