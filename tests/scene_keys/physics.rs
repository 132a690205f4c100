//! What the keys that choose a model do to the motion, against each other and closed forms.

use glam::DVec3;
use phyxel::World;
use testkit::tol::assert_within;

use super::sag;
use crate::play;

/// A column that hangs by its top, 40 x 40 x 80 mm.
fn world(material: &str, body: &str, rest: &str) -> World {
    let text = format!(
        "(version: 1, bodies: [(shape: Box(size: (0.04, 0.04, 0.08)), sampling: (target: Nodes(400)),
            material: (youngs_modulus: 1e4, poissons_ratio: 0.3, density: 1000, {material}), {body})],
          supports: [(region: HalfSpace(point: (0, 0, 0.0399), normal: (0, 0, 1)))], {rest})"
    );
    crate::world(&text)
}

const AT_ONCE: &str = "integration: (settle: None), gravity: (ramp: 0),";

fn at_rest(material: &str, body: &str) -> World {
    let mut world = world(material, body, AT_ONCE);
    world.rest_in_equilibrium().expect("it has an equilibrium");
    world
}

pub(super) fn imbalance(world: &World) -> f64 {
    world.bodies()[0].motion().audit().unexplained()
}

/// A hanging column stretches by `rho g l² / 2E` (uniaxial, held as the top is it sags a little less);
/// fibres along it and a stiff half make it shorter, more of a volume's penalty too.
#[test]
fn stiffer_parts_and_fibres_shorten_a_hanging_column() {
    let plain = sag(&at_rest("", ""));
    let bar = 1000.0 * 9.81 * 0.08 * 0.08 / (2.0 * 1e4);
    let ratio = plain / bar;
    assert!((0.93..1.08).contains(&ratio), "{ratio} of a bar's");
    let along = "fiber: (direction: (0, 0, 1), stiffness: 2.5e3)";
    let fibres = sag(&at_rest(along, ""));
    // 4 k1 beside E doubles the stiffness at small stretch, and more at larger.
    let ratio = fibres / plain;
    assert!((0.35..0.56).contains(&ratio), "{ratio}");
    let across = sag(&at_rest(&along.replace("(0, 0, 1)", "(1, 0, 0)"), ""));
    assert_within("slack fibres", across / plain, 1.0, 0.05);
    // The upper half carries three quarters of the stretch; ten times as stiff it has a tenth of it.
    let upper = "inclusions: [(region: HalfSpace(point: (0, 0, 0), normal: (0, 0, 1)), ";
    let stiff = sag(&at_rest("", &format!("{upper} youngs_modulus: 1e5)]")));
    assert_within("a stiff upper half", stiff / plain, 0.25 + 0.075, 0.06);
    let heavy = world("", &format!("{upper} density: 3000)]"), AT_ONCE);
    let mass: f64 = heavy.bodies()[0].masses.iter().sum();
    assert!((mass / 0.128 - 2.0).abs() < 0.2, "{mass} kg");
}

/// With one Prony term of ratio 1 the column is at first twice as stiff, and in the end as stiff as
/// without; the audit knows what viscosity took.
#[test]
fn a_viscous_column_creeps_to_its_elastic_length() {
    let elastic = sag(&at_rest("", ""));
    let viscous = "viscosity: [(ratio: 1, time: 0.15)]";
    let mut world = world(viscous, "damping: 25", AT_ONCE);
    play(&mut world, 0.1);
    let early = sag(&world);
    assert!(imbalance(&world) < 2e-3, "{}", imbalance(&world));
    play(&mut world, 2.0);
    let late = sag(&world);
    let ratio = early / elastic;
    assert!((0.45..0.8).contains(&ratio), "{ratio} at first");
    assert_within("in the end", late / elastic, 1.0, 0.01);
    let body = &world.bodies()[0];
    assert!(imbalance(&world) < 2e-3, "{}", imbalance(&world));
    assert!(body.relaxed > 0.0, "{} J", body.relaxed);
    // In equilibrium viscosity is at rest.
    let still = sag(&at_rest(viscous, ""));
    assert!((still / elastic - 1.0).abs() < 1e-4, "{still}, {elastic}");
}

