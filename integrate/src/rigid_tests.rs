use super::*;
use crate::motion::MotionSettings;
use crate::supports::BoundaryConditions;
use crate::testing::{Network, damped, nothing};
use testkit::cloud::uniform;

/// Two clouds of ten nodes, springs within each.
fn clouds() -> (Vec<DVec3>, Network) {
    let near = uniform(10, 1.0, 5);
    let far = uniform(10, 1.0, 6).into_iter().map(|x| x + DVec3::X * 9.0);
    let rest: Vec<DVec3> = near.into_iter().chain(far).collect();
    let mut network = Network::complete(&rest, 40.0);
    network.springs.retain(|(i, j, _)| (*i < 10) == (*j < 10));
    (rest, network)
}

fn spinning(settings: MotionSettings, supports: BoundaryConditions) -> (Motion, Network) {
    let (rest, network) = clouds();
    let masses: Vec<f64> = (0..20).map(|i| 0.5 + 0.05 * f64::from(i)).collect();
    let mut motion = Motion::new(&rest, &masses, supports, settings).unwrap();
    let turning = |x: &DVec3| DVec3::new(0.3, 0.1, 0.0) + DVec3::new(0.5, 1.0, -0.7).cross(*x);
    // And a vibration on top.
    let shaken = uniform(20, 1.0, 9);
    let velocities: Vec<DVec3> = rest
        .iter()
        .zip(shaken)
        .map(|(x, v)| turning(x) + v * 0.2)
        .collect();
    motion.set_velocities(&velocities).unwrap();
    (motion, network)
}

/// Linear and angular momentum of some nodes.
fn momenta(motion: &Motion, nodes: std::ops::Range<usize>) -> (DVec3, DVec3) {
    nodes.fold((DVec3::ZERO, DVec3::ZERO), |(p, l), i| {
        let momentum = motion.velocities()[i] * motion.masses()[i];
        (p + momentum, l + motion.positions()[i].cross(momentum))
    })
}

#[test]
fn free_pieces_keep_their_momenta_whatever_the_damping() {
    let pieces: Vec<u32> = (0..20).map(|i| i / 10).collect();
    for (damping, viscosity) in [(0.0, 0.0), (3.0, 0.0), (0.0, 0.02), (3.0, 0.02)] {
        let settings = MotionSettings {
            damping,
            viscosity,
            ..MotionSettings::default()
        };
        let (mut motion, network) = spinning(settings, BoundaryConditions::free(20));
        motion.set_pieces(&pieces);
        let before = [momenta(&motion, 0..10), momenta(&motion, 10..20)];
        let energy = motion.audit().kinetic;
        for _ in 0..4000 {
            motion.step(1e-3, |x, f| network.forces(x, f)).unwrap();
        }
        for (nodes, (p0, l0)) in [0..10, 10..20].into_iter().zip(before) {
            let (p, l) = momenta(&motion, nodes);
            assert!((p - p0).length() < 1e-11 * p0.length(), "{p0} -> {p}");
            assert!((l - l0).length() < 1e-11 * l0.length(), "{l0} -> {l}");
        }
        let audit = motion.audit();
        assert!(audit.energy_error().abs() < 2e-3 * energy, "{audit:?}");
        if damping > 0.0 {
            // The vibration is gone, the turning is not.
            let field =
                RigidField::with_moments_of(0..10, motion.masses(), motion.positions(), |i| {
                    motion.velocities()[i] * motion.masses()[i]
                });
            let left = (0..10)
                .map(|i| (motion.velocities()[i] - field.at(motion.positions()[i])).length());
            let left = left.fold(0.0, f64::max);
            assert!(
                left < 1e-2 && audit.kinetic > 0.5 * energy,
                "{left}, {audit:?}"
            );
        }
    }
}

/// Implicit steps spare the same motion.
#[test]
fn implicit_steps_leave_free_pieces_their_momenta_too() {
    use crate::implicit::{Implicit, ImplicitScheme, ImplicitSettings};
    let settings = damped(3.0);
    let (mut motion, mut network) = spinning(settings, BoundaryConditions::free(20));
    motion.set_pieces(&(0..20).map(|i| i / 10).collect::<Vec<u32>>());
    let before = [momenta(&motion, 0..10), momenta(&motion, 10..20)];
    let mut solver = Implicit::new(ImplicitSettings {
        scheme: ImplicitScheme::EnergyMomentum,
        ..ImplicitSettings::default()
    });
    let energy = motion.audit().kinetic;
    for _ in 0..200 {
        let solver = solver.as_mut().unwrap();
        solver.step(&mut motion, 0.01, &mut network).unwrap();
    }
    for (nodes, (p0, l0)) in [0..10, 10..20].into_iter().zip(before) {
        let (p, l) = momenta(&motion, nodes);
        assert!((p - p0).length() < 1e-4 * p0.length(), "{p0} -> {p}");
        assert!((l - l0).length() < 1e-4 * l0.length(), "{l0} -> {l}");
    }
    let audit = motion.audit();
    assert!(audit.energy_error().abs() < 1e-3 * energy, "{audit:?}");
    assert!(audit.dissipated > 5e-4 * energy, "{audit:?}");
}

