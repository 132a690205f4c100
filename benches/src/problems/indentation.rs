//! A rigid sphere pressed into a block, and what theory says of it.

use std::f64::consts::PI;

use glam::DVec3;
use phyxel_discretize::{Primitive, SampleSettings, Solid as Shape, sample_tetrahedra};
use phyxel_integrate::{
    BoundaryConditions, Contact, ContactPoint, ContactSettings, ContactSurface, ForceLaw,
    NewtonSettings, Pose, Pressed, RigidShape, StaticLoad, StaticReport, penalty, solve_static,
};

use super::block::{faces_where, lattice, lattice_on};
use super::elements::{Elements, Order};
use super::model::ElasticBody;
use super::solid::Solid;
use crate::StudyError;

/// Tissue of unit stiffness: forces scale with Young's modulus.
pub const SOFT: Solid = Solid {
    youngs_modulus: 1.0,
    poissons_ratio: 0.3,
    density: 1.0,
};

/// Spheres that the 2 m cube is pressed with: radius and depth (m).
pub const SPHERES: [(f64, f64); 3] = [(1.0, 0.05), (1.0, 0.1), (0.5, 0.05)];

/// The reference is at small strain. Depth times this and radius over this leave the contact radius and
/// the ratio to Hertz as they are and make the strain small.
pub const SMALL: f64 = 0.01;

/// Force (N) of a sphere on a half-space (Hertz 1882; Aras 2014, eqs (65) and (66) with a rigid
/// sphere).
pub fn hertz_force(solid: Solid, radius: f64, depth: f64) -> f64 {
    let modulus = solid.youngs_modulus / (1.0 - solid.poissons_ratio * solid.poissons_ratio);
    4.0 / 3.0 * modulus * radius.sqrt() * depth.powf(1.5)
}

/// A body with fixed nodes whose top a sphere is pressed into.
#[derive(Debug)]
pub struct Press<B = ElasticBody> {
    /// The body.
    pub body: B,
    /// Its rest positions (m).
    pub rest: Vec<DVec3>,
    /// Where the last sphere left its nodes (m).
    pub positions: Vec<DVec3>,
    supports: BoundaryConditions,
    contact: Contact,
}

/// What a sphere found.
#[derive(Debug)]
pub struct Pressing {
    /// Force (N) on the sphere.
    pub force: f64,
    /// Radius (m) of a disc as large as the part of the surface in contact.
    pub contact_radius: f64,
    /// Of the solver.
    pub report: StaticReport,
}

impl Press {
    /// A 2 m cube, its top at z = 0, from its body: sides and bottom fixed, contact by six
    /// points a triangle of the top. `spacing` (m) sets the penalty.
    fn cube(body: ElasticBody, spacing: f64) -> Result<Self, StudyError> {
        let supports = BoundaryConditions::fixed_where(&body.rest, held);
        let (top, rest) = (body.faces(on_top), body.rest.clone());
        Self::of(body, rest, supports, &top, spacing)
    }

    /// The same by the default on nodes of tetrahedra, with hourglass stabilization `control`.
    pub fn on_nodes(
        (nodes, tetrahedra): (Vec<DVec3>, Vec<[u32; 4]>),
        control: f64,
        spacing: f64,
    ) -> Result<Self, StudyError> {
        let body = ElasticBody::new(&nodes, &tetrahedra, SOFT, control)?;
        Self::cube(body, spacing)
    }

    /// The same by the dissertation's model on a regular lattice.
    pub fn by_dissertation(cells: u32) -> Result<Self, StudyError> {
        let (nodes, tetrahedra) = cube_lattice(cells);
        let body = ElasticBody::dissertation(&nodes, &tetrahedra, SOFT)?;
        Self::cube(body, 2.0 / f64::from(cells))
    }

