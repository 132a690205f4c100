use super::*;
use crate::audit::Audit;
use crate::motion::MotionSettings;
use crate::supports::BoundaryConditions;
use crate::testing::{Chain, Network, OMEGA, free, nothing, one_node, oscillator, pulled, swung};
use crate::trajectory::{Ease, Trajectory};
use proptest::prelude::*;
use testkit::assert_matches;
use testkit::cloud::uniform;
use testkit::derivative::observed_order;

fn error_at_two(scheme: ExplicitScheme, damping: f64, step: f64) -> f64 {
    let settings = MotionSettings {
        scheme,
        damping,
        ..MotionSettings::default()
    };
    let mut motion = one_node(settings);
    motion.advance_to(2.0, step, oscillator).unwrap();
    (motion.positions()[0].x - swung(damping)).abs()
}

#[test]
fn orders_of_convergence_on_the_oscillator() {
    for (scheme, damping, order) in [
        (ExplicitScheme::VelocityVerlet, 0.0, 2.0),
        (ExplicitScheme::VelocityVerlet, 0.7, 2.0),
        (ExplicitScheme::SymplecticEuler, 0.0, 1.0),
        (ExplicitScheme::SymplecticEuler, 0.7, 1.0),
    ] {
        let errors = [0.02, 0.01, 0.005].map(|step| error_at_two(scheme, damping, step));
        for pair in errors.windows(2) {
            let seen = observed_order(pair[0], pair[1], 2.0);
            assert!((seen - order).abs() < 0.1, "{scheme:?} {damping}: {seen}");
        }
    }
}

#[test]
fn viscous_damping_decays_as_the_oscillator_does() {
    let viscosity = 0.05;
    let run = |step: f64| {
        let settings = MotionSettings {
            viscosity,
            ..MotionSettings::default()
        };
        let mut motion = one_node(settings);
        motion.advance_to(2.0, step, oscillator).unwrap();
        assert!(motion.audit().dissipated > 0.0, "takes energy out");
        assert!(motion.audit().energy_error().abs() < 0.05 * 4.5, "balance");
        (motion.positions()[0].x - swung(viscosity * OMEGA * OMEGA)).abs()
    };
    let seen = observed_order(run(0.005), run(0.0025), 2.0);
    assert!(seen > 0.9, "lagged forces are first order, seen {seen}");
}

#[test]
fn a_changed_step_keeps_the_scheme() {
    // Free fall is exact for any sequence of steps only if velocities are synchronous.
    let settings = pulled(-DVec3::Z);
    let mut motion = one_node(settings);
    for step in [0.1, 0.01, 0.3, 0.003] {
        motion.step(step, nothing).unwrap();
    }
    let (t, z) = (motion.time(), motion.positions()[0].z);
    assert!((z + 0.5 * t * t).abs() < 1e-15, "parabola");
    assert!((motion.velocities()[0].z + t).abs() < 1e-15, "velocity");
    let audit = motion.audit();
    assert!(audit.energy_error().abs() < 1e-15, "{audit:?}");
    assert!((audit.load_work - 0.5 * t * t).abs() < 1e-15, "work");
}

#[test]
fn reactions_carry_the_weight() {
    let chain = Chain::new(2, 100.0, 1.0);
    let mut supports = BoundaryConditions::free(2);
    supports.fix_axes(0, [false, false, true]);
    supports.fix_axes(1, [true, true, true]);
    let settings = pulled(-DVec3::Z * 9.81);
    let mut motion = Motion::new(&chain.rest, &chain.masses, supports, settings).unwrap();
    motion.step(0.01, |x, f| chain.forces(x, f)).unwrap();
    let reactions = motion.reactions();
    assert_eq!(reactions[0].0, 0, "node");
    for (_, force) in reactions {
        assert!((force - DVec3::Z * 9.81).length() < 1e-12, "{force}");
    }
}

