//! A rigid sphere pressed into a block: `phyxel-integrate`'s contact and static solver on
//! `phyxel-elastic`'s forces, against finite elements of the same block, and against Hertz.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    reason = "helpers of tests fail by panicking, print what was measured, and count in small numbers"
)]

use crate::integrate_bodies::{Body, Solid, lattice};
use glam::DVec3;
use phyxel_integrate::{
    Contact, ContactSettings, ContactSurface, NewtonSettings, Pose, Pressed, Shape, StaticLoad,
    StaticReport, Supports, penalty, solve_static,
};

const SOFT: Solid = Solid {
    youngs_modulus: 1.0,
    poissons_ratio: 0.3,
    density: 1.0,
};

/// Finite element forces for radius and depth (m) at E = 1 Pa: 2 m cube, sides and bottom fixed,
/// second order elements, 37,975 nodes, small strain, tolerance 0.2 %.
const REFERENCE: [(f64, f64, f64); 3] = [
    (1.0, 0.05, 0.019_176_5),
    (1.0, 0.1, 0.058_265_6),
    (0.5, 0.05, 0.012_810_1),
];

/// The reference is at small strain. Depth times this and radius over this leave the contact radius
/// and the ratio to Hertz as they are and make the strain small.
const SMALL: f64 = 0.01;

/// Half-space force of a sphere over that of Hertz's paraboloid, 4/3 E* sqrt(r) d^1.5 (Sneddon 1965:
/// d = a/2 ln((r+a)/(r-a)), F = E* ((r² + a²)/2 ln((r+a)/(r-a)) - a r)).
fn sphere_over_paraboloid(radius: f64, depth: f64) -> f64 {
    let (mut low, mut high) = (0.0, 0.999 * radius);
    for _ in 0..60 {
        let a = 0.5 * (low + high);
        let logarithm = ((radius + a) / (radius - a)).ln();
        if 0.5 * a * logarithm < depth {
            low = a;
        } else {
            high = a;
        }
    }
    let logarithm = ((radius + low) / (radius - low)).ln();
    let force = 0.5 * (radius * radius + low * low) * logarithm - low * radius;
    force / (4.0 / 3.0 * radius.sqrt() * depth.powf(1.5))
}

/// A block `[-half, half]² × [-depth, 0]` with sides and bottom held, and the contact of its top.
struct Press {
    body: Body,
    supports: Supports,
    contact: Contact,
}

struct Pressing {
    force: f64,
    contact_radius: f64,
    report: StaticReport,
}

impl Press {
    fn new(body: Body, half: f64, depth: f64, spacing: f64) -> Self {
        let edge = 1e-9 * half;
        let held = body
            .nodes(|x| x.x.abs() > half - edge || x.y.abs() > half - edge || x.z < edge - depth);
        let supports = Supports::fixed(body.rest.len(), &held);
        let top = body.faces(|x| x.z > -edge);
        let surface = ContactSurface::from_triangles(&top, &body.rest, 6).unwrap();
        let settings = ContactSettings::new(penalty(1.0, spacing));
        Self {
            body,
            supports,
            contact: Contact::new(surface, settings),
        }
    }

    fn press(&mut self, radius: f64, depth: f64) -> Pressing {
        let found = self.press_unchecked(radius, depth);
        let reaction: DVec3 = found.report.reactions.iter().map(|(_, f)| *f).sum();
        // What acts on the tool is carried by the supports.
        assert!(
            (reaction.z - found.force).abs() < 1e-8 * found.force,
            "{reaction}"
        );
        found
    }

    fn press_unchecked(&mut self, radius: f64, depth: f64) -> Pressing {
        let shape = Shape::Sphere { radius };
        let pose = Pose::at(DVec3::Z * (radius - depth));
        let mut x = self.body.rest.clone();
        let mut law = Pressed::new(&mut self.body, &mut self.contact, shape, pose);
        let settings = NewtonSettings {
            tolerance: 1e-10,
            ..NewtonSettings::default()
        };
        let load = StaticLoad::default();
        let report = solve_static(&mut law, &mut x, &self.supports, &load, &settings).unwrap();
        let sum = law.tool_forces[0];
        assert!(report.steps[0].relative_residual() < 1e-10, "{report:?}");
        Pressing {
            force: sum.force.z,
            contact_radius: (sum.area / std::f64::consts::PI).sqrt(),
            report,
        }
    }

    /// Relative errors against the reference.
    fn errors(&mut self, name: &str) -> Vec<f64> {
        let mut errors = Vec::new();
        for (radius, depth, reference) in REFERENCE {
            let found = self.press(radius / SMALL, depth * SMALL);
            let expected = reference * SMALL / sphere_over_paraboloid(radius, depth);
            let error = found.force / expected - 1.0;
            let last = found.report.steps.last().unwrap();
            println!(
                "{name}: r {radius} d {depth}: {:+.2} %, contact radius {:.3}, {} iterations, {} products",
                100.0 * error,
                found.contact_radius,
                last.residuals.len() - 1,
                last.linear_iterations
            );
            errors.push(error);
        }
        errors
    }
}

