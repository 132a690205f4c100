//! A block under a rigid sphere, for the indentation tests and the study.
#![allow(
    clippy::unwrap_used,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "helpers of tests fail by panicking, and count in small numbers"
)]

use crate::integrate_bodies::{Body, lattice};
use glam::DVec3;
use phyxel_integrate::{
    Contact, ContactPoint, ContactSettings, ContactSurface, NewtonSettings, Pose, Pressed, Shape,
    StaticLoad, StaticReport, Supports, penalty, solve_static,
};

pub(crate) use phyxel::study::indentation::{
    BLOCK_REFERENCE as REFERENCE, SMALL, SOFT, sphere_over_paraboloid,
};

/// A body with held sides and the contact of its top.
pub(crate) struct Press {
    pub(crate) body: Body,
    pub(crate) supports: Supports,
    pub(crate) contact: Contact,
    /// Relative residual that the static solution is to reach.
    tolerance: f64,
}

/// What was found.
pub(crate) struct Pressing {
    pub(crate) force: f64,
    pub(crate) report: StaticReport,
}

impl Press {
    /// A block `[-1, 1]² × [-2, 0]` with sides and bottom held.
    fn new(body: Body, spacing: f64) -> Self {
        let edge = 1e-9;
        let out = |x: DVec3| x.x.abs() > 1.0 - edge || x.y.abs() > 1.0 - edge || x.z < edge - 2.0;
        let held = body.nodes(out);
        let supports = Supports::fixed(body.rest.len(), &held);
        let top = body.faces(|x| x.z > -edge);
        let surface = ContactSurface::from_triangles(&top, &body.rest, 6).unwrap();
        let settings = ContactSettings::new(penalty(1.0, spacing));
        Self {
            body,
            supports,
            contact: Contact::new(surface, settings),
            tolerance: 1e-10,
        }
    }

    /// Static solution.
    pub(crate) fn press(&mut self, radius: f64, depth: f64) -> Pressing {
        let shape = Shape::Sphere { radius };
        let pose = Pose::at(DVec3::Z * (radius - depth));
        let mut x = self.body.rest.clone();
        let mut law = Pressed::new(&mut self.body, &mut self.contact, shape, pose);
        let settings = NewtonSettings {
            tolerance: self.tolerance,
            ..NewtonSettings::default()
        };
        let load = StaticLoad::default();
        let report = solve_static(&mut law, &mut x, &self.supports, &load, &settings).unwrap();
        let force = law.tool_forces[0].force.z;
        Pressing { force, report }
    }

    /// Force over that of finite elements less one, for one row of the reference.
    pub(crate) fn error(&mut self, (radius, depth, reference): (f64, f64, f64)) -> (f64, Pressing) {
        let found = self.press(radius / SMALL, depth * SMALL);
        let expected = reference * SMALL / sphere_over_paraboloid(radius, depth);
        (found.force / expected - 1.0, found)
    }
}

/// The 2 m cube on a regular lattice.
pub(crate) fn cube(cells: u32) -> Press {
    let low = DVec3::new(-1.0, -1.0, -2.0);
    let body = Body::block([cells; 3], low, DVec3::new(1.0, 1.0, 0.0), SOFT, 0.1);
    Press::new(body, 2.0 / f64::from(cells))
}

/// Nodes drawn towards the middle of the top: `s -> 0.45 s + 0.55 s³` along each axis.
pub(crate) fn graded(cells: [u32; 3]) -> Press {
    let grade = |s: f64| 0.45 * s + 0.55 * s * s * s;
    let (nodes, tetrahedra) = lattice(cells, |s| {
        let across = |s: f64| grade(2.0 * s - 1.0);
        DVec3::new(across(s.x), across(s.y), -2.0 * grade(1.0 - s.z))
    });
    let body = Body::new(&nodes, &tetrahedra, SOFT, 0.1);
    Press::new(body, 0.45 * 2.0 / f64::from(cells[0]))
}

/// Radius and depth (m) of the comparison with Hertz; the contact radius is a hundredth of the radius.
pub(crate) const HERTZ: (f64, f64) = (10.0, 0.001);

/// Hertz's contact radius (m).
pub(crate) fn hertz_radius() -> f64 {
    (HERTZ.0 * HERTZ.1).sqrt()
}

/// A quarter of a block between two symmetry planes, far sides held: `fine` cells over 1.5 contact
/// radii, then `coarse` ones that grow by 1.8 each. Also gives the block's size in contact radii.
pub(crate) fn quarter(fine: u32, coarse: u32) -> (Press, f64) {
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
    let cells = fine + coarse;
    let at = |s: f64| lines[(s * f64::from(cells)).round() as usize];
    let (nodes, tetrahedra) = lattice([cells; 3], |s| DVec3::new(at(s.x), at(s.y), -at(1.0 - s.z)));
    let body = Body::new(&nodes, &tetrahedra, SOFT, 0.1);
    let edge = 1e-9 * a;
    let mut supports = Supports::free(body.rest.len());
    for node in body.nodes(|x| x.x < edge) {
        supports.slide(node, DVec3::X);
    }
    for node in body.nodes(|x| x.y < edge) {
        supports.slide(node, DVec3::Y);
    }
    for node in body.nodes(|x| x.x.max(x.y).max(-x.z) > end - edge) {
        supports.fix(node);
    }
    let near = body.faces(|x| x.z > -edge && x.x < 3.0 * a && x.y < 3.0 * a);
    let surface = ContactSurface::from_triangles(&near, &body.rest, 6).unwrap();
    let settings = ContactSettings::new(penalty(1.0, spacing));
    let press = Press {
        body,
        supports,
        contact: Contact::new(surface, settings),
        // Cells of very unequal size: round-off of the far ones is above 1e-10 of the force.
        tolerance: 1e-8,
    };
    (press, end / a)
}

/// Hertz's force on a quarter (N) at E = 1 Pa, ν = 0.3.
pub(crate) fn hertz_quarter_force() -> f64 {
    let (radius, depth) = HERTZ;
    0.25 * 4.0 / 3.0 / (1.0 - 0.09) * radius.sqrt() * depth.powf(1.5)
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

/// Mean pressure over Hertz's largest, 2 E* sqrt(d/R)/π, on rings that end at these shares of the
/// contact radius, over the whole area of the ring; points out of contact count with none.
pub(crate) fn ring_pressures(points: &[ContactPoint], ends: &[f64]) -> Vec<f64> {
    let (radius, depth) = HERTZ;
    let largest = 2.0 / std::f64::consts::PI / (1.0 - 0.09) * (depth / radius).sqrt();
    let a = hertz_radius();
    let mut sums = vec![0.0; ends.len()];
    for point in points {
        let r = point.position.truncate().length() / a;
        if let Some(ring) = ends.iter().position(|end| r < *end) {
            sums[ring] += point.area * point.pressure / largest;
        }
    }
    let mut inner = 0.0;
    for (sum, end) in sums.iter_mut().zip(ends) {
        *sum /= std::f64::consts::PI / 4.0 * (end * end - inner * inner) * a * a;
        inner = *end;
    }
    sums
}

/// The same of Hertz's profile `sqrt(1 − (r/a)²)`.
pub(crate) fn hertz_rings(ends: &[f64]) -> Vec<f64> {
    let volume = |end: f64| -(1.0 - end.min(1.0).powi(2)).powf(1.5) * 2.0 / 3.0;
    let mut inner = 0.0;
    let mut rings = Vec::new();
    for end in ends {
        rings.push((volume(*end) - volume(inner)) / (end * end - inner * inner));
        inner = *end;
    }
    rings
}
