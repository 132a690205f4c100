use super::*;
use crate::DiskSample;
use crate::motion::{Motion, MotionSettings};
use crate::supports::BoundaryConditions;
use glam::DQuat;
use proptest::prelude::*;
use testkit::cloud::Random;
use testkit::derivative::directional_error;

/// Nodes along a side of a sheet, and layers of them.
const SIDE: u32 = 5;
const LAYERS: u32 = 3;

/// A sample of an uncut surface, of stiffness and spacing 1.
pub(super) fn sample(position: DVec3, normal: DVec3, area: f64, body: u32) -> DiskSample {
    DiskSample {
        flank: false,
        position,
        normal,
        area,
        body,
        stiffness: 1.0,
        spacing: 1.0,
    }
}

/// A contact with lists of all pairs within a margin (m).
pub(super) fn listed_anew(
    contact: &DeformableContact,
    margin: f64,
    x: &[DVec3],
) -> DeformableContact {
    let mut anew = contact.clone();
    anew.state.listed_at.clear();
    anew.margin = margin;
    anew.update_lists(x);
    anew
}

/// Two sheets of nodes 1 m apart whose surfaces meet at `z = 0`, half a spacing from their outermost nodes, with four
/// samples per node at positions that do not match: E/h = 1 N/m³.
pub(super) fn sheets(friction: f64, seed: u64) -> (DeformableContact, Vec<DVec3>) {
    split_sheets([friction; 2], 2, seed)
}

/// The same; of three bodies the upper sheet is two, beside each other. The lower one rubs them as stated.
fn split_sheets(frictions: [f64; 2], bodies: u32, seed: u64) -> (DeformableContact, Vec<DVec3>) {
    let mut random = Random::new(seed);
    let mut rest = Vec::new();
    for side in [-1.0, 1.0] {
        for k in 0..LAYERS {
            for j in 0..SIDE {
                for i in 0..SIDE {
                    let at = DVec3::new(i.into(), j.into(), side * (0.5 + f64::from(k)));
                    rest.push(at + random.vector(0.05));
                }
            }
        }
    }
    let mut disks = ContactDisks::default();
    let half = SIDE * SIDE * LAYERS;
    for (body, normal) in [(0, DVec3::Z), (1, DVec3::NEG_Z)] {
        for j in 0..2 * SIDE {
            for i in 0..2 * SIDE {
                let at = DVec3::new(i.into(), j.into(), 0.0) * 0.5 - 0.25;
                let at = at + random.vector(0.1);
                let position = DVec3::new(at.x, at.y, 0.0);
                let nodes = nearest(&rest, body * half..(body + 1) * half, position);
                let body = body + u32::from(body + 1 < bodies && body == 1 && i >= SIDE);
                disks.push(sample(position, normal, 0.25, body), (&nodes, &[]), &rest);
            }
        }
    }
    let settings = DeformableSettings {
        learning: 2e-4,
        ..DeformableSettings::default()
    };
    (
        DeformableContact::new(disks, settings, bodies, |a, b| {
            (a == 0 && b > 0).then(|| frictions[b as usize - 1])
        }),
        rest,
    )
}

fn nearest(rest: &[DVec3], of: std::ops::Range<u32>, x: DVec3) -> Vec<u32> {
    let mut nodes: Vec<u32> = of.collect();
    nodes.sort_by(|a, b| {
        let far = |node: &u32| rest[*node as usize].distance_squared(x);
        far(a).total_cmp(&far(b))
    });
    nodes.truncate(16);
    nodes
}

fn is_upper(node: usize, all: usize) -> bool {
    2 * node >= all
}

