use super::*;
use crate::contact::{Contact, ContactSettings, ContactSurface};
use crate::law::Differences;
use crate::motion::MotionSettings;
use crate::shape::{Pose, RigidShape};
use crate::supports::BoundaryConditions;
use crate::testing::{Chain, Network, damped, free, one_node, swung};
use crate::trajectory::Trajectory;
use proptest::prelude::*;
use testkit::cloud::uniform;
use testkit::derivative::observed_order;
use testkit::tol::assert_below;

const SCHEMES: [ImplicitScheme; 2] = [
    ImplicitScheme::EnergyMomentum,
    ImplicitScheme::BackwardEuler,
];

fn implicit(scheme: ImplicitScheme) -> Implicit {
    solved_to(1e-12, scheme)
}

fn solved_to(tolerance: f64, scheme: ImplicitScheme) -> Implicit {
    let newton = NewtonSettings::with_tolerance(tolerance);
    Implicit::new(ImplicitSettings { scheme, newton }).unwrap()
}

/// One mass on a spring of 9 N/m to its position, with damping; error at t = 2.
fn error_at_two(scheme: ImplicitScheme, damping: f64, steps: u32) -> f64 {
    let mut chain = Chain::new(1, 4.5, 1.0);
    let mut motion = one_node(damped(damping));
    let mut solver = implicit(scheme);
    for _ in 0..steps {
        solver
            .step(&mut motion, 2.0 / f64::from(steps), &mut chain)
            .unwrap();
    }
    (motion.positions()[0].x - swung(damping)).abs()
}

#[test]
fn orders_of_convergence_on_the_oscillator() {
    for (scheme, damping, order) in [
        (ImplicitScheme::EnergyMomentum, 0.0, 2.0),
        (ImplicitScheme::EnergyMomentum, 0.7, 2.0),
        (ImplicitScheme::BackwardEuler, 0.0, 1.0),
        (ImplicitScheme::BackwardEuler, 0.7, 1.0),
    ] {
        let errors = [400, 800, 1600].map(|steps| error_at_two(scheme, damping, steps));
        for pair in errors.windows(2) {
            let seen = observed_order(pair[0], pair[1], 2.0);
            assert!((seen - order).abs() < 0.1, "{scheme:?} {damping}: {seen}");
        }
    }
}

#[test]
fn agrees_with_explicit_steps_and_hands_over_to_them() {
    let rest = uniform(10, 1.0, 5);
    let mut network = Network::complete(&rest, 10.0);
    let mut supports = BoundaryConditions::fixed(10, &[0]);
    supports.slide(3, DVec3::new(1.0, 2.0, 0.0));
    let path = Trajectory::ramp(0.0, 0.8, DVec3::new(0.2, 0.0, 0.1)).unwrap();
    supports.drive(&[7], [true, true, true], path, &rest);
    let settings = MotionSettings {
        gravity: DVec3::new(0.0, 0.0, -1.0),
        damping: 0.2,
        ..MotionSettings::default()
    };
    let begin = Motion::new(&rest, &[1.0; 10], supports, settings).unwrap();
    let mut explicit = begin.clone();
    explicit
        .advance_to(1.0, 1e-3, |x, f| network.forces(x, f))
        .unwrap();
    let mut motion = begin;
    let mut solver = implicit(ImplicitScheme::EnergyMomentum);
    for _ in 0..250 {
        solver.step(&mut motion, 2e-3, &mut network).unwrap();
    }
    motion
        .advance_to(1.0, 1e-3, |x, f| network.forces(x, f))
        .unwrap();
    for (x, y) in explicit.positions().iter().zip(motion.positions()) {
        assert!((*x - *y).length() < 2e-4, "{x} {y}");
    }
    let scale = motion.audit().scale();
    let off = motion.audit().energy_error().abs();
    assert_below("energy", off, 1e-3 * scale);
}

