#![doc = include_str!("../README.md")]

mod cuts;
mod error;
mod face;
mod factors;
mod index;
mod node_grid;
mod obstacle;
mod pieces;
mod planar;
mod predicate;
mod rule;

pub use cuts::{CutSettings, Cuts, Dropped};
pub use error::CutError;
pub use face::NearestCut;
pub use factors::{FactorError, FactorSettings, PairFactors, Touched};
pub use index::Bounds;
pub use obstacle::{Bend, Obstacle};
pub use pieces::{Pieces, connected_pieces};
pub use planar::PlanarCuts;
pub use rule::{Rule, Scratch};

#[cfg(test)]
mod tests;
