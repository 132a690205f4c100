#![doc = include_str!("../picture.md")]
#![doc = include_str!("../README.md")]

mod blade;
mod checks;
mod choice;
mod comparators;
mod cuts;
mod edges;
mod error;
mod face;
mod factors;
mod forest;
mod front;
mod graph;
mod index;
mod joint;
mod ligament;
mod obstacle;
mod pieces;
mod polyline;
mod predicate;
mod rule;
mod way;

pub use blade::{Blade, DeformedBody, MaterialPlace, Sweep};
pub use checks::BadSetting;
pub use choice::{CutRule, Factors, SMALLEST_PART};
pub use comparators::{
    Enrichment, EnrichmentGrid, GridError, GridFactors, GridForm, GridSettings, GridSheets,
    PlanarCuts, grid_pair_factors, product_of_segments, segment_enrichment, triangle_enrichment,
    triangle_solid_angle,
};
pub use cuts::{CutSettings, Cuts, CutsMark, Dropped};
pub use error::{CutError, GraphError};
pub use face::NearestCut;
pub use factors::{FactorSettings, PairFactors, Touched};
pub use front::{EdgePlace, Front, Patch, SweptPair, close_edge, missed_pairs, swept_pairs};
pub use glam;
pub use graph::{Graph, InfluenceRadius, Rows};
pub use index::Bounds;
pub use obstacle::{DiffractionPoint, Obstacle};
pub use pieces::{Pieces, connected_pieces, is_parted, nodes_in_small_pieces};
pub use polyline::{largest_distance, resampled};
pub use rule::{Rule, Scratch};

#[cfg(test)]
mod tests;
