//! Volumetric noise.

use glam::Vec3;

/// Mixes three lattice coordinates into 32 bits.
#[inline]
fn hash(x: i32, y: i32, z: i32) -> u32 {
    let mut h = x.cast_unsigned().wrapping_mul(0x8da6_b343)
        ^ y.cast_unsigned().wrapping_mul(0xd816_3841)
        ^ z.cast_unsigned().wrapping_mul(0xcb1a_b31f);
    h ^= h >> 15;
    h = h.wrapping_mul(0x2c1b_3c6d);
    h ^= h >> 12;
    h = h.wrapping_mul(0x297a_2d39);
    h ^ (h >> 15)
}

/// One of twelve gradients, the edge directions of a cube.
#[inline]
fn gradient(hash: u32) -> Vec3 {
    let a = if hash & 4 == 0 { 1.0 } else { -1.0 };
    let b = if hash & 8 == 0 { 1.0 } else { -1.0 };
    match hash & 3 {
        0 => Vec3::new(a, b, 0.0),
        1 => Vec3::new(0.0, a, b),
        _ => Vec3::new(b, 0.0, a),
    }
}

/// The lattice cell of a point and the position in it. Far outside (2³¹ cells) noise need not vary.
#[inline]
#[allow(
    clippy::cast_possible_truncation,
    reason = "saturates; exact below 2^24, where coordinates still have fractions"
)]
fn cell(p: Vec3) -> ([i32; 3], Vec3) {
    let cell = p.to_array().map(|x| {
        let toward_zero = x as i32;
        toward_zero.saturating_sub(i32::from(x < toward_zero as f32))
    });
    (cell, p - Vec3::from_array(cell.map(|x| x as f32)))
}

/// About the gradient of that noise: the lattice gradients, smoothly interpolated. Cheaper
/// than the gradient and as continuous; what a relief needs.
pub(crate) fn slope_noise(p: Vec3) -> Vec3 {
    let ([x, y, z], f) = cell(p);
    let s = f * f * (Vec3::splat(3.0) - 2.0 * f);
    let corner = |dx: i32, dy: i32, dz: i32| {
        let h = hash(x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz));
        gradient(h)
    };
    let edge = |dy: i32, dz: i32| corner(0, dy, dz).lerp(corner(1, dy, dz), s.x);
    let near = edge(0, 0).lerp(edge(1, 0), s.y);
    let far = edge(0, 1).lerp(edge(1, 1), s.y);
    near.lerp(far, s.z)
}

/// Gradient noise at a point, lattice cell 1: smooth, mean 0, within about ±1.
///
/// Zero at lattice points, twice continuously differentiable, same everywhere and always.
pub(crate) fn gradient_noise(p: Vec3) -> f32 {
    let ([x, y, z], f) = cell(p);
    let s = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let corner = |dx: i32, dy: i32, dz: i32, d: Vec3| {
        let h = hash(x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz));
        gradient(h).dot(f - d)
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let edge = |dy: i32, dz: i32, y: f32, z: f32| {
        let at = |dx: i32, x: f32| corner(dx, dy, dz, Vec3::new(x, y, z));
        mix(at(0, 0.0), at(1, 1.0), s.x)
    };
    let near = mix(edge(0, 0, 0.0, 0.0), edge(1, 0, 1.0, 0.0), s.y);
    let far = mix(edge(0, 1, 0.0, 1.0), edge(1, 1, 1.0, 1.0), s.y);
    mix(near, far, s.z)
}

/// Sum of `octaves` of gradient noise, each twice as fine and half as strong.
#[must_use]
pub(crate) fn fractal_noise(p: Vec3, octaves: u32) -> f32 {
    let (mut sum, mut strength, mut at) = (0.0, 0.5, p);
    for _ in 0..octaves {
        sum += strength * gradient_noise(at);
        strength *= 0.5;
        at = at * 2.0 + Vec3::splat(17.17);
    }
    sum
}
