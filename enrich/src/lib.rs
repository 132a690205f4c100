#![doc = include_str!("../README.md")]

mod comparators;
mod cuts;
mod error;
mod face;
mod factors;
mod forest;
mod front;
mod graph;
mod grid;
mod index;
mod joint;
mod node_grid;
mod obstacle;
mod pieces;
mod planar;
mod predicate;
mod rule;
mod way;

pub use comparators::{
    polyline_angle, product_of_segments, segment_enrichment, triangle_enrichment,
    triangle_solid_angle,
};
pub use cuts::{CutSettings, Cuts, Dropped};
pub use error::{CutError, GraphError};
pub use face::{FaceAreas, NearestCut};
pub use factors::{FactorSettings, PairFactors, Touched};
pub use front::{Front, Patch, Place, SweptPair, close_edge, missed_pairs, swept_pairs};
pub use glam;
pub use graph::{Graph, Reach, Rows};
pub use grid::{Enrichment, EnrichmentGrid, GridError, GridForm, GridSettings, grid_pair_factors};
pub use index::Bounds;
pub use obstacle::{Bend, Obstacle};
pub use pieces::{Pieces, connected_pieces, nodes_in_small_pieces};
pub use planar::PlanarCuts;
pub use rule::{Rule, Scratch};

#[cfg(test)]
mod tests;