#[test]
fn held_pieces_are_damped_as_before() {
    let settings = damped(3.0);
    let supports = || BoundaryConditions::fixed(20, &[12]);
    let (mut plain, network) = spinning(settings, supports());
    let (mut pieces, _) = spinning(settings, supports());
    pieces.set_pieces(&(0..20).map(|i| i / 10).collect::<Vec<u32>>());
    for _ in 0..100 {
        plain.step(1e-3, |x, f| network.forces(x, f)).unwrap();
        pieces.step(1e-3, |x, f| network.forces(x, f)).unwrap();
    }
    // The order of kick and decay differs: a difference of second order in the step.
    let far = |motion: &Motion| motion.velocities()[10..].to_vec();
    for (a, b) in far(&plain).iter().zip(far(&pieces)) {
        assert!((*a - b).length() < 5e-3 * (a.length() + 0.1), "{a} {b}");
    }
    // Restoring pieces restores the bits of before.
    pieces.set_pieces(&[]);
    assert!(!pieces.has_free_pieces());
}

#[test]
fn few_nodes_turn_only_as_they_can() {
    let settings = damped(5.0);
    // One node, two on a line.
    let rest = [DVec3::ZERO, DVec3::X * 4.0, DVec3::X * 5.0];
    let mut motion = Motion::new(
        &rest,
        &[1.0, 1.0, 2.0],
        BoundaryConditions::free(3),
        settings,
    )
    .unwrap();
    let velocities = [
        DVec3::Y,
        DVec3::new(1.0, 2.0, 0.0),
        DVec3::new(-1.0, 0.0, 3.0),
    ];
    motion.set_velocities(&velocities).unwrap();
    motion.set_pieces(&[0, 1, 1]);
    for _ in 0..2000 {
        motion.step(1e-3, nothing).unwrap();
    }
    let v = motion.velocities();
    assert!((v[0] - DVec3::Y).length() < 1e-12, "{}", v[0]);
    let sum = v[1] + v[2] * 2.0;
    assert!((sum - DVec3::new(-1.0, 2.0, 6.0)).length() < 1e-11, "{sum}");
    // What drew the two together along their line is damped but for the centrifugal drift v²/(r c).
    let apart = motion.positions()[2] - motion.positions()[1];
    let (along, relative) = (apart.normalize(), v[2] - v[1]);
    let turning = (relative - along * relative.dot(along)).length();
    let drift = turning * turning / (apart.length() * 5.0);
    let closing = relative.dot(along).abs();
    assert!(closing < 1.2 * drift && drift < 0.5, "{relative} {drift}");
    assert!(turning > 0.5, "{turning}");
}

#[test]
fn crumbs_that_fall_far_away_gain_nothing_by_damping() {
    // Pieces of one, two and three nodes: centers of mass that are not exactly where their node is.
    let rest: Vec<DVec3> = uniform(60, 30.0, 11);
    let pieces: Vec<u32> = (0..60)
        .map(|i| if i < 40 { i } else { 40 + i % 10 })
        .collect();
    let masses: Vec<f64> = (0..60)
        .map(|i| 1e-3 * (1.0 + 0.37 * f64::from(i)))
        .collect();
    let gravity = DVec3::new(0.3, -9.81, 0.7);
    let settings = MotionSettings {
        damping: 15.0,
        gravity,
        ..MotionSettings::default()
    };
    let mut motion = Motion::new(&rest, &masses, BoundaryConditions::free(60), settings).unwrap();
    motion.set_pieces(&pieces);
    for _ in 0..2000 {
        motion.step(1e-3, nothing).unwrap();
    }
    for v in motion.velocities() {
        let off = (*v - gravity * 2.0).length();
        assert!(off < 1e-9 * v.length(), "{v} of a free fall");
    }
    let audit = motion.audit();
    assert!(audit.dissipated.abs() < 1e-9 * audit.kinetic, "{audit:?}");
}
