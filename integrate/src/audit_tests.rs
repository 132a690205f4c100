use super::{Audit, RigidEnergies};
use crate::motion::{ExplicitScheme, Motion, MotionSettings};
use crate::supports::BoundaryConditions;
use crate::testing::{Chain, damped, one_node, oscillator, pulled, springs};
use crate::trajectory::Trajectory;
use crate::view::StepView;
use glam::DVec3;
use testkit::cloud::uniform;

const SCHEMES: [ExplicitScheme; 2] = [
    ExplicitScheme::VelocityVerlet,
    ExplicitScheme::SymplecticEuler,
];

const STILL: [RigidEnergies; 2] = [RigidEnergies {
    kinetic: 0.0,
    lag: 0.0,
}; 2];

#[test]
fn driven_end_of_a_chain_balances_work() {
    let chain = Chain::new(12, 40.0, 0.2);
    let mut supports = BoundaryConditions::fixed(12, &[0]);
    let path = Trajectory::ramp(0.0, 0.7, DVec3::new(0.3, 0.1, 0.0)).unwrap();
    supports.drive(&[11], [true, true, true], path, &chain.rest);
    let run = |scheme: ExplicitScheme, damping: f64, step: f64| {
        let settings = MotionSettings {
            scheme,
            ..damped(damping)
        };
        let mut motion =
            Motion::new(&chain.rest, &chain.masses, supports.clone(), settings).unwrap();
        motion
            .advance_to(1.5, step, |x, f| chain.forces(x, f))
            .unwrap();
        assert_eq!(motion.positions()[0], chain.rest[0], "fixed node");
        let end = chain.rest[11] + DVec3::new(0.3, 0.1, 0.0);
        assert_eq!(motion.positions()[11], end, "driven node");
        *motion.audit()
    };
    // Linear forces: it closes, damping and driven end included, where kinetic and elastic energy alone
    // are off by the square of the step.
    for (scheme, damping) in SCHEMES.into_iter().flat_map(|s| [(s, 0.0), (s, 0.4)]) {
        for step in [0.02, 0.01] {
            let audit = run(scheme, damping, step);
            assert!(audit.support_work > 0.1, "work went in: {audit:?}");
            let work = audit.support_work;
            assert!(audit.energy_error().abs() < 1e-13 * work, "{audit:?}");
            assert!(audit.staggered.abs() > 1e-5 * work, "{audit:?}");
        }
    }
}

#[test]
fn applied_work_and_booked_jumps_close_the_balance() {
    let mut motion = one_node(MotionSettings::default());
    let push = &mut |view: &StepView<'_>, f: &mut [DVec3]| f[0].y += (5.0 * view.time).sin();
    motion.advance_with(1.0, 1e-3, oscillator, push).unwrap();
    assert!(motion.audit().applied_work.abs() > 1e-3, "work");
    let closes = |audit: &Audit| assert!(audit.energy_error().abs() < 1e-4, "{audit:?}");
    closes(motion.audit());
    let softer = |x: &[DVec3], f: &mut [DVec3]| {
        let energy = 0.5 * oscillator(x, f);
        f[0] *= 0.5;
        energy
    };
    let jump = motion.refresh(softer).unwrap();
    assert!(jump < 0.0, "half the stiffness, half the energy");
    motion.advance_with(2.0, 1e-3, softer, push).unwrap();
    closes(motion.audit());
}

#[test]
fn the_balance_of_a_stiff_mode_closes_and_stays_closed_when_damping_has_taken_it() {
    // A spring of which a part is cut while it is stretched, at 0.95 of the critical step.
    let rest = [DVec3::ZERO, DVec3::X];
    let masses = [0.7, 0.4];
    let reduced: f64 = 0.7 * 0.4 / 1.1;
    let spring = |stiffness: f64| {
        move |x: &[DVec3], f: &mut [DVec3]| {
            let stretch = x[1].x - x[0].x - 1.0;
            f[0] = DVec3::X * stiffness * stretch;
            f[1] = -f[0];
            0.5 * stiffness * stretch * stretch
        }
    };
    let step = 0.95 * 2.0 / (50.0 / reduced).sqrt();
    let settings = damped(0.1);
    for scheme in SCHEMES {
        let settings = MotionSettings { scheme, ..settings };
        let mut motion =
            Motion::new(&rest, &masses, BoundaryConditions::free(2), settings).unwrap();
        motion.set_pieces(&[0, 0]);
        let velocities = [0.3, -0.2].map(|v| DVec3::X * v);
        motion.set_velocities(&velocities).unwrap();
        let mut swing: f64 = 0.0;
        for k in 0..4000 {
            let stiffness = if k < 7 { 50.0 } else { 30.0 };
            if k == 7 {
                motion.refresh(spring(stiffness)).unwrap();
            }
            motion.step(step, spring(stiffness)).unwrap();
            let audit = motion.audit();
            assert!(audit.energy_error().abs() < 1e-12, "step {k}: {audit:?}");
            swing = swing.max(audit.staggered.abs());
        }
        let audit = motion.audit();
        assert!(swing > 0.2 * audit.initial, "a stiff mode: {swing}");
        assert!(
            audit.elastic < 1e-9 && audit.energy_correction < -1e-4,
            "{audit:?}"
        );
    }
}

