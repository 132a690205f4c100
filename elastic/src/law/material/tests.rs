//! Stress against energy, tangent against stress, closed forms, inversion.

use glam::{DMat3, DQuat, DVec3};
use testkit::cloud::Random;
use testkit::derivative::central_sweep;
use testkit::tol::{assert_below, assert_within};

use super::*;
use crate::law::tensor::{double_dot, outer};

fn materials() -> Vec<(&'static str, Material)> {
    let (neo, stable) = (Material::neo_hookean, Material::stable_neo_hookean);
    let (green, mooney) = (Material::saint_venant_kirchhoff, Material::mooney_rivlin);
    let spread = mooney(3.0, 0.4, 0.2).with_fiber(fiber(0.2));
    vec![
        ("neo-hookean", neo(3.0, 0.4)),
        ("stable", stable(3.0, 0.45)),
        (
            "stable + volume",
            stable(3.0, 0.2).with_volume_constant(2.0),
        ),
        ("stable + barrier", stable(3.0, 0.3).with_barrier(20.0)),
        ("neo + barrier", neo(3.0, 0.4).with_barrier(20.0)),
        ("svk + barrier", green(3.0, 0.3).with_barrier(20.0)),
        ("svk", green(3.0, 0.3)),
        ("mooney", mooney(3.0, 0.45, 0.4)),
        ("svk + volume", green(3.0, 0.3).with_volume_constant(7.0)),
        ("neo + fibers", neo(3.0, 0.4).with_fiber(fiber(0.0))),
        ("mooney + spread fibers", spread),
        ("neo + volume", neo(3.0, 0.2).with_volume_constant(2.0)),
    ]
}

fn fiber(dispersion: f64) -> Fiber {
    Fiber {
        direction: DVec3::new(1.0, 2.0, 2.0),
        stiffness: 2.0,
        exponent: 1.5,
        dispersion,
    }
}

fn term(ratio: f64, relaxation_time: f64) -> PronyTerm {
    PronyTerm {
        ratio,
        relaxation_time,
    }
}

fn random_matrix(random: &mut Random, half: f64) -> DMat3 {
    let [x, y, z] = [(); 3].map(|()| random.vector(half));
    DMat3::from_cols(x, y, z)
}

#[test]
fn stress_and_tangent_are_derivatives() {
    let mut random = Random::new(11);
    let flat = |m: DMat3| m.to_cols_array().to_vec();
    for (name, material) in materials() {
        let (mut orders, mut seams) = (0, 0);
        for round in 0..40 {
            // Half of the states far out, some of them inverted.
            let half = if round % 2 == 0 { 0.25 } else { 1.0 };
            let f = DMat3::IDENTITY + random_matrix(&mut random, half);
            let d = random_matrix(&mut random, 1.0);
            let k = random_matrix(&mut random, 1.0);
            let dp = material.stress_change(f, d);
            let back = double_dot(d, material.stress_change(f, k));
            let there = double_dot(k, dp);
            assert_within(name, back, there, 1e-12 * there.abs().max(100.0));
            // The extension is twice differentiable only, and so are fibers where they go slack or
            // pass their largest exponent: no order-2 decrease across such a seam.
            let near = |seam: f64| (f.determinant() - seam).abs() < 0.05;
            let seam = near(0.1)
                || (material.barrier > 0.0 && (near(0.4) || near(0.0)))
                || material.fiber.is_some_and(|fiber| {
                    let along = (f * fiber.direction).length_squared() - 1.0;
                    let kappa = fiber.dispersion;
                    let strain = kappa * (double_dot(f, f) - 3.0) + (1.0 - 3.0 * kappa) * along;
                    strain.abs() < 0.2 || (strain - (20.0_f64 / 1.5).sqrt()).abs() < 0.2
                });
            let (_, p) = material.energy_and_stress(f);
            let along = |t: f64| material.energy_and_stress(f + d * t);
            let stress = central_sweep(|t| vec![along(t).0], &[double_dot(p, d)], 1e-2, 1.0);
            let tangent = central_sweep(|t| flat(along(t).1), &flat(dp), 1e-2, 1.0);
            seams += u32::from(seam);
            for (what, sweep, most) in [("stress", stress, 1e-8), ("tangent", tangent, 1e-2)] {
                let what = format!("{name}: {what}");
                if seam {
                    assert_below(&what, sweep.smallest(), most);
                } else {
                    orders += sweep.assert_second_order(&what, 1e-8);
                }
            }
        }
        let seen = orders > 60 && seams < 20;
        assert!(seen, "{name}: {orders} orders, {seams} seams");
    }
}