#[test]
fn refuses_bad_settings_and_steps() {
    let newton = NewtonSettings::with_tolerance(0.0);
    let error = Implicit::new(ImplicitSettings {
        newton,
        ..ImplicitSettings::default()
    });
    let named = matches!(error, Err(MotionError::BadSetting { name, .. }) if name == "tolerance");
    assert!(named, "setting");
    let mut chain = Chain::new(1, 1.0, 1.0);
    let mut motion = one_node(MotionSettings::default());
    let error = implicit(ImplicitScheme::EnergyMomentum).step(&mut motion, -1.0, &mut chain);
    assert_eq!(error, Err(SolveError::BadStep { step: -1.0 }), "step");
}

fn spinning(seed: u64) -> (Network, Motion) {
    let rest = uniform(10, 1.0, seed);
    let network = Network::complete(&rest, 10.0);
    let mut motion = free(&rest, &[1.0; 10]);
    let velocities: Vec<DVec3> = rest
        .iter()
        .zip(uniform(10, 1.0, seed + 1))
        .map(|(x, v)| DVec3::new(0.4, -1.0, 2.0).cross(*x) + v + DVec3::X)
        .collect();
    motion.set_velocities(&velocities).unwrap();
    (network, motion)
}

#[test]
fn energy_and_momenta_of_a_spinning_network_stay() {
    let (mut network, mut motion) = spinning(5);
    let (momentum, turning) = (motion.audit().momentum, motion.angular_momentum());
    let mut solver = implicit(ImplicitScheme::EnergyMomentum);
    for _ in 0..100 {
        solver.step(&mut motion, 0.1, &mut network).unwrap();
    }
    let audit = motion.audit();
    let total = audit.kinetic + audit.elastic;
    assert!((total / audit.initial - 1.0).abs() < 1e-7, "{audit:?}");
    let off = (audit.momentum - momentum).length();
    assert_below("momentum", off, 1e-9 * momentum.length());
    let off = (motion.angular_momentum() - turning).length();
    assert!(off < 1e-8 * turning.length(), "{off}");
}

/// However little is solved, what nothing holds keeps its momentum, whatever presses on the piece beside it.
#[test]
fn a_free_piece_keeps_its_momentum_at_any_tolerance() {
    for scheme in SCHEMES {
        let (mut network, mut motion) = spinning(7);
        network.springs.retain(|(i, j, _)| i / 5 == j / 5);
        motion.set_pieces(&[0, 0, 0, 0, 0, 1, 1, 1, 1, 1]);
        let momentum = |motion: &Motion| motion.velocities()[..5].iter().sum::<DVec3>();
        let before = momentum(&motion);
        let mut solver = solved_to(0.1, scheme);
        let surface = ContactSurface::from_nodes(&[5, 6, 7, 8, 9], &[1.0; 5], 10).unwrap();
        let contact = Contact::new(surface, ContactSettings::new(10.0));
        let floor = RigidShape::Plane { normal: DVec3::Z };
        let mut floor = RigidTool::standing(floor, Pose::IDENTITY, contact);
        for step in 0..20 {
            solver
                .step_with(&mut motion, 0.1, &mut network, &mut [&mut floor])
                .unwrap();
            let touches = !floor.contact.points().is_empty();
            assert!(touches || step > 4, "{scheme:?}");
            let off = (momentum(&motion) - before).length();
            assert!(off < 1e-11 * before.length(), "{scheme:?}: {off}");
        }
        // What Newton left is taken from the piece that nothing touches alone.
        let x = motion.positions().to_vec();
        let mut balanced = x.clone();
        solver.balance(&motion, 1.0, &[false, true], &mut balanced);
        assert_ne!(x[..5], balanced[..5], "{scheme:?}");
        assert_eq!(x[5..], balanced[5..], "{scheme:?}");
    }
}

