//! Points of a surface.

use glam::DVec3;

/// Surface points: positions (m), outward unit normals, areas (m²) that sum to the surface's.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurfaceSamples {
    /// Positions (m).
    pub positions: Vec<DVec3>,
    /// Outward unit normals; none where a file has none.
    pub normals: Vec<DVec3>,
    /// Areas (m²).
    pub areas: Vec<f64>,
}
