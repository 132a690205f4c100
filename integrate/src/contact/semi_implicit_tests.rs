use super::*;
use crate::law::ForceLaw;
use crate::motion::{Motion, MotionSettings};
use crate::supports::BoundaryConditions;
use crate::testing::{Network, damped, patch};
use crate::tool::{Drive, RigidTool};
use crate::trajectory::{Ease, Trajectory};
use glam::DQuat;
use proptest::prelude::*;
use testkit::cloud::{Random, uniform};

fn contact(penalty: f64, friction: f64) -> (Contact, Vec<DVec3>) {
    crate::testing::contact(3, penalty, friction)
}

/// A net between fixed corners, a ball driven or thrown at it.
struct Net {
    law: Network,
    motion: Motion,
    tool: RigidTool,
    limit: f64,
}

impl Net {
    fn new(penalty: f64, friction: f64, drive: Drive) -> Self {
        let (contact, rest) = contact(penalty, friction);
        let mut law = Network::complete(&rest, 30.0);
        let supports = BoundaryConditions::fixed(9, &[0, 2, 6, 8]);
        let settings = MotionSettings::default();
        let masses = [1.0; 9];
        let motion = Motion::new(&rest, &masses, supports.clone(), settings).unwrap();
        law.forces_into(&rest, &mut vec![DVec3::ZERO; 9]);
        let product = |v: &[DVec3], out: &mut [DVec3]| law.tangent_product_into(v, out);
        let settings = crate::EigenvalueSettings::default();
        let found =
            crate::largest_eigenvalue(&masses, &supports, product, &mut Vec::new(), &settings);
        let pose = Pose::at(DVec3::new(1.1, 0.9, 0.65));
        Self {
            law,
            motion,
            tool: RigidTool::new(RigidShape::Sphere { radius: 0.6 }, pose, drive, contact),
            limit: found.unwrap().critical_step,
        }
    }

    fn advance(&mut self, time: f64, step: f64) -> Result<(), crate::StepError> {
        let (law, tool) = (&mut self.law, &mut self.tool);
        let press = &mut |view: &StepView<'_>, f: &mut [DVec3]| tool.press(view, f);
        self.motion
            .advance_with(time, step, |x, f| law.forces_into(x, f), press)
    }
}

fn pressing() -> Drive {
    Drive::Path {
        origin: Pose::at(DVec3::new(1.1, 0.9, 0.65)),
        path: Trajectory::ramp(0.0, 2.0, DVec3::new(0.1, 0.0, -0.15)).unwrap(),
    }
}

fn thrown(mass: f64) -> Drive {
    Drive::Force {
        mass,
        force: DVec3::ZERO,
        damping: 0.0,
    }
}

