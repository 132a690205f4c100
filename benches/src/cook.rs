//! Cook's membrane: a skew panel, clamped at its left edge and sheared at its right.
//!
//! The compressible benchmark of linear plane stress: `E = 1`, `ν = 1/3`, load 1, thickness 1; the
//! middle of the right edge rises by 23.96 (Cook 1974; converged value of fine meshes). The nearly
//! incompressible variant in plane strain is another one, with another value.

use crate::problems::block::{Block, lattice};
use crate::problems::model::{ElasticBody, small_displacements};
use crate::problems::nearest;
use crate::problems::solid::Solid;
use glam::DVec3;
use serde::Serialize;

use crate::error::StudyError;

/// Rise of the middle of the right edge.
pub const RISE: f64 = 23.96;
/// Largest deviation of bodies of so many cells and more.
const DEVIATION: f64 = 0.02;
/// See [`DEVIATION`].
const FINE: u32 = 32;

/// What was found at one fineness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Finding {
    /// Cells along each side.
    pub cells: u32,
    /// Nodes.
    pub nodes: usize,
    /// Rise of the middle of the right edge.
    pub rise: f64,
}

/// Loads a membrane of `cells` × `cells` × 1 cells, half of one that is symmetric about its middle
/// plane, with free faces: plane stress as its thickness vanishes against its sides.
pub fn measure(cells: u32) -> Result<Finding, StudyError> {
    let thickness = 48.0 / f64::from(cells);
    let (nodes, tetrahedra) = lattice([cells, cells, 1], |s| {
        let low = 44.0 * s.x;
        let high = 44.0 + 16.0 * s.x;
        DVec3::new(48.0 * s.x, low + (high - low) * s.y, thickness * s.z)
    });
    let solid = Solid {
        youngs_modulus: 1.0,
        poissons_ratio: 1.0 / 3.0,
        density: 1.0,
    };
    let block = Block::ordered(&nodes, &tetrahedra)?;
    // A load of 1 on an edge 16 long, spread over the face.
    let forces = block.traction(|x| x.x > 48.0 - 1e-9, DVec3::Y / 16.0);
    let mut body = ElasticBody::on(block, solid, 0.1)?;
    let rest = body.rest.clone();
    let moved = small_displacements(&mut body, &rest, &forces, |node| {
        let [free, off] = [rest[node].x, rest[node].z].map(|x| f64::from(u8::from(x >= 1e-9)));
        DVec3::new(free, free, off)
    })?;
    let middle = nearest(&rest, DVec3::new(48.0, 52.0, 0.0), |_| true);
    Ok(Finding {
        cells,
        nodes: rest.len(),
        rise: middle.map_or(f64::NAN, |node| moved[node].y),
    })
}

/// What exceeds a limit, in words: nothing of coarse bodies.
pub fn breaches(finding: &Finding) -> Vec<String> {
    let off = (finding.rise / RISE - 1.0).abs();
    let exceeds = finding.cells >= FINE && (off.is_nan() || off > DEVIATION);
    let words = || format!("Cook's membrane rises by {:.3}, not {RISE}", finding.rise);
    exceeds.then(words).into_iter().collect()
}
