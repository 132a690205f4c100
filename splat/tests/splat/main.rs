//! Surfels, their nodes, cuts and pictures, by what users call.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::cast_possible_truncation, reason = "counts of tests are small")]

mod carried;
mod exact;
mod faces;
mod oracle;
mod sampling;