/// Of states far out and inverted, too.
#[test]
fn rotation_costs_nothing_and_turns_the_stress() {
    let mut random = Random::new(5);
    for (name, material) in materials() {
        for round in 0..40 {
            let rotation = DMat3::from_quat(DQuat::from_scaled_axis(random.vector(3.0)));
            let (energy, stress) = material.energy_and_stress(rotation);
            assert_within(name, energy, 0.0, 1e-13);
            assert!(stress.abs_diff_eq(DMat3::ZERO, 1e-13), "{name}: {stress}");
            let half = if round % 2 == 0 { 0.3 } else { 1.0 };
            let f = DMat3::IDENTITY + random_matrix(&mut random, half);
            let (e0, p0) = material.energy_and_stress(f);
            let (e1, p1) = material.energy_and_stress(rotation * f);
            assert_within(name, e0, e1, 1e-12 * e0.abs().max(10.0));
            let size = double_dot(p0, p0).sqrt().max(10.0);
            assert!(p1.abs_diff_eq(rotation * p0, 1e-12 * size), "{name}");
        }
    }
}

#[test]
fn small_strain_moduli_are_those_asked_for() {
    let mut random = Random::new(6);
    for (name, material) in materials() {
        if material.fiber.is_some() {
            continue;
        }
        let mu = material.lame_mu();
        let lambda = material.lame_lambda() + material.volume_constant;
        let d = random_matrix(&mut random, 1.0);
        let strain = (d + d.transpose()) * 0.5;
        let trace = strain.x_axis.x + strain.y_axis.y + strain.z_axis.z;
        let hooke = strain * (2.0 * mu) + DMat3::from_diagonal(DVec3::splat(lambda * trace));
        let change = material.stress_change(DMat3::IDENTITY, d);
        assert!(change.abs_diff_eq(hooke, 1e-12), "{name}: {change} {hooke}");
    }
}

#[test]
fn inversion_is_pushed_back() {
    for (name, material) in materials() {
        let logarithmic = !matches!(material.law, Law::SaintVenantKirchhoff { .. });
        if !logarithmic && material.volume_constant == 0.0 {
            continue;
        }
        for j in [0.05_f64, 0.0, -0.3, -1.0] {
            let f = DMat3::from_diagonal(DVec3::new(1.0, 1.0, j));
            let (energy, stress) = material.energy_and_stress(f);
            let held = energy.is_finite() && energy > 0.0;
            assert!(held, "{name} at {j}: {energy}");
            // Negative: more stretch along z lowers the energy.
            if logarithmic || j > 0.0 {
                assert!(stress.z_axis.z < 0.0, "{name} at {j}: {stress}");
            }
        }
    }
}

/// Nothing above a volume ratio of 0.4; below, the energy, stress and tangent that its formula says, and below zero a constant
/// pressure.
#[test]
fn the_barrier_is_its_formula() {
    let plain = Material::stable_neo_hookean(3.0, 0.3);
    let barred = plain.with_barrier(20.0);
    for j in [-1.5_f64, -0.2, 0.0, 0.01, 0.2, 0.39, 0.4, 0.41, 1.0, 3.0] {
        let f = DMat3::from_diagonal(DVec3::new(1.0, 1.0, j));
        let ((w0, p0), (w1, p1)) = (plain.energy_and_stress(f), barred.energy_and_stress(f));
        let d = DMat3::from_diagonal(DVec3::Z);
        let tangent = |m: &Material| m.stress_change(f, d).z_axis.z;
        let t = ((0.4 - j) / 0.4).clamp(0.0, 1.0);
        let energy = 0.4 * (t.powi(3) - 0.5 * t.powi(4)) + (-j).max(0.0);
        let slope = -(3.0 * t * t - 2.0 * t.powi(3));
        let curvature = 6.0 * t * (1.0 - t) / 0.4;
        assert_within("energy", w1 - w0, 20.0 * energy, 1e-12);
        assert_within("stress", p1.z_axis.z - p0.z_axis.z, 20.0 * slope, 1e-12);
        let bend = tangent(&barred) - tangent(&plain);
        assert_within("tangent", bend, 20.0 * curvature, 1e-12);
        if j >= 0.4 {
            assert_eq!((w1.to_bits(), p1), (w0.to_bits(), p0), "at {j}");
        }
    }
}

/// By the name and the value that were given.
#[test]
fn bad_parameters_are_named() {
    let soft = Material::neo_hookean(1.0, 0.3);
    let slack = Fiber {
        direction: DVec3::ZERO,
        ..fiber(0.0)
    };
    let mut bad = vec![
        (
            Material::mooney_rivlin(1.0, 0.1, 0.9),
            "lame_lambda",
            0.1 / 0.88,
        ),
        (Material::mooney_rivlin(1.0, 0.4, -0.1), "c01", -0.05 / 2.8),
        (soft.with_volume_constant(-1.0), "volume_constant", -1.0),
        (soft.with_barrier(-2.0), "barrier", -2.0),
        (soft.with_fiber(fiber(0.4)), "fiber.dispersion", 0.4),
        (soft.with_fiber(slack), "fiber.direction", 0.0),
        (
            soft.with_prony(&[term(0.5, 0.0)]),
            "prony.relaxation_time",
            0.0,
        ),
    ];
    for law in [Material::neo_hookean, Material::saint_venant_kirchhoff] {
        for modulus in [-1.0, 0.0, f64::INFINITY, f64::NAN] {
            bad.push((law(modulus, 0.3), "Young's modulus", modulus));
        }
        for ratio in [0.5, 0.75, -1.5] {
            bad.push((law(1e3, ratio), "Poisson's ratio", ratio));
        }
    }
    for (material, name, given) in bad {
        let refused = material.validate(4).expect_err("a bad parameter");
        let ElasticError::BadMaterial {
            material: 4,
            parameter,
            value,
            ..
        } = refused
        else {
            panic!("{material:?}: {refused}");
        };
        assert_eq!(parameter, name);
        let near = (value - given).abs() < 1e-12 || value.total_cmp(&given).is_eq();
        let same = near || (value.is_nan() && given.is_nan());
        assert!(same, "{name}: {value} for {given}");
    }
}