    /// Positions (m) as they are read, where the last sphere left the body: see
    /// [`phyxel_elastic::Elastic::smoothed_positions`].
    pub fn smoothed(&self) -> Vec<DVec3> {
        let mut smoothed = self.body.elastic.smoothed_positions(&self.positions);
        self.supports.keep(&self.positions, &mut smoothed);
        smoothed
    }

    /// A quarter of a block between two symmetry planes, far sides and bottom fixed: `lines` (m), ascending
    /// from 0, are where its nodes lie along each axis. Contact within `reach` (m) of the corner, by six
    /// points a triangle; `spacing` (m) sets the penalty.
    pub fn quarter(lines: &[f64], reach: f64, spacing: f64) -> Result<Self, StudyError> {
        let end = lines.last().copied().unwrap_or_default();
        let down: Vec<f64> = lines.iter().rev().map(|x| -x).collect();
        let (nodes, tetrahedra) = lattice_on([lines, lines, &down]);
        let body = ElasticBody::new(&nodes, &tetrahedra, SOFT, 0.1)?;
        let edge = 1e-9 * reach;
        let is_far = |x: DVec3| x.x.max(x.y).max(-x.z) > end - edge;
        let supports = between_planes(&body.rest, edge, is_far);
        let near = body.faces(|x| x.z > -edge && x.x < reach && x.y < reach);
        let rest = body.rest.clone();
        Self::of(body, rest, supports, &near, spacing)
    }
}

impl Press<Elements> {
    /// The 2 m cube of [`Press::cube`] of finite elements on even lines.
    pub fn of_elements(cells: u32, order: Order) -> Result<Self, StudyError> {
        let low = DVec3::new(-1.0, -1.0, -2.0);
        let body = Elements::even([cells; 3], low, low + 2.0, order, SOFT);
        let supports = BoundaryConditions::fixed_where(&body.rest, held);
        Self::on_elements(body, supports, 2.0 / f64::from(cells))
    }

    /// Elements whose top, at z = 0, is pressed; `spacing` (m) sets the penalty.
    pub(super) fn on_elements(
        body: Elements,
        supports: BoundaryConditions,
        spacing: f64,
    ) -> Result<Self, StudyError> {
        let top = faces_where(&body.triangles, &body.rest, on_top);
        let rest = body.rest.clone();
        Self::of(body, rest, supports, &top, spacing)
    }
}

impl<B: ForceLaw> Press<B> {
    /// A body of Young's modulus 1 Pa with the triangles of its `top`.
    pub(crate) fn of(
        body: B,
        rest: Vec<DVec3>,
        supports: BoundaryConditions,
        top: &[[u32; 3]],
        spacing: f64,
    ) -> Result<Self, StudyError> {
        let surface = ContactSurface::from_triangles(top, &rest, 6)?;
        let settings = ContactSettings::new(penalty(SOFT.youngs_modulus, spacing));
        Ok(Self {
            body,
            positions: rest.clone(),
            rest,
            supports,
            contact: Contact::new(surface, settings),
        })
    }

    /// Presses a sphere of `radius` to `depth` (m); unbalanced forces fall to `tolerance`.
    pub fn press(
        &mut self,
        radius: f64,
        depth: f64,
        tolerance: f64,
    ) -> Result<Pressing, StudyError> {
        let pose = Pose::at(DVec3::Z * (radius - depth));
        let mut x = self.rest.clone();
        let shape = RigidShape::Sphere { radius };
        let mut law = Pressed::new(&mut self.body, &mut self.contact, shape, pose);
        let settings = NewtonSettings::with_tolerance(tolerance);
        let load = StaticLoad::default();
        let report = solve_static(&mut law, &mut x, &self.supports, &load, &settings)?;
        let sum = law.tool_forces[0];
        self.positions = x;
        Ok(Pressing {
            force: sum.force.z,
            contact_radius: (sum.area / PI).sqrt(),
            report,
        })
    }
}

