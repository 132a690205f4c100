use super::*;
use crate::law::ForceLaw;
use crate::motion::{Motion, MotionSettings};
use crate::supports::BoundaryConditions;
use crate::testing::{Network, plate};
use crate::tool::{Drive, RigidTool};
use crate::trajectory::Trajectory;
use crate::view::StepView;
use glam::DQuat;
use proptest::prelude::*;
use testkit::cloud::{Random, uniform};
use testkit::derivative::directional_error;

const FLOOR: RigidShape = RigidShape::Plane { normal: DVec3::Z };

fn contact(friction: f64) -> (Contact, Vec<DVec3>) {
    let (mut contact, x) = crate::testing::contact(4, 50.0, friction);
    contact.settings.implicit = false;
    (contact, x)
}

fn shapes() -> [RigidShape; 4] {
    [
        RigidShape::Sphere { radius: 1.2 },
        FLOOR,
        RigidShape::Capsule {
            from: DVec3::Z * -0.5,
            to: DVec3::Z * 0.5,
            radius: 0.8,
        },
        RigidShape::Box {
            size: DVec3::new(1.4, 1.8, 1.2),
        },
    ]
}

fn random_case(seed: u64) -> (Contact, Vec<DVec3>, RigidShape, Pose) {
    let mut random = Random::new(seed);
    let (mut contact, x) = contact(0.0);
    let x: Vec<DVec3> = x.iter().map(|x| *x + random.vector(0.2)).collect();
    let triangles = contact.surface.group_count();
    let bulges: Vec<[f64; 3]> = (0..triangles)
        .map(|_| random.vector(0.1).to_array())
        .collect();
    contact.surface = contact.surface.raised(&bulges);
    let shape = shapes()[usize::try_from(seed % 4).unwrap()];
    let axis = random.vector(1.0).normalize();
    let rotation = DQuat::from_axis_angle(axis, random.range(0.0, 3.0));
    let position = DVec3::new(1.0, 1.0, 0.5) + random.vector(0.4);
    (contact, x, shape, Pose { position, rotation })
}

#[test]
fn pressure_on_a_flat_punch_is_exact() {
    let (mut contact, x) = contact(0.0);
    let mut f = vec![DVec3::ZERO; 9];
    let sum = contact.add_forces(&FLOOR, &plate(0.0), &x, &mut f);
    assert!(
        (sum.force - DVec3::Z * (4.0 * 50.0 * 0.1)).length() < 1e-12,
        "{sum:?}"
    );
    assert!(
        (sum.energy - 0.5 * 4.0 * 50.0 * 0.01).abs() < 1e-12,
        "{sum:?}"
    );
    assert!((sum.area - 4.0).abs() < 1e-12, "whole area");
    // A third of each adjacent triangle: the middle node has six of area 1/2.
    assert!((f[4].z + 50.0 * 0.1).abs() < 1e-12, "{}", f[4]);
    let pressures = contact.pressures(9);
    let even = pressures.iter().all(|p| (p - 50.0 * 0.1).abs() < 1e-12);
    assert!(even, "{pressures:?}");
    assert!((penalty(2.0, 0.5) - 160.0).abs() < 1e-12, "40 E / h");
}

/// A parabola in front of a triangle touches a plane as far from it as it is high there.
#[test]
fn a_raised_triangle_is_a_parabola() {
    let x = [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y];
    let height = |x: DVec3| 0.3 * x.x * (2.0 - x.x - 2.0 * x.y) - 0.1 * x.x * x.y;
    let middles = [DVec3::X, DVec3::new(1.0, 0.5, 0.0), DVec3::Y * 0.5];
    let flat = ContactSurface::from_triangles(&[[0, 1, 2]], &x, 6).unwrap();
    let surface = flat.raised(&[middles.map(height)]);
    let mut contact = Contact::new(surface, ContactSettings::new(1.0));
    for level in [0.25, 0.1, 0.0, -0.02] {
        let pose = Pose {
            position: DVec3::Z * level,
            rotation: DQuat::from_rotation_x(std::f64::consts::PI),
        };
        let mut forces = [DVec3::ZERO; 3];
        let sum = contact.add_forces(&FLOOR, &pose, &x, &mut forces);
        let mut deepest = 0.0_f64;
        for point in &contact.active {
            let depth = height(point.position) - level;
            assert!((point.pressure - depth).abs() < 1e-12 && depth > 0.0);
            deepest = deepest.max(depth);
        }
        // The plane is below the highest point, so all of the triangle is as near.
        assert!((sum.area - 1.0).abs() < 1e-12, "{level}: {sum:?}");
        assert!((sum.penetration - deepest).abs() < 1e-12, "{level}");
        let points = contact.surface.points(0).map(|point| {
            let bound = contact.surface.weights_of(0, point);
            bound.map(|(n, w)| x[n] * w).sum::<DVec3>()
        });
        let touching = points.filter(|x| height(*x) > level).count();
        assert_eq!(contact.active.len(), touching, "{level}");
    }
}