/// Sheets that are bent, pressed into each other and turned, with offsets that are learned.
fn pressed(friction: f64, seed: u64) -> (DeformableContact, Vec<DVec3>, Vec<DVec3>) {
    let (mut contact, rest) = sheets(friction, seed);
    contact.add_forces(&by(&rest, &zeros(&rest)), &mut zeros(&rest));
    let mut random = Random::new(seed + 1);
    let turn = DQuat::from_axis_angle(random.vector(1.0).normalize(), random.range(0.0, 3.0));
    let bent = |(node, x): (usize, &DVec3)| {
        let down = if is_upper(node, rest.len()) { 0.2 } else { 0.0 };
        let shifted = *x - DVec3::Z * down + DVec3::new(0.3, 0.1, 0.0) * down;
        turn * (shifted + random.vector(0.06))
    };
    let x: Vec<DVec3> = rest.iter().enumerate().map(bent).collect();
    for offset in &mut contact.state.offsets {
        *offset = random.range(0.0, 0.1);
    }
    let moved = (0..x.len()).map(|_| random.vector(0.03)).collect();
    (contact, x, moved)
}

/// Sums, forces and the new state of a copy.
fn evaluate(
    contact: &DeformableContact,
    x: &[DVec3],
    moved: &[DVec3],
) -> (DeformableForce, Vec<DVec3>, DeformableState) {
    let (mut contact, mut forces) = (contact.clone(), zeros(x));
    contact.add_forces(&by(x, moved), &mut forces);
    (sum(&contact), forces, contact.state)
}

/// Between the two bodies.
fn sum(contact: &DeformableContact) -> DeformableForce {
    contact.between().first().copied().unwrap_or_default()
}

/// A step of 1 s in which no piece is free.
fn by<'a>(positions: &'a [DVec3], by: &'a [DVec3]) -> Moved<'a> {
    Moved {
        positions,
        by,
        masses: &[],
        pieces: &[],
        step: 1.0,
    }
}

fn zeros(x: &[DVec3]) -> Vec<DVec3> {
    vec![DVec3::ZERO; x.len()]
}

#[test]
fn nothing_pushes_at_rest_or_where_bodies_begin_within_each_other() {
    for (down, seed) in [(0.0, 0), (0.1, 1)] {
        let (mut contact, mut x) = sheets(0.3, seed);
        let all = x.len();
        for (node, x) in x.iter_mut().enumerate() {
            if is_upper(node, all) {
                x.z -= down;
            }
        }
        let mut forces = zeros(&x);
        contact.add_forces(&by(&x, &zeros(&x)), &mut forces);
        let sum = sum(&contact);
        assert!(sum.normal < 1e-14, "{sum:?}");
        assert!(forces.iter().all(|f| f.length() < 1e-14), "no push");
        assert!((sum.penetration - down).abs() < 1e-12, "{sum:?}");
        assert!(contact.listed_pairs() > 400, "they are near");
    }
}

/// A block pressed down by a gap carries `k A` per side, whatever the samples.
#[test]
fn pressure_is_that_of_the_penalty_and_the_offset_closes_the_gap() {
    let (mut contact, mut x) = sheets(0.0, 3);
    contact.add_forces(&by(&x, &zeros(&x)), &mut zeros(&x));
    let all = x.len();
    for (node, x) in x.iter_mut().enumerate() {
        if is_upper(node, all) {
            x.z -= 0.01;
        }
    }
    let mut forces = zeros(&x);
    contact.add_forces(&by(&x, &zeros(&x)), &mut forces);
    let lower: DVec3 = forces[..all / 2].iter().sum();
    // 25 m² less what lies beyond the jittered rims.
    assert!(
        (lower.z / (-2.0 * 25.0 * 0.01) - 1.0).abs() < 0.05,
        "{lower}"
    );
    let pressures = contact.pressures(&x);
    let amid = |x: &&DVec3| (x.x - 2.0).abs().max((x.y - 2.0).abs()) < 1.1;
    for (x, p) in x.iter().zip(&pressures).filter(|(x, _)| amid(x)) {
        // Samples see the first layer, and of the second what is near.
        let expected = if x.z.abs() < 1.0 { 0.02 } else { *p };
        assert!((p - expected).abs() < 1e-3 && *p < 0.021, "{p} Pa at {x}");
    }
    for _ in 0..99 {
        contact.add_forces(&by(&x, &zeros(&x)), &mut zeros(&x));
    }
    let grown = contact.state.offsets.iter().copied().fold(0.0, f64::max);
    let expected = 0.01 / press::LEAK * (1.0 - (1.0 - 2e-4 * press::LEAK).powi(100));
    assert!((grown / expected - 1.0).abs() < 1e-6, "{grown}");
    assert!(contact.state.offset_work > 0.0, "booked");
}

