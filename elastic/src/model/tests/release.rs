//! Energy release rates; `benches -- griffith` compares them with those of a load.

use super::*;
use crate::CrackFront;

const FRONT: CrackFront = CrackFront {
    at: DVec3::new(0.19, 0.21, 0.2),
    ahead: DVec3::X,
    along: DVec3::Y,
};

/// The rate where nodes of a block are at `x`, with a modulus (Pa).
fn rate(modulus: f64, x: impl Fn(DVec3) -> DVec3) -> f64 {
    let block = Block::new([7, 7, 7], DVec3::splat(0.4), 0.2, 5);
    let mut body = model(&block, Material::stable_neo_hookean(modulus, 0.4), 0.1);
    let at: Vec<DVec3> = block.positions.iter().map(|p| x(*p)).collect();
    let mut forces = vec![DVec3::ZERO; at.len()];
    body.forces_into(&at, &mut forces);
    body.energy_release_rate(&FRONT, 0.15, |_| true)
}

fn bent(x: DVec3) -> DVec3 {
    x + DVec3::new(0.2 * x.x * x.z, 0.1 * x.y * x.x, -0.15 * x.x * x.x)
}

/// Where strain is the same everywhere nothing would be released, however large it is.
#[test]
fn a_uniform_strain_releases_nothing() {
    let uneven = rate(1e4, bent).abs();
    let f = DMat3::from_cols_array(&[1.3, 0.1, 0.0, -0.2, 0.9, 0.1, 0.1, 0.0, 1.1]);
    assert_below("uniform", rate(1e4, |x| f * x).abs(), 1e-9 * uneven);
}

/// It is in proportion to the modulus, and the same in a body that is turned and moved.
#[test]
fn a_turned_body_has_the_same_rate() {
    let turn = DQuat::from_scaled_axis(DVec3::new(0.4, -1.2, 0.7));
    let one = rate(1e4, bent);
    let turned = rate(1e4, |x| turn * bent(x) + DVec3::new(3.0, -1.0, 2.0));
    assert_within("turned", turned, one, 1e-9 * one.abs());
    assert_within("stiffer", rate(2.5e4, bent), 2.5 * one, 1e-9 * one.abs());
    assert!(one != 0.0);
}

/// The front is felt in the body alone, and nothing is where no node is near.
#[test]
fn only_the_front_in_the_body_counts() {
    let block = Block::new([7, 7, 7], DVec3::splat(0.4), 0.2, 5);
    let mut body = model(&block, Material::stable_neo_hookean(1e4, 0.4), 0.1);
    let at: Vec<DVec3> = block.positions.iter().map(|p| bent(*p)).collect();
    body.forces_into(&at, &mut vec![DVec3::ZERO; at.len()]);
    let whole = body.energy_release_rate(&FRONT, 0.15, |_| true);
    let half = body.energy_release_rate(&FRONT, 0.15, |x| x.y < FRONT.at.y);
    assert_within("half of the front", half, 2.0 * whole, 1e-9 * whole.abs());
    let far = CrackFront {
        at: DVec3::splat(9.0),
        ..FRONT
    };
    assert!(body.energy_release_rate(&far, 0.15, |_| true) == 0.0);
    assert!(body.energy_release_rate(&FRONT, 0.15, |_| false) == 0.0);
}

/// Without balance the integral is `-∫ q Div P · (F - F̄) d dV` (by parts, with `∂_l F_km = ∂_m F_kl`). For `u = a x³` along x, small,
/// about `x = c`, that is a number. An oblique front gains less area, so its rate is larger.
#[test]
fn it_has_the_sign_and_size_of_its_integral() {
    let block = Block::new([16, 16, 16], DVec3::splat(0.4), 0.1, 5);
    let law = Material::stable_neo_hookean(1e4, 0.3);
    let modulus = law.lame_lambda() + 2.0 * law.lame_mu();
    let (a, c, radius) = (1e-2, 0.2_f64, 0.1_f64);
    let at = block
        .positions
        .iter()
        .map(|p| *p + DVec3::X * (a * p.x.powi(3)));
    let at: Vec<DVec3> = at.collect();
    let front = CrackFront {
        at: DVec3::splat(c),
        ..FRONT
    };
    // ∫ q x² = 32 π R⁵/945, ∫ q = 32 π R³/105, mean x² = R²/5, ∫ q ds = 16 R/15.
    let squares = 3.0 * 32.0 / 945.0 - 32.0 / 525.0;
    let integral = 18.0 * a * a * c * modulus * std::f64::consts::PI * squares * radius.powi(5);
    let expected = -integral / (16.0 / 15.0 * radius);
    let oblique = CrackFront {
        along: (DVec3::X + DVec3::Y).normalize(),
        ..front
    };
    // Means over neighbours smooth the volume, and so the field; without what their pressure holds it is 15 times as large.
    for (settings, off) in [(controlled(0.1), 0.05), (mean(), 0.2)] {
        let mut body = built(&block, law, &settings);
        body.forces_into(&at, &mut vec![DVec3::ZERO; at.len()]);
        let [found, more] =
            [front, oblique].map(|front| body.energy_release_rate(&front, radius, |_| true));
        assert_within("in a cubic field", found, expected, off * expected.abs());
        assert_within("oblique", more, found * 2.0_f64.sqrt(), 1e-9 * found.abs());
    }
}