/// Every scheme brings the column to the same rest, which is that of the static solution; in motion
/// the second order of the energy-momentum method shows against the explicit steps.
#[test]
fn all_schemes_end_at_the_same_rest() {
    let rest = sag(&at_rest("", ""));
    let with = |scheme: &str, until: f64, damping: f64| {
        let mut world = world(
            "",
            &format!("damping: {damping}"),
            &format!("integration: (settle: None, scheme: {scheme}), gravity: (ramp: 0),"),
        );
        let mut before = (0.0, 0.0);
        while world.time() < until {
            before = (world.time(), sag(&world));
            world.step().expect("it steps");
        }
        // Steps need not end there.
        let share = (until - before.0) / (world.time() - before.0);
        let there = before.1 + share * (sag(&world) - before.1);
        (there, imbalance(&world))
    };
    for scheme in [
        "VelocityVerlet",
        "SymplecticEuler",
        "BackwardEuler(step: 0.02)",
        "EnergyMomentum(step: 0.02, tolerance: 1e-6)",
    ] {
        let (end, _) = with(scheme, 1.6, 20.0);
        assert!((end / rest - 1.0).abs() < 5e-3, "{scheme}: {end}, {rest}");
    }
    // A quarter of the column's first period, 4 l sqrt(rho / E) = 0.1 s.
    let (fine, balance) = with("VelocityVerlet", 0.06, 0.0);
    assert!(balance < 1e-2, "{balance}");
    let errors = [0.004, 0.002].map(|step| {
        let scheme = format!("EnergyMomentum(step: {step}, tolerance: 1e-8)");
        (with(&scheme, 0.06, 0.0).0 - fine).abs()
    });
    assert!(errors[0] < 0.03 * rest, "{errors:?} of {rest}");
    assert!(errors[1] < 0.5 * errors[0], "{errors:?}");
}

/// A law that gives way under pressure has no equilibrium here: the body comes to rest by motion, and says so.
#[test]
fn what_has_no_equilibrium_comes_to_rest_by_motion() {
    let mut world = world(
        "model: SaintVenantKirchhoff",
        "",
        "integration: (settle: (rest: Equilibrium, limit: 0.5)), gravity: (acceleration: (0, 0, 30)),",
    );
    assert!(world.settle().is_ok() && world.scene_time() == Some(0.0));
    let [alarm] = world.alarms() else {
        panic!("{:?}", world.alarms());
    };
    let parts = [
        "no equilibrium was found (load steps below",
        "to rest by motion instead",
    ];
    assert!(parts.iter().all(|part| alarm.contains(part)), "{alarm}");
    assert!(world.steps() > 0 && imbalance(&world) < 0.01);
}

/// The dissertation's model: 16 nearest nodes both ways, volumes that exceed the body's, and forces
/// that still sum to nothing.
#[test]
fn the_dissertations_method_is_as_it_says() {
    let mut world = world(
        "stabilization: 0, model: SaintVenantKirchhoff",
        "method: Dissertation(), cut_rule: Grid(), damping: 10",
        "integration: (settle: None), gravity: (ramp: 0.1),
         cuts: [(edge: [(0, -0.03, 0), (0, 0.03, 0)], path: [
            (time: 0.15, position: (-0.03, 0, 0.003)), (time: 0.2, position: (0.001, 0, 0.003))])],",
    );
    let body = &world.bodies()[0];
    let (nodes, pairs) = (body.rest.len(), body.neighborhoods.pair_count());
    assert!((16 * nodes..22 * nodes).contains(&pairs), "{pairs} pairs");
    let volume: f64 = body.volumes.iter().sum();
    let ratio = volume / 1.28e-4;
    assert!((1.2..2.3).contains(&ratio), "{ratio} of the volume");
    play(&mut world, 0.3);
    let body = &world.bodies()[0];
    let forces = &body.motion().state().forces;
    let sum: DVec3 = forces.iter().sum();
    let size: f64 = forces.iter().map(|f| f.length()).sum();
    assert!(sum.length() < 1e-12 * size, "{sum} of {size} N");
    let cutting = body.cutting.as_ref().expect("it was cut");
    assert!(cutting.factors.crossed_count() > 100, "the grid weakens");
    assert!(imbalance(&world) < 1e-2, "{}", imbalance(&world));
}

#[test]
fn every_rule_parts_a_body_that_is_cut_through() {
    for rule in [
        "Diffraction()",
        "Visibility",
        "Grid()",
        "Grid(spacing: 0.001)",
    ] {
        let mut world = world(
            "",
            &format!("cut_rule: {rule}"),
            "integration: (settle: None), gravity: None,
             cuts: [(edge: [(0, -0.05, 0), (0, 0.05, 0)], path: [
                (time: 0, position: (-0.05, 0, 0.003)), (time: 0.01, position: (0.05, 0, 0.003))])],",
        );
        play(&mut world, 0.012);
        let pieces = world.bodies()[0].pieces();
        let whole = pieces.sizes.iter().filter(|size| **size > 12).count();
        assert_eq!(whole, 2, "{rule}: {:?}", pieces.sizes);
    }
}