/// Moves the upper sheet; by how much each node moved.
fn shift_upper(x: &mut [DVec3], by: DVec3) -> Vec<DVec3> {
    let all = x.len();
    let moves = (0..all).map(|node| by * f64::from(u8::from(is_upper(node, all))));
    let moved: Vec<DVec3> = moves.collect();
    x.iter_mut().zip(&moved).for_each(|(x, by)| *x += *by);
    moved
}

/// Points stick below the cone and slide above it, and friction never gives energy.
#[test]
fn friction_stays_within_its_cone() {
    let (mut contact, mut x) = sheets(0.3, 4);
    contact.settings.learning = 0.0;
    contact.add_forces(&by(&x, &zeros(&x)), &mut zeros(&x));
    let all = x.len();
    let mut step = |x: &mut Vec<DVec3>, shifted: DVec3| {
        let moved = shift_upper(x, shifted);
        let mut forces = zeros(x);
        let before = contact.state.dissipated;
        contact.add_forces(&by(x, &moved), &mut forces);
        assert!(contact.state.dissipated >= before, "never gives");
        let (lower, sum) = (forces[..all / 2].iter().sum::<DVec3>(), sum(&contact));
        assert!((sum.force - lower).length() < 1e-12, "{sum:?} {lower}");
        (lower, sum, contact.state.dissipated)
    };
    step(&mut x, DVec3::Z * -0.01);
    // Slip at the cone: 0.3 · 0.01.
    let (force, ..) = step(&mut x, DVec3::X * 0.95 * 0.003);
    assert!(
        (force.x / -force.z / 0.3 - 0.95).abs() < 1e-3,
        "sticks: {force}"
    );
    let (force, sum, dissipated) = step(&mut x, DVec3::X * 0.1 * 0.003);
    assert!(
        (force.x / -force.z / 0.3 - 1.0).abs() < 1e-3,
        "slides: {force}"
    );
    assert!(sum.friction <= 0.3 * sum.normal * (1.0 + 1e-12), "{sum:?}");
    assert!(dissipated > 0.0, "slid");
    let (force, ..) = step(&mut x, DVec3::Y * -0.3);
    let along = DVec3::new(force.x, force.y, 0.0).length();
    assert!(
        (along / -force.z / 0.3 - 1.0).abs() < 1e-2,
        "at the cone: {force}"
    );
    let (force, ..) = step(&mut x, DVec3::Z * 0.5);
    assert_eq!(force, DVec3::ZERO, "nothing holds them together");
}

/// Two bodies beside each other are as one if both rub alike; else each has a cone of its own, and what slides over the seam
/// keeps the balance.
#[test]
fn each_pair_of_bodies_has_its_friction() {
    let slid = |frictions: [f64; 2], bodies: u32| {
        let (mut contact, mut x) = split_sheets(frictions, bodies, 4);
        contact.settings.learning = 0.0;
        for step in 0..100 {
            let shifted = [DVec3::Z * -0.002, DVec3::X * 0.01][usize::from(step > 4)];
            let moved = shift_upper(&mut x, shifted);
            let before = contact.state.dissipated;
            contact.add_forces(&by(&x, &moved), &mut zeros(&x));
            assert!(contact.state.dissipated >= before, "never gives");
        }
        (contact.state.forces.clone(), contact)
    };
    let [one, two] = [2, 3].map(|bodies| slid([0.3; 2], bodies).0);
    assert_eq!(one, two, "as one");
    for frictions in [[0.3, 0.1], [0.1, 0.3], [0.3, 0.0]] {
        let (_, contact) = slid(frictions, 3);
        for sum in contact.between() {
            let friction = frictions[sum.bodies[1] as usize - 1];
            let share = sum.friction / sum.normal;
            assert!(
                (share - friction).abs() < 0.1 * friction + 1e-12,
                "{frictions:?}: {share}"
            );
        }
        let state = contact.state();
        assert!(
            state.energy_error().abs() < 0.01 * state.dissipated,
            "{state:?}"
        );
    }
}

