//! The 2 m cube under a sphere by finite elements: the reference, computed where it is wanted.

use glam::{BVec2, DVec2, DVec3};

use super::elements::{Elements, Order, displacements};
use super::indentation::{EDGE, Press, SMALL, SOFT, between_planes, grade, held};
use super::solid::Solid;
use crate::StudyError;

/// Unbalanced forces relative to the tool's at which the elements count as at rest.
const TOLERANCE: f64 = 1e-7;

/// A quarter of the cube of [`super::indentation::cube`] between two planes of symmetry, of triquadratic
/// finite elements on lines drawn towards the sphere, on two lattices.
///
/// With as many nodes as the whole cube it has half their distance under the sphere, where the contact is
/// known no better than to the node spacing: a whole cube of 12 intervals is 4 % too stiff.
#[derive(Debug)]
pub struct Reference {
    coarse: Press<Elements>,
    fine: Press<Elements>,
    /// Squared ratio of the nodes' distances, less one.
    refined: f64,
    moved: Vec<DVec3>,
}

/// What the reference says of one sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// Force (N) at E = 1 Pa and small strain, of both lattices extrapolated as errors that fall with the
    /// square of the node spacing (Richardson).
    pub force: f64,
    /// That of the finer lattice.
    pub fine: f64,
    /// That of the coarser one.
    pub coarse: f64,
}

impl Reference {
    /// Lattices of so many intervals along an edge of the quarter, even numbers, the second the finer.
    pub fn new(cells: [u32; 2]) -> Result<Self, StudyError> {
        Self::of(SOFT, cells)
    }

    /// The same of a solid of Young's modulus 1 Pa.
    pub fn of(solid: Solid, [coarse, fine]: [u32; 2]) -> Result<Self, StudyError> {
        Ok(Self {
            coarse: quarter(coarse, solid)?,
            fine: quarter(fine, solid)?,
            refined: (f64::from(fine) / f64::from(coarse)).powi(2) - 1.0,
            moved: Vec::new(),
        })
    }

    /// Presses a sphere of `radius` to `depth` (m), made small by [`SMALL`].
    pub fn press(&mut self, radius: f64, depth: f64) -> Result<Known, StudyError> {
        let force = |press: &mut Press<Elements>| {
            let found = press.press(radius / SMALL, depth * SMALL, TOLERANCE)?;
            Ok::<_, StudyError>(4.0 * found.force / SMALL)
        };
        let (coarse, fine) = (force(&mut self.coarse)?, force(&mut self.fine)?);
        self.moved = displacements(&self.fine.positions, &self.fine.rest);
        Ok(Known {
            force: fine + (fine - coarse) / self.refined,
            fine,
            coarse,
        })
    }

    /// Displacement (m, of the small strain) of a point of the whole cube under the last sphere, by the
    /// finer lattice.
    pub fn displacement(&self, at: DVec3) -> DVec3 {
        mirrored(&self.fine.body, &self.moved, at)
    }

    /// Norm of the error of nodes' displacements under the last sphere over the norm of the reference's there
    /// (Aras 2014, fig. 71).
    ///
    /// # Panics
    /// If there is not one position per node.
    pub fn norm(&self, rest: &[DVec3], positions: &[DVec3]) -> f64 {
        assert_eq!(rest.len(), positions.len(), "one position per node");
        let (mut error, mut size) = (0.0, 0.0);
        for (x, rest) in positions.iter().zip(rest) {
            let known = self.displacement(*rest);
            error += known.distance_squared(*x - *rest);
            size += known.length_squared();
        }
        f64::sqrt(error / size)
    }
}

fn quarter(cells: u32, solid: Solid) -> Result<Press<Elements>, StudyError> {
    let part = |k: u32| f64::from(k) / f64::from(cells);
    let across = || (0..=cells).map(|k| grade(part(k))).collect();
    let down = (0..=cells).map(|k| -2.0 * grade(1.0 - part(k))).collect();
    let body = Elements::new([across(), across(), down], Order::Quadratic, solid);
    let supports = between_planes(&body.rest, EDGE, held);
    Press::on_elements(body, supports, 0.45 / f64::from(cells))
}

/// A field of the quarter at a point of the whole cube.
fn mirrored(body: &Elements, values: &[DVec3], at: DVec3) -> DVec3 {
    let value = body.field_at(values, at.abs().truncate().extend(at.z));
    let is_mirrored = BVec2::new(at.x < 0.0, at.y < 0.0);
    let sign = DVec2::select(is_mirrored, DVec2::NEG_ONE, DVec2::ONE);
    value * sign.extend(1.0)
}