fn same(share: f64, wanted: f64) {
    assert!((share - wanted).abs() < 1e-12, "{share}");
}

/// What appears, vanishes or is hidden counts against what there was before, or what loads and damping did
/// since; round-off does not.
#[test]
fn the_imbalance_is_a_share_of_what_there_was() {
    let before = Audit {
        elastic: 2.0,
        kinetic: 0.5,
        initial: 2.5,
        ..Audit::default()
    };
    same(before.imbalance(&before, STILL, 0.0, 0.0), 0.0);
    let more = Audit {
        elastic: 2.1,
        ..before
    };
    same(more.imbalance(&before, STILL, 0.0, 0.0), 0.05);
    same(more.imbalance(&before, STILL, 0.0, 0.2), 0.0);
    // A mode that grows without bound keeps the balance and hides more than there was.
    same(before.imbalance(&before, STILL, 1.9, 0.0), 0.0);
    same(before.imbalance(&before, STILL, 5.0, 0.0), 1.5);
    let loaded = Audit {
        load_work: 10.0,
        elastic: 11.0,
        ..before
    };
    same(loaded.imbalance(&before, STILL, 0.0, 0.0), 0.1);
}

/// What falls freely hides nothing: neither its energy, nor what gravity does to it, nor its acceleration.
#[test]
fn rigid_motion_is_no_measure_of_the_imbalance() {
    let before = Audit {
        elastic: 2.0,
        kinetic: 100.5,
        initial: 102.5,
        ..Audit::default()
    };
    let after = Audit {
        elastic: 2.1,
        kinetic: 160.5,
        load_work: 60.0,
        ..before
    };
    let rigid = [(100.0, 0.04), (160.0, 0.05)].map(|(kinetic, lag)| RigidEnergies { kinetic, lag });
    same(after.imbalance(&before, rigid, 1.95, 0.0), 0.05);
    same(after.imbalance(&before, rigid, 4.05, 0.0), 1.0);
    same(after.imbalance(&before, STILL, 9.0, 0.0), 0.1 / 100.5);
    // A piece without any strain falls.
    let before = Audit {
        elastic: 0.0,
        kinetic: 100.0,
        initial: 100.0,
        ..Audit::default()
    };
    let after = Audit {
        kinetic: 160.0,
        load_work: 60.0,
        ..before
    };
    same(after.imbalance(&before, rigid, 0.05, 0.0), 0.0);
}

/// A chain that falls and is pulled ever harder, in steps of all lengths: had the lag kept the length of the step before, or
/// the load of the step before, each change would be energy that appears.
#[test]
fn the_balance_closes_whatever_steps_and_loads_do() {
    let chain = Chain::new(12, 50.0, 0.1);
    let supports = BoundaryConditions::free(12);
    let settings = pulled(DVec3::new(0.3, 0.0, -9.81));
    let stiffness = 50.0;
    // Linear ones: such as keep the balance to round-off.
    let springs = springs(&chain.rest, stiffness);
    let critical = 2.0 / (4.0 * stiffness / 0.1_f64).sqrt();
    // Steps of all lengths heat a chain by symplectic Euler.
    for (scheme, largest) in SCHEMES.into_iter().zip([critical, 0.2 * critical]) {
        let settings = MotionSettings { scheme, ..settings };
        let supports = supports.clone();
        let mut motion = Motion::new(&chain.rest, &chain.masses, supports, settings).unwrap();
        motion.set_pieces(&[0; 12]);
        let mut most = 0.0_f64;
        for share in uniform(300, 1.0, 5) {
            let mut loads = vec![DVec3::ZERO; 12];
            loads[11] = share * 0.2;
            motion.set_loads(&loads).unwrap();
            let step = largest * (0.5 + 0.4 * share.x);
            motion.step(step, &springs).unwrap();
            let audit = *motion.audit();
            most = most.max(audit.staggered.abs());
            let (off, scale) = (audit.energy_error().abs(), audit.scale());
            assert!(off < 1e-12 * scale, "{off} J of {scale} J");
        }
        let least = 1e-3 * motion.audit().scale().min(1.0);
        assert!(most > least, "{most} J are in the lag");
    }
}