/// The 2 m cube on a regular lattice.
pub fn cube(cells: u32) -> Result<Press, StudyError> {
    Press::on_nodes(cube_lattice(cells), 0.1, 2.0 / f64::from(cells))
}

/// The same with nodes drawn towards the middle of the top.
pub fn graded(cells: [u32; 3]) -> Result<Press, StudyError> {
    Press::on_nodes(graded_lattice(cells), 0.1, 0.45 * 2.0 / f64::from(cells[0]))
}

/// Radius (m) of the sphere that a half-space is pressed with.
const LARGE: f64 = 10.0;

/// Hertz's contact radius (m) of a sphere of 10 m, `depth` (m) deep.
pub fn hertz_radius(depth: f64) -> f64 {
    (LARGE * depth).sqrt()
}

/// Lines (m) from 0: so many `spacing` apart, then so many whose distances grow by `growth` each.
fn growing_lines(mut spacing: f64, [even, growing]: [u32; 2], growth: f64) -> Vec<f64> {
    let (mut lines, mut end) = (vec![0.0], 0.0);
    for cell in 0..even + growing {
        if cell >= even {
            spacing *= growth;
        }
        end += spacing;
        lines.push(end);
    }
    lines
}

/// Hertz's largest pressure (Pa) of a sphere of `radius`, `depth` deep (m), on [`SOFT`].
fn hertz_pressure(radius: f64, depth: f64) -> f64 {
    2.0 / PI / (1.0 - SOFT.poissons_ratio.powi(2)) * (depth / radius).sqrt()
}

/// Contact radius (m) from the second moment of the pressure: `∫ p r² / ∫ p = 2/5 a²` for Hertz's profile.
fn moment_radius(points: &[ContactPoint]) -> f64 {
    let (mut moment, mut force) = (0.0, 0.0);
    for point in points {
        moment += point.area * point.pressure * point.position.truncate().length_squared();
        force += point.area * point.pressure;
    }
    (2.5 * moment / force).sqrt()
}

/// Nodes and tetrahedra of the 2 m cube, `cells` along each side.
pub fn cube_lattice(cells: u32) -> (Vec<DVec3>, Vec<[u32; 4]>) {
    let low = DVec3::new(-1.0, -1.0, -2.0);
    lattice([cells; 3], |s| low + 2.0 * s)
}

/// The same with nodes drawn towards the middle of the top, `s -> 0.45 s + 0.55 s³` along each axis.
pub fn graded_lattice(cells: [u32; 3]) -> (Vec<DVec3>, Vec<[u32; 4]>) {
    lattice(cells, |s| {
        let across = |s: f64| grade(2.0 * s - 1.0);
        DVec3::new(across(s.x), across(s.y), -2.0 * grade(1.0 - s.z))
    })
}

/// Nodes and tetrahedra of the 2 m cube as scenes sample it, about `count` nodes.
pub fn cube_sampled(count: usize) -> Result<(Vec<DVec3>, Vec<[u32; 4]>), StudyError> {
    let half_extents = DVec3::ONE;
    let cube = Shape::from(Primitive::Box { half_extents });
    let found = sample_tetrahedra(&cube, &SampleSettings::nodes(count))?;
    let nodes = found.positions.iter().map(|x| *x - DVec3::Z).collect();
    Ok((nodes, found.tetrahedra))
}

/// Supports of a quarter between the planes x = 0 and y = 0 of symmetry, on which nodes are up to `edge` (m); fixed where
/// `is_held` says.
pub(super) fn between_planes(
    rest: &[DVec3],
    edge: f64,
    is_held: impl Fn(DVec3) -> bool,
) -> BoundaryConditions {
    let mut supports = BoundaryConditions::fixed_where(rest, &is_held);
    for (node, x) in (0_u32..).zip(rest).filter(|(_, x)| !is_held(**x)) {
        supports.fix_axes(node, [x.x < edge, x.y < edge, false]);
    }
    supports
}