/// The equation that defines the forces, with the forces of a plain evaluation where it puts the nodes.
fn check_defining_equation(contact: &mut Contact, shape: &RigidShape, pose: &Pose, seed: u64) {
    let x = patch().0;
    let mut random = Random::new(seed);
    let x: Vec<DVec3> = x.iter().map(|x| *x + random.vector(0.1)).collect();
    let v: Vec<DVec3> = x.iter().map(|_| random.vector(1.0)).collect();
    let internal: Vec<DVec3> = x.iter().map(|_| random.vector(5.0)).collect();
    let masses: Vec<f64> = x.iter().map(|_| random.range(0.5, 2.0)).collect();
    let mut supports = BoundaryConditions::free(9);
    supports.fix(0);
    supports.slide(4, DVec3::new(1.0, 1.0, 0.0));
    let nodes = crate::nodes::NodeConstants::new(&masses, supports);
    let step = 0.05;
    let view = StepView {
        time: 0.0,
        step,
        positions: &x,
        velocities: &v,
        acting: crate::view::NodeForces {
            nodes: &nodes,
            gravity: DVec3::NEG_Z,
            forces: &internal,
            before: &[],
            viscosity: 0.0,
        },
    };
    let mut f = vec![DVec3::ZERO; 9];
    let sum = contact.press_semi_implicit(shape, pose, None, &view, &mut f);
    let z: Vec<DVec3> = (0..9)
        .map(|i| {
            let a = view.acceleration(i) + view.free(i) * (f[i] / masses[i]);
            x[i] + (v[i] + a * step) * (0.5 * step)
        })
        .collect();
    let mut brute = vec![DVec3::ZERO; 9];
    let plain = contact.clone().add_forces(shape, pose, &z, &mut brute);
    let scale = sum.force.length().max(1e-3);
    assert!(
        (plain.force - sum.force).length() < 2e-3 * scale,
        "{plain:?} {sum:?}"
    );
    for (a, b) in f.iter().zip(&brute) {
        assert!((*a - *b).length() < 2e-3 * scale, "{a} {b} of {scale}");
    }
    let total: DVec3 = f.iter().sum();
    assert!((total + sum.force).length() < 1e-11 * scale, "balance");
    // From where this one ended the same is found, and what is left is forgotten.
    if contact.settings.friction == 0.0 {
        let again = contact.press_semi_implicit(shape, pose, None, &view, &mut f);
        let change = (again.force - sum.force).length();
        assert!(change < 2e-3 * scale, "{again:?} {sum:?}");
    }
    let away = Pose::at(DVec3::Z * 100.0);
    contact.press_semi_implicit(shape, &away, None, &view, &mut f);
    assert!(contact.pushed.is_empty(), "nothing touches");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn forces_are_those_of_a_plain_evaluation_half_a_step_ahead(
        seed in 0_u64..10_000,
        penalty in 1.0_f64..5.0,
    ) {
        let (mut contact, _) = contact(10_f64.powf(penalty), 0.0);
        let mut random = Random::new(seed + 77);
        let pose = Pose::at(DVec3::new(1.0, 1.0, 0.9) + random.vector(0.2));
        let shape = if seed % 2 == 0 {
            RigidShape::Sphere { radius: 0.95 }
        } else {
            RigidShape::Capsule { from: DVec3::Z * -0.4, to: DVec3::Z * 0.4, radius: 0.6 }
        };
        check_defining_equation(&mut contact, &shape, &pose, seed);
        for point in contact.points() {
            prop_assert!(point.pressure > 0.0);
        }
    }
}

#[test]
fn any_penalty_is_stable_near_the_critical_step_of_the_body() {
    for penalty in [1e2, 1e4, 1e6] {
        let mut net = Net::new(penalty, 0.0, pressing());
        let step = 0.8 * net.limit;
        let mut largest = 0.0_f64;
        while net.motion.time() < 6.0 {
            net.advance(net.motion.time() + step, step).unwrap();
            largest = largest.max(net.tool.load.force.z);
        }
        let given = -net.tool.contact_work;
        let audit = net.motion.audit();
        let held = audit.kinetic + audit.elastic;
        assert!(largest > 0.1, "{largest}");
        // A coarse step: what it does not resolve of the contact is damped, nothing is made.
        assert!(held < 1.1 * given, "{penalty}: {held} of {given}");
    }
    // The same with forces from where the nodes are does not hold.
    let mut net = Net::new(1e4, 0.0, pressing());
    net.tool.contact.settings.implicit = false;
    let step = 0.8 * net.limit;
    let ran = net.advance(6.0, step);
    let audit = net.motion.audit();
    assert!(ran.is_err() || audit.kinetic > 1.0, "{audit:?}");
}

#[test]
fn agrees_with_fine_plain_steps() {
    let mut fine = Net::new(200.0, 0.0, pressing());
    fine.tool.contact.settings.implicit = false;
    fine.advance(3.0, 2e-4).unwrap();
    let mut errors = Vec::new();
    for step in [0.02, 0.01, 0.005] {
        let mut net = Net::new(200.0, 0.0, pressing());
        net.advance(3.0, step).unwrap();
        let pairs = net.motion.positions().iter().zip(fine.motion.positions());
        errors.push(pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max));
    }
    assert!(
        errors[2] < 4e-3 && errors[2] < 0.6 * errors[1],
        "{errors:?}"
    );
}

