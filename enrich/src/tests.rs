//! Cases of every shape, oracles that share nothing with the code under test, and properties.

#![allow(clippy::cast_possible_truncation, reason = "counts of tests are small")]

mod growth;
mod planar_cases;
mod shapes;
mod slow;
mod space_cases;
