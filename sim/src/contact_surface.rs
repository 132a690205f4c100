//! The outside of a body, as tools touch it.

use glam::DVec3;
use phyxel_discretize::{Solid, nodal_surface_areas};
use phyxel_integrate::ContactSurface;

use crate::error::BodyProblem;

/// Contact points along a side of a surface triangle: enough for contacts of two spacings.
const DIVISIONS: u32 = 4;

/// Nodes on the surface of a body without tetrahedra, each with the area (m²) nearest to it.
#[derive(Debug, Clone, Default)]
pub(crate) struct SurfaceNodes {
    nodes: Vec<u32>,
    areas: Vec<f64>,
}

impl SurfaceNodes {
    /// Covers `solid`, whose nodes on the surface are `outer`.
    pub(crate) fn new(
        solid: &Solid,
        rest: &[DVec3],
        outer: &[u32],
        spacing: f64,
    ) -> Result<Self, BodyProblem> {
        let places: Vec<DVec3> = outer.iter().map(|&node| rest[node as usize]).collect();
        let areas = nodal_surface_areas(solid, &places, spacing)?;
        let covered = outer.iter().copied().zip(areas);
        let (nodes, areas) = covered.filter(|&(_, area)| area > 0.0).unzip();
        Ok(Self { nodes, areas })
    }
}

/// Contact points on the outside of a body, of which a triangle is torn if two of its corners no longer hold
/// together.
pub(crate) fn contact_surface_of(
    surface_nodes: Option<&SurfaceNodes>,
    outside: &[[u32; 3]],
    rest: &[DVec3],
    holds: impl Fn(u32, u32) -> bool,
) -> Result<ContactSurface, BodyProblem> {
    let surface = match surface_nodes {
        // No node's area spans a gap.
        Some(surface_nodes) => {
            ContactSurface::from_nodes(&surface_nodes.nodes, &surface_nodes.areas, rest.len())?
        }
        None => ContactSurface::from_torn_triangles(outside, rest, DIVISIONS, holds)?,
    };
    Ok(surface)
}