/// A cut that gives samples other rows leaves what springs hold; what it cannot leave is booked.
#[test]
fn samples_that_change_keep_their_energy() {
    let (mut contact, x, moved) = pressed(0.0, 8);
    contact.add_forces(&by(&x, &zeros(&x)), &mut zeros(&x));
    let (rest, before) = (sheets(0.0, 8).1, contact.energies(&x));
    let booked = contact.state.offset_work;
    let mut disks = contact.take_disks(&x);
    let changed: Vec<usize> = (0..disks.len()).step_by(3).collect();
    for &at in &changed {
        let nodes: Vec<u32> = disks.row(at).map(|entry| disks.nodes[entry]).collect();
        disks.set(at, disks.samples[at], (&nodes[..9], &[]), &rest);
    }
    contact.set_disks(disks, &changed, &x);
    let after = contact.energies(&x);
    let (a, b) = (before.iter().sum::<f64>(), after.iter().sum::<f64>());
    assert!((b / a - 1.0).abs() < 1e-2, "{a} J, then {b} J");
    assert!((contact.state.offset_work - booked - (b - a)).abs() < 1e-15);
    assert!(
        evaluate(&contact, &x, &moved).2.energy > 0.0,
        "still pressed"
    );
}

#[test]
fn serial_and_parallel_are_the_same() {
    let (contact, x, moved) = pressed(0.4, 11);
    let run = |threads| {
        let (sum, forces, state) = testkit::on_threads(threads, || evaluate(&contact, &x, &moved));
        (forces, sum, state)
    };
    assert_eq!(run(1), run(3));
}

/// A free piece that lies on one that is held loses its speed along the normal at the rate `χ g`, and along the surface
/// as far as it does not slide; two free pieces keep their momentum and angular momentum.
#[test]
fn what_lies_on_something_is_damped() {
    let (mut contact, mut x) = sheets(0.5, 6);
    contact.set_rates(0.0, 0.1);
    contact.add_forces(&by(&x, &zeros(&x)), &mut zeros(&x));
    let all = x.len();
    for x in &mut x[all / 2..] {
        x.z -= 0.01;
    }
    let masses = vec![0.5; all];
    let press = |moved: DVec3, turn: f64, lower: u32| {
        let pieces: Vec<u32> = (0..all)
            .map(|node| if is_upper(node, all) { 0 } else { lower })
            .collect();
        let turned = |node: usize| moved + DVec3::new(0.0, 2.0, 1.0).cross(x[node]) * turn;
        let moves: Vec<DVec3> = (0..all)
            .map(|node| {
                if is_upper(node, all) {
                    turned(node)
                } else {
                    DVec3::ZERO
                }
            })
            .collect();
        let (mut forces, mut without) = (zeros(&x), zeros(&x));
        let step = Moved {
            masses: &masses,
            pieces: &pieces,
            step: 1e-3,
            ..by(&x, &moves)
        };
        let (mut still, mut dragged) = (contact.clone(), contact.clone());
        still.set_rates(0.0, 0.0);
        still.add_forces(&step, &mut without);
        dragged.add_forces(&step, &mut forces);
        let told = sum(&dragged).force - sum(&still).force;
        let lost = dragged.state.dissipated - still.state.dissipated;
        let drag: Vec<DVec3> = forces.iter().zip(&without).map(|(a, b)| *a - *b).collect();
        let power: f64 = drag.iter().zip(&moves).map(|(f, d)| f.dot(*d)).sum();
        assert!((power + lost).abs() < 1e-6 * lost + 1e-15, "{power} {lost}");
        let upper: DVec3 = drag[all / 2..].iter().sum();
        assert!((told + upper).length() < 1e-12, "{told} {upper}");
        (drag, upper, sum(&dragged).normal)
    };
    let (drag, upper, normal) = press(DVec3::Z * -1e-4, 0.0, u32::MAX);
    let expected = 0.1 * normal * 0.1;
    assert!(
        (upper.z / expected - 1.0).abs() < 0.01,
        "{upper} of {expected}"
    );
    assert!(
        drag[..all / 2].iter().any(|f| f.length() > 0.0),
        "what is held bears it"
    );
    let (_, slow, _) = press(DVec3::X * 1e-4, 0.0, u32::MAX);
    assert!(slow.x < -0.5 * expected, "it sticks: {slow}");
    let (_, fast, _) = press(DVec3::X * 1e-2, 0.0, u32::MAX);
    assert!(fast.x.abs() < 1e-3 * expected, "it slides: {fast}");
    let (drag, ..) = press(DVec3::new(1e-5, 0.0, -1e-4), 1e-6, 1);
    let total: DVec3 = drag.iter().sum();
    let turn: DVec3 = drag.iter().zip(&x).map(|(f, x)| x.cross(*f)).sum();
    assert!(
        total.length() < 1e-14 && turn.length() < 1e-13,
        "{total} {turn}"
    );
}

