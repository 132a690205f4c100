use super::*;
use crate::contact::pressed::Pressed;
use crate::equilibrium::{StaticLoad, solve_static};
use crate::implicit::{Implicit, ImplicitScheme, ImplicitSettings};
use crate::motion::{Motion, MotionSettings};
use crate::newton::{NewtonSettings, SolveError};
use crate::shape::RigidShape;
use crate::supports::BoundaryConditions;
use crate::testing::{Network, damped, plate};
use crate::tool::{Drive, RigidTool};
use crate::trajectory::{Ease, Trajectory};
use testkit::cloud::Random;
use testkit::derivative::directional_error;

const FLOOR: RigidShape = RigidShape::Plane { normal: DVec3::Z };

fn contact(friction: f64) -> (Contact, Vec<DVec3>) {
    crate::testing::contact(4, 50.0, friction)
}

#[test]
fn static_friction_sticks_below_the_limit_and_slides_at_it() {
    let friction = 0.4;
    for (shift, slides) in [(0.01, false), (0.5, true)] {
        let (mut contact, rest) = contact(friction);
        let mut law = Network::complete(&rest, 30.0);
        // Held across, free along x but for the springs to the outer row.
        let mut supports = BoundaryConditions::fixed(9, &[0, 3, 6]);
        for node in [1, 2, 4, 5, 7, 8] {
            supports.fix_axes(node, [false, true, true]);
        }
        let mut x = rest.clone();
        let settings = NewtonSettings::default();
        let mut last = ContactForce::default();
        let load = StaticLoad::default();
        for pose in [plate(0.0), plate(shift)] {
            for round in 0..20 {
                let mut law = Pressed::new(&mut law, &mut contact, FLOOR, pose);
                solve_static(&mut law, &mut x, &supports, &load, &settings).unwrap();
                last = law.tool_forces[0];
                if contact.lag_friction() < 1e-9 && round > 0 {
                    break;
                }
            }
            contact.settle_friction(&pose);
        }
        // The plate pulls the net along; the net holds it back.
        let (pull, press) = (-last.force.x, last.force.z);
        assert!((press - 4.0 * 50.0 * 0.1).abs() < 1e-9, "{last:?}");
        if slides {
            assert!((pull / press - friction).abs() < 1e-6, "{pull} {press}");
        } else {
            assert!(
                pull > 0.0 && pull < 0.9 * friction * press,
                "{pull} {press}"
            );
            let moved = x[4].x - rest[4].x;
            assert!(moved > 0.0 && moved < shift, "dragged along: {moved}");
        }
    }
}

#[test]
fn implicit_steps_with_friction_agree_with_explicit_ones() {
    let keys = vec![
        (0.0, DVec3::ZERO),
        (1.0, DVec3::new(0.0, 0.0, -0.3)),
        (3.0, DVec3::new(0.4, 0.0, -0.3)),
    ];
    let path = Trajectory::translation(keys, Ease::Smooth).unwrap();
    let origin = Pose::at(DVec3::new(1.1, 0.9, 0.65));
    let shape = RigidShape::Sphere { radius: 0.6 };
    let settings = damped(2.0);
    let supports = BoundaryConditions::fixed(9, &[0, 2, 6, 8]);
    let run = |friction: f64, steps: u32, implicit: bool| {
        let (contact, rest) = contact(friction);
        let mut law = Network::complete(&rest, 30.0);
        let mut motion = Motion::new(&rest, &[1.0; 9], supports.clone(), settings).unwrap();
        let mut tool = RigidTool::on_path(shape, origin, path.clone(), contact);
        let step = 3.0 / f64::from(steps);
        let newton = NewtonSettings::default();
        let scheme = ImplicitScheme::EnergyMomentum;
        let mut solver = Implicit::new(ImplicitSettings { scheme, newton }).unwrap();
        for _ in 0..steps {
            if implicit {
                let tools = &mut [&mut tool];
                solver
                    .step_with(&mut motion, step, &mut law, tools)
                    .unwrap();
            } else {
                let press = &mut |view: &crate::StepView<'_>, f: &mut [DVec3]| {
                    tool.press(view, f);
                };
                let forces = |x: &[DVec3], f: &mut [DVec3]| law.forces(x, f);
                motion.step_with(step, forces, press).unwrap();
            }
        }
        (motion, tool)
    };
    let (explicit, pushed) = run(0.5, 6000, false);
    let (implicit, tool) = run(0.5, 300, true);
    let (_, smooth) = run(0.0, 300, true);
    let along = |tool: &RigidTool| tool.load.force.x;
    assert!(
        (along(&tool) - along(&smooth)).abs() > 0.1,
        "friction is felt: {} {}",
        along(&tool),
        along(&smooth)
    );
    let difference = (tool.load.force - pushed.load.force).length();
    let size = pushed.load.force.length();
    assert!(difference < 0.02 * size, "{difference} of {size}");
    let pairs = implicit.positions().iter().zip(explicit.positions());
    let apart = pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(apart < 5e-3, "{apart}");
    // Kinetic, elastic and rubbed off are what the tool gave, nothing more.
    let audit = implicit.audit();
    assert!(audit.applied_work > 0.0, "{audit:?}");
    assert!(
        audit.energy_error() < 0.02 * audit.applied_work,
        "{audit:?}"
    );
}

