#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod blade;
mod bounds;
mod closing;
mod comparators;
mod cut_rule;
mod cuts;
mod edges;
mod error;
mod face;
mod factors;
mod forest;
mod front;
mod graph;
mod ligament;
mod path;
mod pieces;
mod polyline;
mod predicate;
mod rule;

pub use blade::{Blade, DeformedBody, MaterialPlace, Sweep};
pub use comparators::{
    Enrichment, EnrichmentGrid, GridError, GridForm, GridSettings, grid_pair_factors,
    product_of_segments, segment_enrichment, triangle_enrichment,
};
pub use cut_rule::{CutRule, Factors, SMALLEST_PART};
pub use cuts::{CutSettings, Cuts};
pub use error::{CutError, GraphError};
pub use factors::{FactorSettings, PairFactors};
pub use front::Patch;
pub use glam;
pub use graph::{Graph, InfluenceRadius, Rows};
pub use pieces::{Pieces, connected_pieces, is_parted};
pub use polyline::{largest_distance, resampled};
pub use rule::Rule;

/// Converts a count to an index of 32 bits.
///
/// # Panics
/// If there are 2³² of them or more.
fn index32(count: usize) -> u32 {
    u32::try_from(count).expect("fewer than 2^32 triangles, nodes and pairs")
}

#[cfg(test)]
mod tests;
