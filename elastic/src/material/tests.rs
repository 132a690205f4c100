//! Stress against energy, tangent against stress, closed forms, inversion.

use glam::{DMat3, DQuat, DVec3};
use testkit::cloud::Random;
use testkit::derivative::directional_error;
use testkit::tol::{assert_below, assert_within};

use super::*;

fn materials() -> Vec<(&'static str, Material)> {
    vec![
        ("neo-hookean", Material::neo_hookean(3.0, 0.4)),
        ("svk", Material::saint_venant_kirchhoff(3.0, 0.3)),
        ("mooney", Material::mooney_rivlin(3.0, 0.45, 0.4)),
        (
            "svk + volume",
            Material::saint_venant_kirchhoff(3.0, 0.3).with_volume_constant(7.0),
        ),
        (
            "neo + volume",
            Material::neo_hookean(3.0, 0.2).with_volume_constant(2.0),
        ),
    ]
}

fn random_matrix(random: &mut Random, half: f64) -> DMat3 {
    DMat3::from_cols(
        random.vector(half),
        random.vector(half),
        random.vector(half),
    )
}

#[test]
fn stress_and_tangent_are_derivatives() {
    let mut random = Random::new(11);
    for (name, material) in materials() {
        for round in 0..40 {
            // Half of the states far out, some of them inverted.
            let half = if round % 2 == 0 { 0.25 } else { 1.0 };
            let f = DMat3::IDENTITY + random_matrix(&mut random, half);
            let d = random_matrix(&mut random, 1.0);
            let (_, p) = material.energy_and_stress(f);
            let error = directional_error(
                |t| material.energy_and_stress(f + d * t).0,
                double_dot(p, d),
                1e-2,
                1.0,
            );
            assert_below(&format!("{name}: stress"), error, 1e-8);
            let k = random_matrix(&mut random, 1.0);
            let dp = material.stress_change(f, d);
            let error = directional_error(
                |t| double_dot(k, material.energy_and_stress(f + d * t).1),
                double_dot(k, dp),
                1e-2,
                1.0,
            );
            // The extension is twice differentiable only: no order-2 decrease across its seam.
            let seam = (f.determinant() - 0.1).abs() < 0.02;
            assert_below(
                &format!("{name}: tangent"),
                error,
                if seam { 1e-2 } else { 1e-7 },
            );
            let back = double_dot(d, material.stress_change(f, k));
            let there = double_dot(k, dp);
            assert_within(name, back, there, 1e-12 * there.abs().max(100.0));
        }
    }
}

#[test]
fn rotation_costs_nothing_and_turns_the_stress() {
    let mut random = Random::new(5);
    for (name, material) in materials() {
        let rotation = DMat3::from_quat(DQuat::from_axis_angle(DVec3::X, 2.0));
        let (energy, stress) = material.energy_and_stress(rotation);
        assert_within(name, energy, 0.0, 1e-13);
        assert!(stress.abs_diff_eq(DMat3::ZERO, 1e-13), "{name}: {stress}");
        let f = DMat3::IDENTITY + random_matrix(&mut random, 0.3);
        let (e0, p0) = material.energy_and_stress(f);
        let (e1, p1) = material.energy_and_stress(rotation * f);
        assert_within(name, e0, e1, 1e-13 * e0.max(1.0));
        assert!(p1.abs_diff_eq(rotation * p0, 1e-12), "{name}");
    }
}

#[test]
fn small_strain_moduli_are_those_asked_for() {
    let mut random = Random::new(6);
    for (name, material) in materials() {
        let (mu, lambda) = (
            material.lame_mu(),
            material.lame_lambda() + material.volume_constant,
        );
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
            assert!(
                energy.is_finite() && energy > 0.0,
                "{name} at {j}: {energy}"
            );
            // Negative: more stretch along z lowers the energy.
            if logarithmic || j > 0.0 {
                assert!(stress.z_axis.z < 0.0, "{name} at {j}: {stress}");
            }
        }
    }
}

#[test]
fn bad_parameters_are_named() {
    let bad = [
        Material::neo_hookean(-1.0, 0.3),
        Material::neo_hookean(1.0, 0.5),
        Material::neo_hookean(1.0, -1.5),
        Material::neo_hookean(f64::NAN, 0.3),
        Material::mooney_rivlin(1.0, 0.1, 0.9),
        Material::mooney_rivlin(1.0, 0.4, -0.1),
        Material::neo_hookean(1.0, 0.3).with_volume_constant(-1.0),
    ];
    for material in bad {
        assert!(
            matches!(
                material.validate(4),
                Err(ElasticError::BadMaterial { material: 4, .. })
            ),
            "{material:?}"
        );
    }
}
