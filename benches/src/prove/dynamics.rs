//! `phyxel-integrate` moving `phyxel-elastic` bodies: waves in a bar, energy over many steps, a dropped sphere.
use super::Proof;
use crate::problems::model::ElasticBody as Body;
use crate::problems::solid::Solid;
use glam::DVec3;
use phyxel_integrate::{
    BoundaryConditions, Contact, ContactSettings, ContactSurface, Drive, EigenvalueSettings,
    ForceLaw, Motion, MotionSettings, Pose, RigidShape, RigidTool, StepView, penalty,
};
use testkit::derivative::observed_order;

const SOFT: Solid = Solid {
    youngs_modulus: 1e4,
    poissons_ratio: 0.3,
    density: 1000.0,
};

/// A bar of 1 m along x without lateral contraction (ν = 0), held at x = 0, and its first standing
/// wave: `u = A sin(π x / 2L) cos(ω t)`, `ω = π/(2 L) sqrt(E/ρ)`.
fn bar(cells: u32) -> (Body, BoundaryConditions, f64) {
    let solid = Solid {
        poissons_ratio: 0.0,
        ..SOFT
    };
    let width = 2.0 / f64::from(cells);
    let high = DVec3::new(1.0, width, width);
    let body = Body::block([cells, 2, 2], DVec3::ZERO, high, solid, 0.1).unwrap();
    let supports = BoundaryConditions::fixed_where(&body.rest, |x| x.x < 1e-9);
    let omega = 0.5 * std::f64::consts::PI * (1e4_f64 / 1000.0).sqrt();
    (body, supports, omega)
}

fn plucked(body: &Body, amplitude: f64) -> Vec<DVec3> {
    let wave = |x: f64| amplitude * (0.5 * std::f64::consts::PI * x).sin();
    let moved = body.rest.iter().map(|x| *x + DVec3::X * wave(x.x));
    moved.collect()
}

/// Fraction of the wave's shape in the displacement after `time` (s) and 400 steps, over the amplitude.
fn wave_after(body: &mut Body, supports: &BoundaryConditions, time: f64) -> f64 {
    let amplitude = 1e-4;
    let settings = MotionSettings::default();
    let mut motion = Motion::new(&body.rest, &body.masses, supports.clone(), settings).unwrap();
    motion.set_positions(&plucked(body, amplitude)).unwrap();
    motion
        .advance_to(time, time / 400.0, |x, f| body.forces_into(x, f))
        .unwrap();
    let (mut sum, mut norm) = (0.0, 0.0);
    for ((x, rest), mass) in motion.positions().iter().zip(&body.rest).zip(&body.masses) {
        let shape = (0.5 * std::f64::consts::PI * rest.x).sin();
        sum += mass * (*x - *rest).x * shape;
        norm += mass * shape * shape;
    }
    sum / (norm * amplitude)
}

pub(super) fn wave(proof: &mut Proof) {
    // u(L) = A cos(omega t); a phase error d omega shows as its sine at a quarter period.
    let mut errors = Vec::new();
    for cells in [6, 12, 24] {
        let (mut body, supports, omega) = bar(cells);
        let quarter = 0.5 * std::f64::consts::PI / omega;
        let error = wave_after(&mut body, &supports, quarter).abs();
        errors.push(error);
    }
    proof.below("phase error, 24 cells", errors[2], 2e-3);
    let order = observed_order(errors[0], errors[2], 4.0);
    proof.above("order in space", order, 1.7);
}

fn small_beam() -> (Body, BoundaryConditions) {
    let body = Body::block([8, 2, 2], DVec3::ZERO, DVec3::new(0.4, 0.1, 0.1), SOFT, 0.1).unwrap();
    let supports = BoundaryConditions::fixed_where(&body.rest, |x| x.x < 1e-9);
    (body, supports)
}

