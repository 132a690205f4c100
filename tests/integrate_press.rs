//! A block under a rigid sphere, for the indentation tests and the study: what both ask of the problems
//! of `phyxel study hertz`.
#![allow(clippy::unwrap_used, reason = "helpers of tests fail by panicking")]

use phyxel::study::StudyError;
use phyxel::study::indentation as problem;
use phyxel::study::indentation::{Pressing, Ring, hertz_force};
use phyxel::study::model::ElasticBody;
use phyxel_integrate::ContactPoint;

pub(crate) use phyxel::study::indentation::{
    BLOCK_REFERENCE as REFERENCE, SMALL, SOFT, block_force,
};

/// A body with held sides and the contact of its top.
pub(crate) struct Press {
    inner: problem::Press,
    /// Relative residual that the static solution is to reach.
    tolerance: f64,
}

impl Press {
    fn cube((nodes, tetrahedra): (Vec<glam::DVec3>, Vec<[u32; 4]>), spacing: f64) -> Self {
        let body = ElasticBody::new(&nodes, &tetrahedra, SOFT, 0.1).unwrap();
        Self {
            inner: problem::Press::cube(body, spacing).unwrap(),
            tolerance: 1e-10,
        }
    }

    /// Static solution.
    pub(crate) fn press(&mut self, radius: f64, depth: f64) -> Pressing {
        self.inner.press(radius, depth, self.tolerance).unwrap()
    }

    /// Force over that of finite elements less one, for one row of the reference.
    pub(crate) fn error(&mut self, row: (f64, f64, f64)) -> (f64, Pressing) {
        let found = self.press(row.0 / SMALL, row.1 * SMALL);
        (found.force / (block_force(row) * SMALL) - 1.0, found)
    }

    pub(crate) fn node_count(&self) -> usize {
        self.inner.body.rest.len()
    }

    pub(crate) fn points(&self) -> &[ContactPoint] {
        self.inner.points()
    }

    /// Mean pressures beside Hertz's, in rings that end at these shares of the contact radius.
    pub(crate) fn rings(&self, ends: &[f64]) -> Vec<Ring> {
        let (radius, depth) = HERTZ;
        let largest = 2.0 / std::f64::consts::PI / (1.0 - 0.09) * (depth / radius).sqrt();
        self.inner.rings(hertz_radius(), largest, ends)
    }
}

/// The 2 m cube on a regular lattice.
pub(crate) fn cube(cells: u32) -> Press {
    Press::cube(problem::cube_lattice(cells), 2.0 / f64::from(cells))
}

/// Nodes drawn towards the middle of the top.
pub(crate) fn graded(cells: [u32; 3]) -> Press {
    Press::cube(
        problem::graded_lattice(cells),
        0.45 * 2.0 / f64::from(cells[0]),
    )
}

/// Radius and depth (m) of the comparison with Hertz; the contact radius is a hundredth of the radius.
pub(crate) const HERTZ: (f64, f64) = (10.0, 0.001);

/// Hertz's contact radius (m).
fn hertz_radius() -> f64 {
    (HERTZ.0 * HERTZ.1).sqrt()
}

/// A quarter of a block: `fine` cells over 1.5 contact radii, then `coarse` ones that grow by 1.8 each.
/// Also gives the block's size in contact radii.
pub(crate) fn quarter(fine: u32, coarse: u32) -> Result<(Press, f64), StudyError> {
    let a = hertz_radius();
    let mut h = 1.5 * a / f64::from(fine);
    let spacing = h;
    let mut lines = vec![0.0];
    let mut end = 0.0;
    for cell in 0..fine + coarse {
        if cell >= fine {
            h *= 1.8;
        }
        end += h;
        lines.push(end);
    }
    let press = Press {
        inner: problem::Press::quarter(&lines, 3.0 * a, spacing)?,
        // Cells of very unequal size: round-off of the far ones is above 1e-10 of the force.
        tolerance: 1e-8,
    };
    Ok((press, end / a))
}

/// Hertz's force on a quarter (N) at E = 1 Pa, ν = 0.3.
pub(crate) fn hertz_quarter_force() -> f64 {
    0.25 * hertz_force(SOFT, HERTZ.0, HERTZ.1)
}

/// Contact radius over Hertz's, from the second moment of the pressure: `∫ p r² / ∫ p = 2/5 a²` for
/// Hertz's profile.
pub(crate) fn contact_radius(points: &[ContactPoint]) -> f64 {
    let (mut moment, mut force) = (0.0, 0.0);
    for point in points {
        moment += point.area * point.pressure * point.position.truncate().length_squared();
        force += point.area * point.pressure;
    }
    (2.5 * moment / force).sqrt() / hertz_radius()
}