/// Along the fibers a stretch `l` meets `2 l psi'`, some `4 k1 (l - 1)`, across them nothing.
#[test]
fn fibers_stiffen_their_direction_only() {
    let plain = Material::neo_hookean(3.0, 0.4);
    let fibrous = plain.with_fiber(fiber(0.0));
    let a = DVec3::new(1.0, 2.0, 2.0) / 3.0;
    let across = a.any_orthonormal_vector();
    let stretch = |direction: DVec3, by: f64| {
        let f = DMat3::IDENTITY + outer(direction, direction) * by;
        let pull = |m: &Material| direction.dot(m.energy_and_stress(f).1 * direction);
        pull(&fibrous) - pull(&plain)
    };
    let by: f64 = 2e-3;
    let e = (1.0 + by).powi(2) - 1.0;
    let expected = 2.0 * (1.0 + by) * 2.0 * e * (1.5 * e * e).exp();
    assert_within("along", stretch(a, by), expected, 1e-12);
    assert_within("slack", stretch(a, -0.1), 0.0, 0.0);
    assert_within("across", stretch(across, 0.3), 0.0, 1e-13);
    assert!(stretch(a, 0.4) > 2.0 * stretch(a, 0.2), "no stiffening");
    assert!(stretch(a, 50.0).is_finite());
}

/// Below a strain of 3e-3 the fibres' stiffness rises from 0 without a jump, above the stress is the formula's; energy is the
/// stress's integral, for exponents however large.
#[test]
fn fibers_straighten_without_a_jump() {
    for exponent in [1e-3, 1.5, 1e5] {
        let fiber = Fiber {
            exponent,
            ..fiber(0.0)
        };
        let material = Material::neo_hookean(0.0, 0.0).with_fiber(fiber);
        let a = fiber.direction.normalize();
        let step = 1e-6;
        let at = |e: f64| {
            let f = DMat3::IDENTITY + outer(a, a) * ((1.0 + e).sqrt() - 1.0);
            // Along the gradient of E, `2 F a a'`.
            let along = f * outer(a, a);
            let (psi, p) = material.energy_and_stress(f);
            let change = double_dot(along, material.stress_change(f, along));
            let psi1 = 0.5 * double_dot(p, along) / double_dot(along, along);
            (psi, psi1, change)
        };
        for number in -500..8000 {
            let e = (f64::from(number) + 0.5) * step;
            let (now, next) = (at(e), at(e + step));
            let what = format!("E {e}, exponent {exponent}");
            let work = 0.5 * step * (now.1 + next.1);
            assert_within(&what, next.0 - now.0, work, 1e-12 + 1e-5 * work);
            assert!(
                (next.2 - now.2).abs() <= 0.1 * now.2.max(1.0),
                "{what}: {} and {}",
                now.2,
                next.2
            );
            if e > 3e-3 {
                let formula = 2.0 * e * (exponent * e * e).exp();
                assert_within(&what, now.1, formula, 1e-9 * formula);
            }
        }
    }
}

/// Round-off of a rotation does not choose between taut and slack.
#[test]
fn fibers_at_rest_resist_as_stretched_ones_in_every_frame() {
    let plain = Material::neo_hookean(3.0, 0.4);
    let fibrous = plain.with_fiber(fiber(0.0));
    let a = DVec3::new(1.0, 2.0, 2.0) / 3.0;
    let mut random = Random::new(41);
    for _ in 0..100 {
        let turn = DMat3::from_quat(DQuat::from_scaled_axis(random.vector(3.0)));
        let along = turn * outer(a, a);
        let change = |m: &Material| double_dot(along, m.stress_change(turn, along));
        assert_within("along", change(&fibrous) - change(&plain), 8.0, 1e-12);
    }
}

/// A material of every part, and settings, come back as they were written.
#[cfg(feature = "serde")]
#[test]
fn materials_and_settings_survive_being_written() {
    let material = Material::mooney_rivlin(5e3, 0.45, 0.3)
        .with_volume_constant(7.0)
        .with_prony(&[term(0.4, 0.1)]);
    let settings = crate::Settings {
        dilatation: crate::Dilatation::Mean,
        ..crate::Settings::default()
    };
    let text = ron::to_string(&(material, settings)).unwrap();
    assert_eq!(ron::from_str(&text), Ok((material, settings)));
}