pub(super) fn energy(proof: &mut Proof) {
    let (mut body, supports) = small_beam();
    let found = body.eigenvalue(&supports, &EigenvalueSettings::default());
    let critical = found.unwrap().critical_step;
    let settings = MotionSettings::default();
    let mut motion = Motion::new(&body.rest, &body.masses, supports, settings).unwrap();
    // First bending shape, a tenth of the length at the tip's speed scale.
    let bending = |x: &DVec3| DVec3::Z * (0.4 * (x.x / 0.4).powi(2));
    let v: Vec<DVec3> = body.rest.iter().map(bending).collect();
    motion.set_velocities(&v).unwrap();
    let initial = motion.audit().kinetic;
    let step = 0.5 * critical;
    let (mut largest, mut sums) = (0.0_f64, [0.0; 4]);
    let steps = 100_000_u32;
    for k in 0..steps {
        motion.step(step, |x, f| body.forces_into(x, f)).unwrap();
        // With the velocities at whole steps: what staggered ones conserve, K + U - Δt²/8 Σ f²/m, is of a
        // mode (1 + (ω Δt)²/6) times less than the shadow energy, and falls while a bending beam hands its
        // energy on to stiffer modes.
        let audit = motion.audit();
        let balance = (audit.energy_error() + audit.staggered) / initial;
        largest = largest.max(balance.abs());
        // Least squares line through (share of the run, balance).
        let t = f64::from(k) / f64::from(steps);
        for (sum, value) in sums.iter_mut().zip([t, balance, t * t, t * balance]) {
            *sum += value / f64::from(steps);
        }
    }
    let slope = (sums[3] - sums[0] * sums[1]) / (sums[2] - sums[0] * sums[0]);
    proof.below("largest deviation of the energy", largest, 2e-3);
    proof.below("its slope over the run", slope.abs(), 1e-4);
}

pub(super) fn dropped_sphere(proof: &mut Proof) {
    let low = DVec3::new(-0.1, -0.1, -0.1);
    let mut body = Body::block([8, 8, 4], low, DVec3::new(0.1, 0.1, 0.0), SOFT, 0.1).unwrap();
    let supports = BoundaryConditions::fixed_where(&body.rest, |x| x.z < -0.1 + 1e-9);
    let found = body.eigenvalue(&supports, &EigenvalueSettings::default());
    let critical = found.unwrap().critical_step;
    let top = body.faces(|x| x.z > -1e-9);
    let surface = ContactSurface::from_triangles(&top, &body.rest, 4).unwrap();
    let settings = ContactSettings {
        implicit: false,
        ..ContactSettings::new(penalty(1e4, 0.025))
    };
    let contact = Contact::new(surface, settings);
    let (mass, weight) = (0.3, DVec3::new(0.0, 0.0, -0.3 * 9.81));
    let drive = Drive::Force {
        mass,
        force: weight,
        damping: 0.0,
    };
    let pose = Pose::at(DVec3::new(0.003, 0.002, 0.05));
    let mut tool = RigidTool::new(RigidShape::Sphere { radius: 0.04 }, pose, drive, contact);
    tool.velocity = DVec3::new(0.0, 0.0, -0.5);
    let initial = tool.kinetic();
    let settings = MotionSettings::default();
    let mut motion = Motion::new(&body.rest, &body.masses, supports, settings).unwrap();
    let step = 0.25 * critical;
    let (mut lowest, mut worst, mut given) = (1.0_f64, 0.0_f64, 0.0_f64);
    while motion.time() < 0.3 {
        let press = &mut |view: &StepView<'_>, f: &mut [DVec3]| tool.press(view, f);
        motion
            .step_with(step, |x, f| body.forces_into(x, f), press)
            .unwrap();
        let audit = motion.audit();
        // Sphere, contact and block together against what gravity gave.
        let total = audit.kinetic + audit.elastic + tool.kinetic() + tool.load.energy;
        worst = worst.max((total - initial - tool.load_work).abs());
        given = given.max(initial + tool.load_work);
        lowest = lowest.min(tool.pose.position.z);
    }
    proof.below("lowest place", lowest, 0.035);
    proof.above("it came back", tool.pose.position.z, lowest + 0.003);
    proof.below("audit off", worst, 0.01 * given);
}