#[test]
fn what_implicit_steps_cannot_do_is_refused() {
    let (contact, rest) = contact(0.0);
    let mut law = Network::complete(&rest, 30.0);
    let settings = MotionSettings::default();
    let mut motion = Motion::new(&rest, &[1.0; 9], BoundaryConditions::free(9), settings).unwrap();
    let drive = Drive::Force {
        mass: 1.0,
        force: DVec3::ZERO,
        damping: 0.0,
    };
    let mut tool = RigidTool::new(FLOOR, Pose::at(DVec3::Z * -9.0), drive, contact);
    let mut solver = Implicit::new(ImplicitSettings::default()).unwrap();
    let tools = &mut [&mut tool];
    let error = solver.step_with(&mut motion, 0.1, &mut law, tools);
    let refused = SolveError::ForceDrivenTool { tool: 0 };
    assert_eq!(error, Err(refused), "force-driven tool");
    assert!(refused.to_string().contains("explicit"), "{refused}");
    let settings = MotionSettings {
        viscosity: 0.1,
        ..settings
    };
    let mut motion = Motion::new(&rest, &[1.0; 9], BoundaryConditions::free(9), settings).unwrap();
    let error = solver.step(&mut motion, 0.1, &mut law);
    assert_eq!(
        error,
        Err(SolveError::Viscosity { viscosity: 0.1 }),
        "viscosity"
    );
}

/// Lagged friction and pressure are the derivative of one energy, also where points leave the tool, and end after the step in
/// which they do.
#[test]
fn lagged_friction_has_a_potential() {
    let mut random = Random::new(3);
    let shape = RigidShape::Sphere { radius: 0.6 };
    let pose = Pose::at(DVec3::new(1.1, 0.9, 0.5));
    let mut left = 0;
    for _ in 0..40 {
        let (mut contact, rest) = contact(0.5);
        let mut f = vec![DVec3::ZERO; 9];
        contact.add_all(&shape, &pose, &rest, &mut f, Some(Limit::Lagged));
        contact.settle_friction(&pose);
        let down = DVec3::Z * random.range(0.0, 0.1);
        let x: Vec<DVec3> = rest
            .iter()
            .map(|x| *x - down + random.vector(0.03))
            .collect();
        let direction = rest.iter().map(|_| random.vector(1.0)).collect::<Vec<_>>();
        let mut press = |t: f64| {
            let mut f = vec![DVec3::ZERO; 9];
            let x: Vec<DVec3> = x.iter().zip(&direction).map(|(x, d)| *x + *d * t).collect();
            let sum = contact.add_all(&shape, &pose, &x, &mut f, Some(Limit::Lagged));
            let leave = contact
                .points()
                .iter()
                .filter(|point| point.pressure == 0.0);
            (sum, f, leave.count())
        };
        let (sum, forces, leave) = press(0.0);
        left += leave;
        let slope: f64 = -forces
            .iter()
            .zip(&direction)
            .map(|(f, d)| f.dot(*d))
            .sum::<f64>();
        let error = directional_error(|t| press(t).0.energy, slope, 1e-6, 1e-3);
        assert!(error < 1e-5, "{error}");
        contact.settle_friction(&pose);
        let pressed = contact.points().iter().all(|point| point.pressure > 0.0);
        assert!(pressed, "{sum:?}");
        assert_eq!(contact.sticking.len(), contact.points().len());
    }
    assert!(left > 40, "{left} points left the tool");
}