#[test]
fn culling_changes_nothing() {
    let mut clear = 0;
    for seed in 0..40 {
        let (mut culled, mut x, shape, pose) = random_case(seed);
        let mut brute = culled.clone();
        let mut random = Random::new(seed);
        // From far above the shape through it to far below.
        for k in 0..40_u32 {
            let lift = DVec3::Z * 3.0 * (0.08 * f64::from(k)).cos();
            x.iter_mut().for_each(|x| *x += random.vector(0.01));
            // In every other case the tool moves as far the other way.
            let sink = lift * (seed % 2) as f64;
            let x: Vec<DVec3> = x.iter().map(|x| *x + lift).collect();
            let position = pose.position - sink;
            let pose = Pose { position, ..pose };
            let mut forces = vec![DVec3::ZERO; 9];
            let sum = culled.add_forces(&shape, &pose, &x, &mut forces);
            let mut every = SemiImplicit::default();
            every.gather(&brute.surface, |node| x[node]);
            every.near = (0..brute.surface.group_count()).collect();
            let all = brute.evaluate(&shape, &pose, &mut every, None);
            assert_eq!(sum, all, "seed {seed}");
            assert_eq!(culled.active, brute.active);
            let mut members = brute.surface.members.iter().zip(&every.forces);
            let same = members.all(|(node, force)| forces[*node as usize] == *force);
            assert!(same, "seed {seed}: forces");
            clear += usize::from(culled.semi_implicit.near.is_empty());
        }
    }
    assert!(
        (400..1200).contains(&clear),
        "{clear} of 1600 with nothing near"
    );
}

#[test]
fn friction_sticks_below_the_limit_and_slides_at_it() {
    let (mut contact, x) = contact(0.4);
    let mut run = |shift: f64| {
        let pose = plate(shift);
        let mut f = vec![DVec3::ZERO; 9];
        let mut sum = contact.add_forces(&FLOOR, &pose, &x, &mut f);
        contact.add_friction((&FLOOR, &pose), &mut f, &mut sum);
        let total: DVec3 = f.iter().sum();
        assert!((total + sum.force).length() < 1e-12, "action and reaction");
        sum.force
    };
    let normal = 4.0 * 50.0 * 0.1;
    assert!(run(0.0).x.abs() < 1e-12, "first touch");
    let stuck = run(0.01);
    assert!(
        (stuck.x + 4.0 * 50.0 * 0.01).abs() < 1e-12,
        "stick: {stuck}"
    );
    let slid = run(1.0);
    assert!((slid.x + 0.4 * normal).abs() < 1e-12, "slide: {slid}");
    let back = run(1.0 - 0.04);
    assert!(
        back.x.abs() < 1e-12,
        "the spring is let go by as much as it was stretched: {back}"
    );
    assert!((back.z - normal).abs() < 1e-12, "normal force stays");
}

#[test]
fn tool_and_body_keep_their_momentum_and_energy() {
    let (contact, rest) = contact(0.0);
    let mut law = Network::complete(&rest, 30.0);
    let drive = Drive::Force {
        mass: 3.0,
        force: DVec3::ZERO,
        damping: 0.0,
    };
    let pose = Pose::at(DVec3::new(1.1, 0.9, 0.65));
    let mut tool = RigidTool::new(RigidShape::Sphere { radius: 0.6 }, pose, drive, contact);
    tool.velocity = DVec3::new(0.1, 0.0, -1.0);
    let start = tool.velocity * 3.0;
    let kinetic = tool.kinetic();
    let settings = MotionSettings::default();
    let mut motion = Motion::new(&rest, &[1.0; 9], BoundaryConditions::free(9), settings).unwrap();
    let mut touched = 0.0_f64;
    for _ in 0..1000 {
        let press = &mut |view: &StepView<'_>, f: &mut [DVec3]| tool.press(view, f);
        motion
            .step_with(2e-3, |x, f| law.forces_into(x, f), press)
            .unwrap();
        touched = touched.max(tool.load.force.length());
    }
    assert!(touched > 1.0, "they met");
    let momentum = motion.audit().momentum + tool.velocity * 3.0;
    assert!((momentum - start).length() < 1e-12, "{momentum} {start}");
    let audit = motion.audit();
    let total = audit.kinetic + audit.elastic + tool.kinetic() + tool.load.energy;
    assert!((total / kinetic - 1.0).abs() < 1e-4, "{total} {kinetic}");
    assert!(audit.energy_error().abs() < 1e-4 * kinetic, "{audit:?}");
    let tool_balance = tool.kinetic() - kinetic - tool.contact_work - tool.load_work;
    assert!(
        (tool_balance + tool.dissipated).abs() < 1e-4 * kinetic,
        "{tool:?}"
    );
}

