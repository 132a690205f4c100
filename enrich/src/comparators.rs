//! What exists to be compared with: the dissertation's enrichment grids (Aras 2014, chapter 3 and section
//! 5.6), its fields and their product, closed-form angles, and cuts in the plane. No default uses any of it.

mod fields;
mod grid;
mod grid_factors;
mod planar;

pub use fields::{
    product_of_segments, segment_enrichment, triangle_enrichment, triangle_solid_angle,
};
pub use grid::{
    Enrichment, EnrichmentGrid, GridError, GridForm, GridSettings, GridSheets, grid_pair_factors,
};
pub use grid_factors::GridFactors;
pub use planar::PlanarCuts;