/// Whether a point of the cube is on a held side.
pub fn held(x: DVec3) -> bool {
    x.x.abs().max(x.y.abs()) > 1.0 - EDGE || x.z < EDGE - 2.0
}

/// Whether a point of the cube is on its top.
pub fn on_top(x: DVec3) -> bool {
    x.z > -EDGE
}

/// Nodes this near (m) a side are on it.
pub(super) const EDGE: f64 = 1e-9;

/// Draws 0 nearer, from -1..=1 to -1..=1.
pub(super) fn grade(s: f64) -> f64 {
    0.45 * s + 0.55 * s * s * s
}

/// Mean pressure in rings around the middle of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// Inner and outer radius over Hertz's contact radius.
    pub radii: [f64; 2],
    /// Mean pressure over Hertz's largest.
    pub pressure: f64,
    /// The same of Hertz's profile `sqrt(1 - (r/a)²)`.
    pub expected: f64,
}

/// A sphere on a quarter of a block of some 40 contact radii, between two symmetry planes.
#[derive(Debug)]
pub struct HalfSpace {
    /// Nodes.
    pub nodes: usize,
    /// Size of the block over Hertz's contact radius.
    pub size: f64,
    /// Force over Hertz's.
    pub force: f64,
    /// Contact radius over Hertz's, by the area in contact.
    pub contact_radius: f64,
    /// The same by the second moment of the pressure.
    pub moment_radius: f64,
    /// Pressures.
    pub rings: Vec<Ring>,
    /// Products with the stiffness that the solver needed.
    pub products: usize,
}

/// Presses a sphere of 10 m to `depth` (m) on a quarter of a block so large that it is nearly a half-space: its cells are
/// `spacing` (m) wide, so many from the middle on, then so many that grow by `growth` each.
pub fn half_space(
    depth: f64,
    spacing: f64,
    cells: [u32; 2],
    growth: f64,
    tolerance: f64,
) -> Result<HalfSpace, StudyError> {
    let a = hertz_radius(depth);
    let lines = growing_lines(spacing, cells, growth);
    let mut press = Press::quarter(&lines, 3.0 * a, spacing)?;
    let found = press.press(LARGE, depth, tolerance)?;
    Ok(HalfSpace {
        nodes: press.body.rest.len(),
        size: lines[lines.len() - 1] / a,
        // A quarter of the force and of the area.
        force: 4.0 * found.force / hertz_force(SOFT, LARGE, depth),
        contact_radius: 2.0 * found.contact_radius / a,
        moment_radius: moment_radius(press.contact.points()) / a,
        rings: press.rings(a, hertz_pressure(LARGE, depth)),
        products: found.report.steps[0].linear_iterations,
    })
}

impl Press {
    /// Mean pressures, as within a triangle the pressure follows the gap between chord and sphere, of a
    /// quarter of the contact in rings; `a` is Hertz's contact radius (m), `largest` his largest pressure (Pa). Points
    /// out of contact count with none.
    fn rings(&self, a: f64, largest: f64) -> Vec<Ring> {
        let ring = |inner: f64, outer: f64| {
            let points = self.contact.points().iter().filter(|point| {
                let r = point.position.truncate().length() / a;
                r >= inner && r < outer
            });
            let force: f64 = points.map(|p| p.area * p.pressure).sum();
            // The integral of sqrt(1 - r²) over a quarter of the ring.
            let part = |r: f64| -(1.0 - r.min(1.0).powi(2)).powf(1.5) * PI / 6.0;
            let area = 0.25 * PI * (outer * outer - inner * inner);
            Ring {
                radii: [inner, outer],
                pressure: force / (largest * area * a * a),
                expected: (part(outer) - part(inner)) / area,
            }
        };
        let ends = [0.0, 0.3, 0.55, 0.8, 1.0, 1.25];
        ends.windows(2).map(|ends| ring(ends[0], ends[1])).collect()
    }
}
