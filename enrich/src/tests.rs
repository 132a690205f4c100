//! Cases of every shape, oracles that share nothing with the code under test, and properties.

#![allow(
    clippy::cast_possible_truncation,
    clippy::float_cmp,
    reason = "counts of tests are small; factors of 0 and 1 are exact"
)]

mod dissertation;
mod fronts;
mod growth;
mod hard;
mod joints;
mod ligaments;
mod memory;
mod pieces;
mod planar_cases;
mod shapes;
pub(crate) mod slow;
mod space_cases;
