use super::*;
use crate::motion::MotionSettings;
use crate::path::Path;
use crate::supports::Supports;
use crate::testing::{Chain, Network};
use testkit::cloud::uniform;
use testkit::derivative::observed_order;

fn implicit(scheme: ImplicitScheme) -> Implicit {
    let newton = NewtonSettings {
        tolerance: 1e-12,
        ..NewtonSettings::default()
    };
    Implicit::new(ImplicitSettings { scheme, newton }).unwrap()
}

/// One mass on a spring of 9 N/m to its place, with damping; error at t = 2.
fn error_at_two(scheme: ImplicitScheme, damping: f64, steps: u32) -> f64 {
    let mut chain = Chain::new(1, 4.5, 1.0);
    let settings = MotionSettings {
        damping,
        ..MotionSettings::default()
    };
    let mut motion = Motion::new(&[DVec3::X], &[1.0], Supports::free(1), settings).unwrap();
    let mut solver = implicit(scheme);
    for _ in 0..steps {
        solver
            .step(&mut motion, 2.0 / f64::from(steps), &mut chain)
            .unwrap();
    }
    let omega = (9.0 - 0.25 * damping * damping).sqrt();
    let (s, c) = (omega * 2.0).sin_cos();
    let exact = (-damping).exp() * (c + 0.5 * damping / omega * s);
    (motion.positions()[0].x - exact).abs()
}

#[test]
fn orders_of_convergence_on_the_oscillator() {
    for (scheme, damping, order) in [
        (ImplicitScheme::Newmark, 0.0, 2.0),
        (ImplicitScheme::Newmark, 0.7, 2.0),
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
fn newmark_keeps_the_energy_of_a_linear_chain_far_above_the_explicit_limit() {
    let mut chain = Chain::new(15, 100.0, 0.1);
    let start: Vec<DVec3> = chain
        .rest
        .iter()
        .zip(uniform(15, 0.1, 1))
        .map(|(x, d)| *x + d)
        .collect();
    let settings = MotionSettings::default();
    let mut motion = Motion::new(&start, &chain.masses, Supports::free(15), settings).unwrap();
    let mut solver = implicit(ImplicitScheme::Newmark);
    let critical = 2.0 / (4.0 * 100.0 / 0.1_f64).sqrt();
    for _ in 0..300 {
        solver
            .step(&mut motion, 7.0 * critical, &mut chain)
            .unwrap();
    }
    let audit = motion.audit();
    assert!(audit.balance().abs() < 1e-8 * audit.initial, "{audit:?}");
}

#[test]
fn backward_euler_loses_energy_and_never_gains() {
    let mut network = Network::complete(&uniform(10, 1.0, 5), 10.0);
    let rest = uniform(10, 1.0, 5);
    let settings = MotionSettings::default();
    let mut motion = Motion::new(&rest, &[1.0; 10], Supports::free(10), settings).unwrap();
    motion.set_velocities(&uniform(10, 1.0, 6)).unwrap();
    let momentum = motion.audit().momentum;
    let mut solver = implicit(ImplicitScheme::BackwardEuler);
    let mut before = f64::INFINITY;
    for _ in 0..50 {
        solver.step(&mut motion, 0.2, &mut network).unwrap();
        let total = motion.audit().kinetic + motion.audit().elastic;
        assert!(total <= before * (1.0 + 1e-10), "{total} after {before}");
        before = total;
    }
    assert!(
        (motion.audit().momentum - momentum).length() < 1e-9,
        "momentum"
    );
}

#[test]
fn agrees_with_explicit_steps_and_hands_over_to_them() {
    let rest = uniform(10, 1.0, 5);
    let mut network = Network::complete(&rest, 10.0);
    let mut supports = Supports::fixed(10, &[0]);
    supports.slide(3, DVec3::new(1.0, 2.0, 0.0));
    let path = Path::ramp(0.0, 0.8, DVec3::new(0.2, 0.0, 0.1)).unwrap();
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
    let mut solver = implicit(ImplicitScheme::Newmark);
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
    assert!(
        motion.audit().balance().abs() < 1e-3 * scale,
        "{:?}",
        motion.audit()
    );
}

#[test]
fn refuses_bad_settings_and_steps() {
    let newton = NewtonSettings {
        tolerance: 0.0,
        ..NewtonSettings::default()
    };
    let error = Implicit::new(ImplicitSettings {
        newton,
        ..ImplicitSettings::default()
    });
    assert!(
        matches!(
            error,
            Err(MotionError::BadSetting {
                name: "tolerance",
                ..
            })
        ),
        "setting"
    );
    let mut chain = Chain::new(1, 1.0, 1.0);
    let settings = MotionSettings::default();
    let mut motion = Motion::new(&[DVec3::X], &[1.0], Supports::free(1), settings).unwrap();
    let error = implicit(ImplicitScheme::Newmark).step(&mut motion, -1.0, &mut chain);
    assert_eq!(error, Err(SolveError::BadStep { step: -1.0 }), "step");
}