#[test]
fn a_thrown_ball_keeps_the_momentum_whatever_its_mass() {
    for mass in [0.05, 3.0] {
        let mut net = Net::new(1e5, 0.0, thrown(mass));
        net.motion.set_supports(BoundaryConditions::free(9));
        net.tool.velocity = DVec3::new(0.1, 0.0, -1.0);
        let start = net.tool.velocity * mass;
        let before = net.tool.kinetic();
        let mut touched = 0.0_f64;
        for k in 1..300_u32 {
            let step = 0.5 * net.limit;
            net.advance(f64::from(k) * step, step).unwrap();
            touched = touched.max(net.tool.load.force.length());
        }
        assert!(touched > 0.1, "they met");
        let momentum = net.motion.audit().momentum + net.tool.velocity * mass;
        assert!((momentum - start).length() < 1e-12, "{momentum} {start}");
        let audit = net.motion.audit();
        let after = audit.kinetic + audit.elastic + net.tool.kinetic();
        assert!(after < 1.001 * before, "{after} of {before}");
    }
}

#[test]
fn a_turning_plate_drags_the_net_by_friction_and_its_work_arrives() {
    let (contact, rest) = contact(300.0, 0.5);
    let mut law = Network::complete(&rest, 30.0);
    let supports = BoundaryConditions::fixed(9, &[0, 2, 6, 8]);
    let settings = damped(8.0);
    let mut motion = Motion::new(&rest, &[1.0; 9], supports, settings).unwrap();
    let down = Pose::at(DVec3::Z * -0.15);
    let turned = Pose {
        rotation: DQuat::from_rotation_z(0.4),
        ..down
    };
    let keys = [(0.0, Pose::IDENTITY), (0.5, down), (2.0, turned)];
    let drive = Drive::Path {
        origin: Pose::at(DVec3::new(1.0, 1.0, 0.25)),
        path: Trajectory::new(&keys, Ease::Smooth).unwrap(),
    };
    let size = DVec3::new(1.4, 1.4, 0.4);
    let pose = Pose::at(DVec3::new(1.0, 1.0, 0.25));
    let mut tool = RigidTool::new(RigidShape::Box { size }, pose, drive, contact);
    let press = &mut |view: &StepView<'_>, f: &mut [DVec3]| tool.press(view, f);
    let forces = |x: &[DVec3], f: &mut [DVec3]| law.forces_into(x, f);
    motion.advance_with(1.2, 1e-3, forces, press).unwrap();
    assert!(tool.angular_velocity.z > 0.1, "{:?}", tool.angular_velocity);
    assert!(
        tool.load.torque.z < -0.01,
        "the net holds on: {:?}",
        tool.load
    );
    let given = -tool.contact_work;
    let audit = motion.audit();
    let left = given - audit.applied_work - tool.load.energy;
    // What is left was rubbed off.
    assert!(
        left > -1e-3 * given && left < 0.5 * given,
        "{left} of {given}"
    );
}

#[test]
fn restored_between_steps_to_the_same_bits() {
    let mut net = Net::new(1e4, 0.3, pressing());
    let step = 0.7 * net.limit;
    net.advance(1.5, step).unwrap();
    let kept = net.motion.state().clone();
    // A contact as serialisation gives it back: without scratch.
    let mut bare = net.tool.clone();
    bare.contact.semi_implicit = SemiImplicit::default();
    bare.contact.active.clear();
    net.advance(2.5, step).unwrap();
    let (x, force) = (net.motion.positions().to_vec(), net.tool.load);
    net.motion.restore(kept);
    net.tool = bare;
    net.advance(2.5, step).unwrap();
    assert_eq!(net.motion.positions(), x, "positions");
    assert_eq!(net.tool.load, force, "forces");
}

#[test]
fn far_away_nothing_happens() {
    let (contact, x) = contact(1e3, 0.0);
    let v = uniform(9, 0.1, 3);
    let mut motion = Motion::new(
        &x,
        &[1.0; 9],
        BoundaryConditions::free(9),
        MotionSettings::default(),
    )
    .unwrap();
    motion.set_velocities(&v).unwrap();
    let path = Trajectory::ramp(0.0, 1.0, DVec3::X).unwrap();
    let origin = Pose::at(DVec3::Z * 5.0);
    let mut tool = RigidTool::on_path(RigidShape::Sphere { radius: 1.0 }, origin, path, contact);
    let press = &mut |view: &StepView<'_>, f: &mut [DVec3]| tool.press(view, f);
    motion.advance_with(1.0, 0.1, |_, _| 0.0, press).unwrap();
    assert_eq!(tool.load, ContactForce::default(), "no force");
    assert_eq!(motion.velocities(), v, "no change");
}