#[test]
fn blow_up_lies_at_the_critical_step_and_names_it() {
    let chain = Chain::new(30, 7.0, 0.3);
    let settings = crate::EigenvalueSettings {
        iterations: 400,
        tolerance: 1e-6,
        margin: 0.0,
    };
    let found = chain.eigenvalue(&settings, &mut Vec::new());
    let run = |share: f64| {
        let mut motion = free(&chain.shaken(1e-3, 5), &chain.masses);
        motion.set_critical_step(found.critical_step);
        for _ in 0..5000 {
            motion.step(share * found.critical_step, |x, f| chain.forces(x, f))?;
        }
        Ok::<Audit, StepError>(*motion.audit())
    };
    assert!(run(0.995).is_ok(), "stable just below");
    let error = run(1.005).unwrap_err();
    let StepError::Diverged {
        cause: Cause::StepTooLarge { .. },
        kinetic,
        ..
    } = error
    else {
        panic!("{error}");
    };
    assert!(kinetic.is_finite(), "caught in time");
    assert!(error.to_string().contains("take a smaller one"), "{error}");
}

#[test]
fn stiff_applied_forces_are_named() {
    let mut motion = one_node(MotionSettings::default());
    let spring = &mut |view: &StepView<'_>, f: &mut [DVec3]| f[0] -= view.positions[0] * 1e6;
    let error = motion
        .advance_with(5.0, 0.1, oscillator, spring)
        .unwrap_err();
    let cause = Cause::ContactTooStiff;
    assert_matches!(error, StepError::Diverged { cause: c, .. } if *c == cause);
}

#[test]
fn warning_names_the_node_once() {
    let mut motion = one_node(MotionSettings::default());
    // States less energy than its forces have.
    let law = |x: &[DVec3], f: &mut [DVec3]| 0.8 * oscillator(x, f);
    for _ in 0..30 {
        motion.step(0.02, law).unwrap();
    }
    let warning = motion.take_warning().unwrap();
    assert_eq!(warning.node, 0, "node");
    let said = warning.relative > 0.05 && warning.time > 0.0;
    assert!(said, "{warning:?}");
    let text = warning.to_string();
    assert!(text.contains("is at node 0: "), "{text}");
}

#[test]
fn steps_are_equal_and_end_exactly() {
    assert_eq!(step_count(0.4 - 0.1, 0.1), Ok(3), "round-off costs no step");
    assert_eq!(step_count(0.0, 0.1), Ok(0), "nothing to do");
    assert_eq!(step_count(1.0, f64::INFINITY), Ok(1), "as long as may be");
    let mut motion = one_node(MotionSettings::default());
    motion.advance_to(0.3, 0.07, oscillator).unwrap();
    assert_eq!(motion.time().to_bits(), 0.3_f64.to_bits(), "time");
    assert_eq!(motion.steps(), 5, "steps");
    motion.advance_to(0.3, 0.07, oscillator).unwrap();
    assert_eq!(motion.steps(), 5, "already there");
}

#[test]
fn restored_to_the_same_bits() {
    let rest = uniform(12, 1.0, 3);
    let network = Network::complete(&rest, 20.0);
    let settings = MotionSettings {
        damping: 0.1,
        viscosity: 1e-3,
        ..MotionSettings::default()
    };
    let supports = BoundaryConditions::fixed(12, &[2]);
    let mut whole = Motion::new(&rest, &[0.5; 12], supports, settings).unwrap();
    whole.set_velocities(&uniform(12, 1.0, 4)).unwrap();
    let advance = |motion: &mut Motion, end: f64| {
        let law = |x: &[DVec3], f: &mut [DVec3]| network.forces(x, f);
        motion.advance_to(end, 0.013, law).unwrap();
    };
    advance(&mut whole, 0.4);
    let kept = whole.state().clone();
    // By a file, too.
    #[cfg(feature = "serde")]
    let kept = ron::from_str(&ron::to_string(&kept).unwrap()).unwrap();
    let mut other = whole.clone();
    advance(&mut whole, 1.0);
    advance(&mut other, 0.8);
    other.restore(kept);
    advance(&mut other, 1.0);
    assert_eq!(other.state(), whole.state(), "restored");
}

#[test]
fn parallel_equals_serial_to_the_bit() {
    let n = crate::sweep::PARALLEL_FROM + 777;
    let start = uniform(n, 1.0, 9);
    let law = |x: &[DVec3], f: &mut [DVec3]| {
        let mut energy = 0.0;
        for (f, x) in f.iter_mut().zip(x) {
            *f = -*x;
            energy += 0.5 * x.length_squared();
        }
        energy
    };
    let run = |threads: usize| {
        testkit::on_threads(threads, || {
            let settings = MotionSettings {
                damping: 0.1,
                gravity: DVec3::Y,
                ..MotionSettings::default()
            };
            let mut supports = BoundaryConditions::fixed(n, &[5, 4_000]);
            supports.slide(77, DVec3::ONE);
            let mut motion = Motion::new(&start, &vec![1.0; n], supports, settings).unwrap();
            for _ in 0..3 {
                motion.step(0.1, law).unwrap();
            }
            motion.state().clone()
        })
    };
    assert_eq!(run(1), run(2), "two threads");
    assert_eq!(run(1), run(3), "three threads");
}