/// Three masses on springs, dropped by 2 cm on a floor; the most that the audit and a mass' height (m)
/// were off.
fn dropped(
    scheme: ImplicitScheme,
    friction: f64,
    law: &mut dyn ForceLaw,
    rest: &[DVec3],
) -> Motion {
    let settings = MotionSettings {
        gravity: DVec3::NEG_Z * 9.81,
        ..MotionSettings::default()
    };
    let surface = ContactSurface::from_nodes(&[0, 1, 2], &[1e-4; 3], 3).unwrap();
    let contact = ContactSettings {
        friction,
        ..ContactSettings::new(4e7)
    };
    let contact = Contact::new(surface, contact);
    let floor = RigidShape::Plane { normal: DVec3::Z };
    let mut floor = RigidTool::standing(floor, Pose::IDENTITY, contact);
    let mut motion = Motion::new(rest, &[0.01; 3], BoundaryConditions::free(3), settings).unwrap();
    motion
        .set_velocities(&[DVec3::X * (0.3 * f64::from(u8::from(friction > 0.0))); 3])
        .unwrap();
    let mut solver = Implicit::new(ImplicitSettings {
        scheme,
        ..ImplicitSettings::default()
    })
    .unwrap();
    let start = motion.audit().initial;
    for _ in 0..400 {
        solver
            .step_with(&mut motion, 2e-3, law, &mut [&mut floor])
            .unwrap();
        let audit = motion.audit();
        let height = motion.positions().iter().map(|x| x.z).sum::<f64>() / 3.0;
        let highest = 1.01 * (0.07 / 3.0 + start / (0.03 * 9.81));
        assert!(height < highest, "{scheme:?}: rose to {height} m");
        // Of what gravity gave.
        let given = 0.03 * 9.81 * 0.03 + start;
        assert_below("energy", audit.energy_error().abs(), 1e-5 * given);
        let total = audit.kinetic + audit.elastic - audit.load_work;
        assert!(total < start + 1e-4 * given, "{scheme:?}: {audit:?}");
    }
    let sum: DVec3 = motion.state().forces.iter().sum();
    assert!(sum.length() < 1e-9, "internal forces alone: {sum}");
    assert!(motion.take_warning().is_none(), "{scheme:?}");
    motion
}

#[test]
fn what_falls_on_a_floor_never_rises_higher() {
    let rest = [(0.0, 0.02), (0.01, 0.02), (0.004, 0.03)].map(|(x, z)| DVec3::new(x, 0.0, z));
    for scheme in SCHEMES {
        for friction in [0.0, 0.5] {
            let mut network = Network::complete(&rest, 500.0);
            let known = dropped(scheme, friction, &mut network, &rest);
            let forces = |x: &[DVec3], f: &mut [DVec3]| network.forces(x, f);
            let found = dropped(scheme, friction, &mut Differences::new(forces, 0.01), &rest);
            let pairs = known.positions().iter().zip(found.positions());
            let apart = pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            println!("{scheme:?} {friction}: {apart} m, {:?}", known.audit());
            assert!(apart < 1e-4, "{scheme:?} {friction}: {apart} m");
        }
    }
}

#[test]
fn steps_that_are_not_solved_are_halved_and_bounded() {
    let solver = |iterations: usize| {
        let newton = NewtonSettings {
            iterations,
            ..NewtonSettings::default()
        };
        let scheme = ImplicitScheme::BackwardEuler;
        Implicit::new(ImplicitSettings { scheme, newton }).unwrap()
    };
    let (mut network, mut motion) = spinning(5);
    let report = solver(3).step(&mut motion, 1.0, &mut network).unwrap();
    assert!(report.parts > 1 && report.rejected > 0, "{report:?}");
    assert!((motion.time() - 1.0).abs() < 1e-15, "{}", motion.time());
    assert_eq!(motion.steps(), u64::from(report.parts), "{report:?}");
    let before = motion.state().clone();
    let error = solver(0).step(&mut motion, 1.0, &mut network).unwrap_err();
    assert!(matches!(error, SolveError::Step { .. }), "{error}");
    assert!(!error.to_string().contains("damped"), "{error}");
    assert_eq!(motion.state(), &before, "as before the step");
}

