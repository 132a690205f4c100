//! Closed forms of cracks under unit stress (1 Pa) in bodies of half width 1, or of width 1 with an edge crack.

use std::f64::consts::PI;

use super::{POISSON, YOUNG, plane_modulus};

/// `K_I` of an edge crack (Tada, Paris, Irwin: within 0.5 %).
pub fn edge_intensity(a: f64) -> f64 {
    let shape = 1.12 - 0.231 * a + 10.55 * a.powi(2) - 21.72 * a.powi(3) + 30.39 * a.powi(4);
    shape * (PI * a).sqrt()
}

/// Opening (m) of its mouth (Tada, Paris, Irwin: within 1 %).
pub fn edge_mouth(a: f64) -> f64 {
    let cos = (0.5 * PI * a).cos();
    4.0 * a * (1.46 + 3.42 * (1.0 - cos)) / (cos * cos) / plane_modulus()
}

/// `K_I` of a centre crack (Tada, Paris, Irwin: within 0.1 %).
pub fn centre_intensity(a: f64) -> f64 {
    let wide = (0.5 * PI * a).cos().recip().sqrt();
    (PI * a).sqrt() * wide * (1.0 - 0.025 * a * a + 0.06 * a.powi(4))
}

/// Opening (m) of its middle (Tada, Paris, Irwin: within 0.6 %).
pub fn centre_mouth(a: f64) -> f64 {
    let shape = -0.071 - 0.535 * a + 0.169 * a * a + 0.020 * a.powi(3) - 1.071 * (1.0 - a).ln() / a;
    4.0 * a * shape / plane_modulus()
}

/// `K_III` of a centre crack in a long strip: exact.
pub fn tearing_intensity(a: f64) -> f64 {
    (2.0 * (0.5 * PI * a).tan()).sqrt()
}

/// `K_I` and `K_II` at an arc of radius `r` (m) and half angle `half` (rad) in an infinite plane under all-round
/// tension (Sih, Paris, Erdogan 1962).
pub fn arc_intensities(r: f64, half: f64) -> [f64; 2] {
    let (s, c) = (0.5 * half).sin_cos();
    let scale = (PI * r * half.sin()).sqrt() / (1.0 + s * s);
    [scale * c, scale * s]
}

/// Work (J/m) that a crack adds to that of constant loads, `2 ∫ G da` over each of its `tips`, with
/// `G = K² / modulus`.
pub fn crack_work(a: f64, tips: f64, modulus: f64, intensity: impl Fn(f64) -> f64) -> f64 {
    // Simpson's rule; K² grows nearly in proportion to a.
    const PARTS: u32 = 200;
    let step = a / f64::from(PARTS);
    let rate = |k: u32| {
        let at = f64::from(k) * step;
        if k == 0 {
            0.0
        } else {
            intensity(at).powi(2) / modulus
        }
    };
    let pairs = (0..PARTS / 2).map(|k| rate(2 * k) + 4.0 * rate(2 * k + 1) + rate(2 * k + 2));
    2.0 * tips * pairs.sum::<f64>() * step / 3.0
}

/// Work (J) that a penny of radius `a` (m) adds to that of tension across it, and to that of shear along it, in a
/// cube of half width 1 (Sneddon 1946; Eshelby 1957). Under tension a cube opens a crack of 0.35 by 4.55 % more than
/// an infinite body (fine finite elements); what neighbours add falls with the third power of the radius. For shear
/// the infinite body is taken.
pub fn penny_works(a: f64) -> [f64; 2] {
    let middle = 8.0 * (1.0 - POISSON * POISSON) * a / (PI * YOUNG);
    let volume = 2.0 / 3.0 * PI * a * a * middle;
    let cube = 1.0 + 0.0455 * (a / 0.35).powi(3);
    [volume * cube, volume * 2.0 / (2.0 - POISSON)]
}