#[test]
fn setters_refuse_what_is_not_finite() {
    let mut motion = one_node(MotionSettings::default());
    let nan = [DVec3::NAN];
    let said = motion.set_velocities(&nan).unwrap_err().to_string();
    assert_eq!(said, "node 0: velocity is not finite");
    assert!(motion.set_positions(&nan).is_err(), "position");
    assert!(motion.set_loads(&nan).is_err(), "load");
    assert!(motion.set_damping(-1.0).is_err(), "damping");
    let supports = BoundaryConditions::free(1);
    let bad = Motion::new(&[DVec3::X], &[0.0], supports, MotionSettings::default());
    let wanted = "node 0 has mass 0 kg, which must be positive and finite";
    assert_eq!(bad.unwrap_err().to_string(), wanted);
}

#[test]
fn a_path_with_constant_velocity_starts_at_once() {
    let chain = Chain::new(1, 10.0, 1.0);
    let mut supports = BoundaryConditions::free(1);
    let keys = vec![(0.0, DVec3::ZERO), (1.0, DVec3::X)];
    let path = Trajectory::translation(keys, Ease::Linear).unwrap();
    supports.drive(&[0], [true, true, true], path, &chain.rest);
    let settings = MotionSettings::default();
    let mut motion = Motion::new(&chain.rest, &chain.masses, supports, settings).unwrap();
    let law = |x: &[DVec3], f: &mut [DVec3]| chain.forces(x, f);
    motion.advance_to(0.5, 0.01, law).unwrap();
    let audit = motion.audit();
    assert!((audit.kinetic - 0.5).abs() < 1e-15, "{audit:?}");
    assert!(audit.energy_error().abs() < 1e-12, "{audit:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn verlet_is_reversible(seed in 0_u64..1000, step in 0.001_f64..0.02) {
        let rest = uniform(8, 1.0, seed);
        let network = Network::complete(&rest, 10.0);
        let mut motion = free(&rest, &[1.0; 8]);
        motion.set_velocities(&uniform(8, 0.5, seed + 1)).unwrap();
        let go = |motion: &mut Motion| for _ in 0..50 {
            motion.step(step, |x, f| network.forces(x, f)).unwrap();
        };
        go(&mut motion);
        let back: Vec<DVec3> = motion.velocities().iter().map(|v| -*v).collect();
        motion.set_velocities(&back).unwrap();
        go(&mut motion);
        for (x, start) in motion.positions().iter().zip(&rest) {
            prop_assert!((*x - *start).length() < 1e-11, "{x} {start}");
        }
    }

    #[test]
    fn momentum_is_kept_without_external_forces(seed in 0_u64..1000) {
        let rest = uniform(10, 1.0, seed);
        let network = Network::complete(&rest, 5.0);
        let masses: Vec<f64> = uniform(10, 0.4, seed + 7).iter().map(|v| 0.5 + v.x).collect();
        let mut motion = free(&rest, &masses);
        motion.set_velocities(&uniform(10, 0.5, seed + 1)).unwrap();
        let (linear, angular) = (motion.audit().momentum, motion.angular_momentum());
        for _ in 0..100 {
            motion.step(0.01, |x, f| network.forces(x, f)).unwrap();
        }
        prop_assert!((motion.audit().momentum - linear).length() < 1e-12);
        prop_assert!((motion.angular_momentum() - angular).length() < 1e-12);
    }
}

#[test]
fn lists_of_another_length_are_refused() {
    let settings = MotionSettings::default();
    let built = |masses: &[f64], supports| {
        let motion = Motion::new(&[DVec3::ZERO; 2], masses, supports, settings);
        motion.unwrap_err().to_string()
    };
    let said = built(&[1.0], BoundaryConditions::free(2));
    assert_eq!(said, "1 masses for 2 nodes; give one per node");
    let said = built(&[1.0; 2], BoundaryConditions::free(3));
    assert_eq!(said, "3 supports for 2 nodes; give one per node");
}
