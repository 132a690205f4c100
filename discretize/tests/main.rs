//! Everything that the crate promises, in one binary: files, repairs, samplings, errors.
#![allow(clippy::unwrap_used, reason = "a failing test names its line")]

mod blobs;
mod common;
mod errors;
mod files;
mod graded;
mod odd_meshes;
mod points;
mod real_meshes;
mod repairs;
mod slivers;
mod sums;
mod turned;
