//! Baselines: the dissertation's enrichment grids (Aras 2014, chapter 3 and section 5.6), its fields and their
//! product. No default uses any of it.

mod fields;
mod grid;
mod grid_factors;

pub use fields::{product_of_segments, segment_enrichment, triangle_enrichment};
#[cfg(test)]
pub(crate) use grid::GridSheets;
pub use grid::{Enrichment, EnrichmentGrid, GridError, GridForm, GridSettings, grid_pair_factors};
pub(crate) use grid_factors::GridFactors;