/// Two sheets on their nodes alone collide and part: the audit of contact and motion closes.
#[test]
fn a_collision_keeps_momentum_and_the_books() {
    let (mut contact, rest) = sheets(0.3, 5);
    contact.settings.learning = 0.0;
    let all = rest.len();
    let x: Vec<DVec3> = (0..all)
        .map(|node| {
            rest[node]
                + if is_upper(node, all) {
                    DVec3::Z * 0.02
                } else {
                    DVec3::ZERO
                }
        })
        .collect();
    let supports = BoundaryConditions::free(all);
    let mut motion = Motion::new(&x, &vec![1.0; all], supports, MotionSettings::default()).unwrap();
    let v: Vec<DVec3> = (0..all)
        .map(|node| {
            if is_upper(node, all) {
                DVec3::new(0.02, 0.0, -0.05)
            } else {
                DVec3::ZERO
            }
        })
        .collect();
    motion.set_velocities(&v).unwrap();
    // Springs of a step's own reference hold each sheet together, so that it is moved, not torn.
    let bound = {
        contact.update_lists(&x);
        contact.largest_eigenvalue(motion.masses())
    };
    let spring = |x: &[DVec3], forces: &mut [DVec3]| {
        let mut energy = 0.0;
        for half in [0..all / 2, all / 2..all] {
            let count = f64::from(disks::index(half.len()));
            let middle = half.clone().map(|n| x[n] - rest[n]).sum::<DVec3>() / count;
            for node in half {
                let stretch = x[node] - rest[node] - middle;
                forces[node] = -stretch;
                energy += 0.5 * stretch.length_squared();
            }
        }
        energy
    };
    let step = 0.5 * 2.0 / (bound + 1.0).sqrt();
    let mut largest = 0.0_f64;
    while motion.time() < 8.0 {
        let contact = &mut contact;
        let applied = &mut |view: &crate::view::StepView<'_>, forces: &mut [DVec3]| {
            let moved: Vec<DVec3> = view.velocities.iter().map(|v| *v * view.step).collect();
            contact.add_forces(&by(view.positions, &moved), forces);
        };
        motion.step_with(step, spring, applied).unwrap();
        let audit = motion.audit();
        let state = &contact.state;
        let off = audit.applied_work + state.energy + state.dissipated;
        largest = largest.max(off.abs() / audit.initial);
    }
    let momentum: DVec3 = v.iter().sum();
    assert!(
        (motion.audit().momentum - momentum).length() < 1e-13,
        "{:?}",
        motion.audit()
    );
    assert!(
        motion.velocities()[all / 2].z > -0.02,
        "it was stopped: {}",
        motion.velocities()[all / 2]
    );
    assert!(contact.state.dissipated > 0.0, "it slid");
    assert!(largest < 0.02, "off by {largest} of the energy");
    let own = (motion.audit().applied_work - contact.state.work).abs() / motion.audit().initial;
    assert!(own < 1e-3, "its own sum of its work is off by {own}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Forces are the derivative of the energy, weights of pairs included, also of those that turn away from each other or
    /// whose disks collapse.
    #[test]
    fn forces_are_those_of_the_energy(
        seed in 0_u64..1000,
        tilt in 0.0..0.9,
        deeper in 0.0..1.0,
        narrow in 0.1..1.0,
    ) {
        let (mut contact, mut x, _) = pressed(0.0, seed);
        contact.settings.learning = 0.0;
        let (all, turn) = (x.len(), DQuat::from_axis_angle((x[1] - x[0]).normalize(), tilt));
        let middle = x[all / 2..].iter().sum::<DVec3>() / (all / 2) as f64;
        for x in &mut x[all / 2..] {
            *x = middle + turn * (*x - middle) - DVec3::Z * deeper;
        }
        let along = (x[1] - x[0]).normalize();
        for x in &mut x {
            *x += along * (narrow - 1.0) * along.dot(*x);
        }
        let mut random = Random::new(seed + 2);
        let direction: Vec<DVec3> = x.iter().map(|_| random.vector(1.0)).collect();
        let (_, forces, _) = evaluate(&contact, &x, &zeros(&x));
        let slope: f64 = -forces.iter().zip(&direction).map(|(f, d)| f.dot(*d)).sum::<f64>();
        let energy = |t: f64| {
            let moved: Vec<DVec3> = x.iter().zip(&direction).map(|(x, d)| *x + *d * t).collect();
            evaluate(&contact, &moved, &zeros(&x)).2.energy
        };
        let error = directional_error(energy, slope, 1e-4, 1e-3);
        prop_assert!(error < 1e-5, "{error}");
    }

    /// Friction included, pairs keep momentum and angular momentum; lists hold all pairs; turning changes nothing.
    #[test]
    fn pairs_are_balanced_and_lists_hold_them_all(seed in 0_u64..1000) {
        let (mut contact, x, moved) = pressed(0.5, seed);
        contact.update_lists(&x);
        let brute = listed_anew(&contact, 1e3, &x);
        let (sum, forces, state) = evaluate(&contact, &x, &moved);
        prop_assert!(sum.normal > 0.1 && sum.friction > 0.0, "{sum:?}");
        let total: DVec3 = forces.iter().sum();
        let turn: DVec3 = forces.iter().zip(&x).map(|(f, x)| x.cross(*f)).sum();
        prop_assert!(total.length() < 1e-12 && turn.length() < 1e-11, "{total} {turn}");
        let (brute_sum, all, brute_state) = evaluate(&brute, &x, &moved);
        prop_assert!(brute.listed_pairs() > contact.listed_pairs());
        prop_assert!(brute_sum == sum && all == forces);
        // Points of which no list knows begin later.
        prop_assert_eq!(brute_state.energy.to_bits(), state.energy.to_bits());
        let rotation = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.3);
        let turned = |list: &[DVec3]| list.iter().map(|v| rotation * *v).collect::<Vec<_>>();
        let (_, again, turned_state) = evaluate(&contact, &turned(&x), &turned(&moved));
        prop_assert!((turned_state.energy - state.energy).abs() < 1e-12);
        for (a, b) in again.iter().zip(turned(&forces)) {
            prop_assert!((*a - b).length() < 1e-11, "{a} {b}");
        }
    }

    /// The estimate is above the largest eigenvalue of the pairs as they are, by powers of the stiffness.
    #[test]
    fn the_eigenvalue_estimate_holds(seed in 0_u64..1000) {
        let (mut contact, x, _) = pressed(0.0, seed);
        contact.update_lists(&x);
        let bound = contact.largest_eigenvalue(&vec![1.0; x.len()]);
        let mut random = Random::new(seed + 3);
        let mut v: Vec<DVec3> = x.iter().map(|_| random.vector(1.0)).collect();
        let mut found = 0.0;
        for _ in 0..30 {
            let length = v.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
            let along = |t: f64| -> Vec<DVec3> {
                let at: Vec<DVec3> = x.iter().zip(&v).map(|(x, v)| *x + *v * (t / length)).collect();
                evaluate(&contact, &at, &zeros(&x)).1
            };
            v = along(-1e-5).iter().zip(along(1e-5)).map(|(a, b)| (*a - b) * 5e4).collect();
            found = v.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
        }
        prop_assert!(found < bound && found > 0.3 * bound, "{found} of {bound}");
    }
}