#[test]
fn a_driven_tool_follows_its_path_and_its_work_arrives() {
    let (contact, rest) = contact(0.0);
    let mut law = Network::complete(&rest, 30.0);
    let path = Trajectory::ramp(0.0, 1.0, DVec3::new(0.0, 0.0, -0.5)).unwrap();
    let origin = DVec3::new(1.0, 1.0, 0.65);
    let shape = RigidShape::Capsule {
        from: DVec3::Z * -0.3,
        to: DVec3::Z * 0.3,
        radius: 0.3,
    };
    let mut tool = RigidTool::on_path(shape, Pose::at(origin), path, contact);
    let supports = BoundaryConditions::fixed(9, &[0, 2, 6, 8]);
    let settings = MotionSettings::default();
    let mut motion = Motion::new(&rest, &[1.0; 9], supports, settings).unwrap();
    let press = &mut |view: &StepView<'_>, f: &mut [DVec3]| tool.press(view, f);
    motion
        .advance_with(2.0, 2e-3, |x, f| law.forces_into(x, f), press)
        .unwrap();
    assert!(
        (tool.pose.position - origin + DVec3::Z * 0.5).length() < 1e-15,
        "path"
    );
    // What the tool gave is in the body or in the contact.
    let given = -tool.contact_work;
    let arrived = motion.audit().applied_work + tool.load.energy;
    assert!(
        given > 0.01 && (given - arrived).abs() < 1e-3 * given,
        "{given} {arrived}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn contact_never_pulls_and_balances(seed in 0_u64..10_000) {
        let (mut contact, x, shape, pose) = random_case(seed);
        let mut f = vec![DVec3::ZERO; 9];
        let sum = contact.add_forces(&shape, &pose, &x, &mut f);
        for point in contact.points() {
            prop_assert!(point.pressure > 0.0 && point.area > 0.0);
        }
        let total: DVec3 = f.iter().sum();
        prop_assert!((total + sum.force).length() < 1e-11);
        let moment: DVec3 =
            x.iter().zip(&f).map(|(x, f)| (*x - pose.position).cross(*f)).sum();
        prop_assert!((moment + sum.torque).length() < 1e-11);
    }

    #[test]
    fn forces_are_the_gradient_and_the_tangent_their_derivative(seed in 0_u64..10_000) {
        let (mut contact, x, shape, pose) = random_case(seed);
        // A box's inside has kinks where the nearest face changes.
        prop_assume!(!matches!(shape, RigidShape::Box { .. }));
        let d = uniform(9, 1.0, seed + 1);
        let at = |t: f64| -> Vec<DVec3> { x.iter().zip(&d).map(|(x, d)| *x + *d * t).collect() };
        let mut f = vec![DVec3::ZERO; 9];
        contact.add_forces(&shape, &pose, &x, &mut f);
        let mut kd = vec![DVec3::ZERO; 9];
        contact.add_tangent_product(&d, &mut kd);
        let mut blocks = vec![DMat3::ZERO; 9];
        contact.add_blocks(&mut blocks);
        let mut unit = vec![DVec3::ZERO; 9];
        unit[4] = DVec3::new(0.3, -0.2, 0.9);
        let mut column = vec![DVec3::ZERO; 9];
        contact.add_tangent_product(&unit, &mut column);
        prop_assert!((blocks[4] * unit[4] - column[4]).length() < 1e-10);
        let slope: f64 = f.iter().zip(&d).map(|(f, d)| f.dot(*d)).sum();
        let energy = |t: f64| {
            let mut f = vec![DVec3::ZERO; 9];
            contact.clone().add_forces(&shape, &pose, &at(t), &mut f).energy
        };
        prop_assert!(directional_error(energy, -slope, 1e-3, 1.0) < 1e-6);
        let second: f64 = kd.iter().zip(&d).map(|(k, d)| k.dot(*d)).sum();
        let force = |t: f64| {
            let mut f = vec![DVec3::ZERO; 9];
            contact.clone().add_forces(&shape, &pose, &at(t), &mut f);
            -f.iter().zip(&d).map(|(f, d)| f.dot(*d)).sum::<f64>()
        };
        // Points entering or leaving contact are kinks of the force: a small step avoids most.
        prop_assert!(directional_error(force, second, 1e-5, 1.0) < 1e-3);
    }
}