fn cube(cells: u32) -> Press {
    let low = DVec3::new(-1.0, -1.0, -2.0);
    let body = Body::block([cells; 3], low, DVec3::new(1.0, 1.0, 0.0), SOFT, 0.1);
    Press::new(body, 1.0, 2.0, 2.0 / f64::from(cells))
}

/// Nodes drawn towards the middle of the top: `s -> 0.45 s + 0.55 s³` along each axis.
fn graded(cells: [u32; 3]) -> Press {
    let grade = |s: f64| 0.45 * s + 0.55 * s * s * s;
    let (nodes, tetrahedra) = lattice(cells, |s| {
        let across = |s: f64| grade(2.0 * s - 1.0);
        DVec3::new(across(s.x), across(s.y), -2.0 * grade(1.0 - s.z))
    });
    let body = Body::new(&nodes, &tetrahedra, SOFT, 0.1);
    Press::new(body, 1.0, 2.0, 0.45 * 2.0 / f64::from(cells[0]))
}

#[test]
fn block_indentation_meets_finite_elements() {
    let within = |errors: &[f64], bound: f64| errors.iter().all(|e| e.abs() < bound);
    let errors = cube(14).errors("3375 nodes");
    assert!(within(&errors, 0.05), "{errors:?}");
    let errors = cube(17).errors("5832 nodes");
    assert!(within(&errors, 0.03), "{errors:?}");
    for cells in [[10, 10, 10], [10, 10, 12], [11, 11, 11]] {
        let mut press = graded(cells);
        let errors = press.errors(&format!("{} graded nodes", press.body.rest.len()));
        assert!(within(&errors, 0.03), "{errors:?}");
    }
}

/// A quarter of a block of some 60 contact radii, between two symmetry planes.
#[test]
fn hertz_on_a_quarter_of_a_large_block() {
    let (radius, depth): (f64, f64) = (10.0, 0.0025);
    let a = (radius * depth).sqrt();
    // Eight cells of 0.18 contact radii, then eight growing by 1.8.
    let mut lines = vec![0.0];
    let (mut h, mut x) = (0.18 * a, 0.0);
    for cell in 0..16 {
        if cell >= 8 {
            h *= 1.8;
        }
        x += h;
        lines.push(x);
    }
    let size = x;
    let at = |s: f64| lines[(s * 16.0).round() as usize];
    let (nodes, tetrahedra) = lattice([16; 3], |s| DVec3::new(at(s.x), at(s.y), -at(1.0 - s.z)));
    let body = Body::new(&nodes, &tetrahedra, SOFT, 0.1);
    let edge = 1e-9 * a;
    let mut supports = Supports::free(body.rest.len());
    for node in body.nodes(|x| x.x < edge) {
        supports.slide(node, DVec3::X);
    }
    for node in body.nodes(|x| x.y < edge) {
        supports.slide(node, DVec3::Y);
    }
    for node in body.nodes(|x| x.x.max(x.y).max(-x.z) > size - edge) {
        supports.fix(node);
    }
    let near = body.faces(|x| x.z > -edge && x.x < 3.0 * a && x.y < 3.0 * a);
    let surface = ContactSurface::from_triangles(&near, &body.rest, 6).unwrap();
    let settings = ContactSettings::new(penalty(1.0, 0.18 * a));
    let mut press = Press {
        body,
        supports,
        contact: Contact::new(surface, settings),
    };
    let found = press.press_unchecked(radius, depth);
    let hertz = 0.25 * 4.0 / 3.0 / (1.0 - 0.09) * radius.sqrt() * depth.powf(1.5);
    let error = found.force / hertz - 1.0;
    let contact_radius = 2.0 * found.contact_radius;
    println!(
        "{} nodes, block of {:.0} contact radii: force {:+.2} % of Hertz, radius {:+.2} %, {} products",
        nodes.len(),
        size / a,
        100.0 * error,
        100.0 * (contact_radius / a - 1.0),
        found.report.steps[0].linear_iterations
    );
    assert!(error.abs() < 0.05, "{error}");
    // Hertz's profile p0 sqrt(1 - (r/a)²), p0 = 2 E* sqrt(d/R)/π, inside 0.8 a.
    let largest = 2.0 / std::f64::consts::PI / (1.0 - 0.09) * (depth / radius).sqrt();
    // Means over rings: within a triangle the pressure follows the gap between chord and sphere.
    let mut rings = [[0.0_f64; 3]; 3];
    for point in press.contact.points() {
        let r = point.position.truncate().length() / a;
        let ring = [0.3, 0.55, 0.8].iter().position(|end| r < *end);
        if let Some(ring) = ring {
            rings[ring][0] += point.area * point.pressure / largest;
            rings[ring][1] += point.area * (1.0 - r * r).sqrt();
            rings[ring][2] += point.area;
        }
    }
    let expected = [0.3, 0.55, 0.8].map(|end: f64| std::f64::consts::PI * end * end / 4.0 * a * a);
    let mut inner = 0.0;
    for (ring, outer) in rings.iter().zip(expected) {
        // Points out of contact count with no pressure.
        let share = ring[2] / (outer - inner);
        inner = outer;
        let error = ring[0] / ring[1] * share - 1.0;
        println!(
            "ring: mean pressure {:+.1} % of Hertz's, {share:.2} in contact",
            100.0 * error
        );
        assert!(error.abs() < 0.15, "{rings:?}");
    }
}