#[test]
fn energy_that_a_law_makes_is_warned_of() {
    // A force that turns with the position has no energy and makes some on each round.
    let mut calls = 0_usize;
    let mut law = crate::ClosureLaw::of(
        &mut calls,
        |calls, x, f| {
            *calls += 1;
            f[0] = DVec3::new(-x[0].y, x[0].x, 0.0) * 3.0 - x[0] * 9.0;
            4.5 * x[0].length_squared()
        },
        |_, v, out| out[0] = v[0] * 9.0,
    );
    let mut motion = one_node(MotionSettings::default());
    let mut solver = solved_to(1e-6, ImplicitScheme::BackwardEuler);
    let mut ended = false;
    for _ in 0..400 {
        ended |= solver.step(&mut motion, 0.02, &mut law).is_err();
    }
    ended |= motion.take_warning().is_some();
    assert!(ended, "{:?}", motion.audit());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    /// What the audit calls unexplained is what Newton left, whatever holds, drives, loads and damps the nodes.
    #[test]
    fn the_audit_closes(
        seed in 0_u64..1000,
        step in 0.01_f64..0.2,
        damping in 0.0_f64..1.0,
        euler in any::<bool>(),
    ) {
        let (mut network, begin) = spinning(seed);
        let rest = begin.positions().to_vec();
        let mut supports = BoundaryConditions::fixed(10, &[0]);
        supports.slide(3, DVec3::new(1.0, 2.0, 0.0));
        let path = Trajectory::ramp(0.0, 0.8, DVec3::new(0.2, 0.0, 0.1)).unwrap();
        supports.drive(&[7], [true, false, true], path, &rest);
        let settings = MotionSettings { damping, gravity: DVec3::NEG_Z, ..MotionSettings::default() };
        let mut motion = Motion::new(&rest, &[1.0; 10], supports, settings).unwrap();
        motion.set_velocities(begin.velocities()).unwrap();
        let scheme = if euler { ImplicitScheme::BackwardEuler } else { ImplicitScheme::EnergyMomentum };
        let mut solver = implicit(scheme);
        for _ in 0..10 {
            solver.step(&mut motion, step, &mut network).unwrap();
        }
        let audit = motion.audit();
        prop_assert!(audit.energy_error().abs() < 1e-8 * audit.scale(), "{scheme:?} {audit:?}");
        prop_assert!(audit.dissipated >= 0.0);
        if !euler {
            prop_assert!(audit.numerical.abs() < 1e-8 * audit.scale(), "{audit:?}");
        }
    }

    /// Far above the explicit limit, too, backward Euler takes energy in each step where the energy is convex, and the other
    /// scheme keeps it.
    #[test]
    fn backward_euler_only_takes(seed in 0_u64..1000, step in 0.001_f64..10.0) {
        for scheme in SCHEMES {
            let mut chain = Chain::new(12, 30.0, 0.4);
            let settings = MotionSettings::default();
            let (start, supports) = (chain.shaken(0.3, seed), BoundaryConditions::fixed(12, &[3]));
            let mut motion = Motion::new(&start, &chain.masses, supports, settings).unwrap();
            motion.set_velocities(&uniform(12, 2.0, seed + 1)).unwrap();
            let mut solver = implicit(scheme);
            let mut before = 0.0;
            for _ in 0..20 {
                solver.step(&mut motion, step, &mut chain).unwrap();
                let audit = motion.audit();
                let holds = match scheme {
                    ImplicitScheme::BackwardEuler => audit.numerical >= before - 1e-12 * audit.initial,
                    ImplicitScheme::EnergyMomentum => audit.numerical.abs() < 1e-8 * audit.scale(),
                };
                prop_assert!(holds, "{scheme:?} {audit:?} after {before}");
                prop_assert!(audit.energy_error().abs() < 1e-9 * audit.scale(), "{audit:?}");
                before = audit.numerical;
            }
        }
    }
}
