use super::*;
use crate::law::ClosureLaw;
use crate::testing::{Chain, Network, hung};
use crate::trajectory::Trajectory;
use testkit::assert_matches;
use testkit::cloud::uniform;
use testkit::tol::assert_below;

#[test]
fn newton_converges_quadratically_to_round_off() {
    let (mut network, rest, supports, loads) = hung();
    let mut x = rest.clone();
    let load = StaticLoad {
        forces: &loads,
        ..StaticLoad::default()
    };
    let settings = NewtonSettings::with_tolerance(1e-12);
    let report = solve_static(&mut network, &mut x, &supports, &load, &settings).unwrap();
    let last = report.steps.last().unwrap();
    assert!(last.relative_residual() < 1e-12, "{last:?}");
    // Quadratic: r_(k+1) <= C r_k^2 / scale once below a hundredth.
    let r: Vec<f64> = last.residuals.iter().map(|r| r / last.scale).collect();
    let quadratic = r.windows(2).filter(|w| w[0] < 1e-2 && w[0] > 1e-7);
    let mut seen = 0;
    for pair in quadratic {
        assert!(pair[1] < 60.0 * pair[0] * pair[0], "{r:?}");
        seen += 1;
    }
    assert!(seen >= 1, "passed through the quadratic range: {r:?}");
    let total: DVec3 = report.reactions.iter().map(|(_, f)| *f).sum();
    let load: DVec3 = loads.iter().sum();
    let off = (total + load).length();
    assert_below("reactions carry the load", off, 1e-9 * load.length());
}

#[test]
fn driven_supports_stretch_a_chain_evenly() {
    let mut chain = Chain::new(9, 3.0, 1.0);
    let rest = chain.rest.clone();
    let mut supports = BoundaryConditions::free(9);
    let path = Trajectory::ramp(0.0, 1.0, DVec3::X).unwrap();
    supports.drive(&[8], [true, true, true], path, &rest);
    let mut x = rest.clone();
    let load = StaticLoad {
        times: [0.0, 1.0],
        ..StaticLoad::default()
    };
    let settings = NewtonSettings::with_tolerance(1e-12);
    let report = solve_static(&mut chain, &mut x, &supports, &load, &settings).unwrap();
    for (i, (x, rest)) in x.iter().zip(&rest).enumerate() {
        let share = f64::from(u32::try_from(i + 1).unwrap()) / 9.0;
        let off = *x - *rest - DVec3::X * share;
        assert!(off.length() < 1e-11, "node {i}: {x}");
    }
    // Nine springs in a row pull back, the one behind the end pushes.
    let force = report.reactions[0].1.x;
    assert!((force - (3.0 / 9.0 + 3.0)).abs() < 1e-10, "{force}");
}

#[test]
fn errors_say_what_is_missing() {
    let mut network = Network::complete(&uniform(4, 1.0, 2), 1.0);
    let mut x = uniform(4, 1.0, 2);
    x[3] = x[2];
    let free = BoundaryConditions::free(4);
    let error = solve_static(
        &mut network,
        &mut x,
        &free,
        &StaticLoad::default(),
        &NewtonSettings::default(),
    );
    assert_matches!(error, Err(SolveError::NotFinite { .. }));
    let mut x = uniform(4, 1.0, 2);
    let loads = [DVec3::X; 4];
    let load = StaticLoad {
        forces: &loads,
        ..StaticLoad::default()
    };
    let settings = NewtonSettings {
        iterations: 3,
        ..NewtonSettings::default()
    };
    let error = solve_static(&mut network, &mut x, &free, &load, &settings).unwrap_err();
    assert!(error.to_string().contains("supports"), "{error}");
}

/// A node on a stiffening spring to a support that is carried far: the first iterate follows the support with a residual of a
/// hundred times the force at rest. What is accepted is small against the latter, not against that iterate's.
#[test]
fn iterates_on_the_way_do_not_loosen_the_tolerance() {
    // Energy x⁴/4 of the distance from the support, and a weak spring to where it was.
    let mut at = [DVec3::ZERO; 2];
    let mut law = ClosureLaw::of(
        &mut at,
        |at, x, f| {
            at.copy_from_slice(x);
            let (d, own) = (x[1] - x[0], x[1]);
            f[0] = d * d.length_squared();
            f[1] = -f[0] - own * 1e-2;
            0.25 * d.length_squared().powi(2) + 5e-3 * own.length_squared()
        },
        |at, v, out| {
            let d = at[1] - at[0];
            let moved = v[1] - v[0];
            let change = moved * d.length_squared() + d * (2.0 * d.dot(moved));
            (out[0], out[1]) = (-change, change + v[1] * 1e-2);
        },
    );
    let mut supports = BoundaryConditions::free(2);
    let path = Trajectory::ramp(0.0, 1.0, DVec3::X * 10.0).unwrap();
    supports.drive(&[0], [true, true, true], path, &[DVec3::ZERO; 2]);
    let load = StaticLoad {
        times: [0.0, 1.0],
        ..StaticLoad::default()
    };
    let settings = NewtonSettings::with_tolerance(1e-3);
    let mut x = vec![DVec3::ZERO; 2];
    let report = solve_static(&mut law, &mut x, &supports, &load, &settings).unwrap();
    let step = report.steps.last().unwrap();
    let (held, largest) = (
        x[1].length() * 1e-2,
        step.residuals.iter().copied().fold(0.0, f64::max),
    );
    assert!(largest > 100.0 * held, "{largest} N, at rest {held} N");
    let left = step.residuals.last().unwrap();
    assert!(*left <= 1.1e-3 * held, "{left} N of {held} N");
}
