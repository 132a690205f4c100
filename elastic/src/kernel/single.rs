//! Pairs, node matrices and sums over one row in f32; positions, displacement differences,
//! stresses, sums over lanes and forces in f64.
//!
//! A difference `u_ij` is taken in f64 before it is rounded, so a body may move far without losing
//! strain. What is left is a relative 1e-7 per row.
#![allow(
    clippy::needless_range_loop,
    reason = "lanes and axes are walked in step over several arrays"
)]
#![allow(
    clippy::cast_possible_truncation,
    reason = "rounding to f32 is this storage's purpose"
)]

use glam::{DMat3, DVec3};

use super::{Lanes, Move};

/// f32 storage, f64 state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Single;

/// `g`, `y`, weight (reversed copy only), nothing.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(16))]
pub(crate) struct Eight([f32; 8]);

#[derive(Debug, Clone, Copy)]
#[repr(C, align(16))]
pub(crate) struct Matrix([[f32; 8]; 3]);

impl Lanes for Single {
    const WEIGHT_TOLERANCE: f64 = 1e-6;
    /// Smaller ones, as ahead of a wave, would breed subnormal products, which cost a hundred
    /// times a normal one.
    const LEAST_DISPLACEMENT: f64 = 1e-20;
    type Pair = Eight;
    type Incoming = Eight;
    type Matrix = Matrix;

    fn pair(g: DVec3, y: DVec3) -> Eight {
        Self::incoming(g, y, 0.0)
    }

    fn incoming(g: DVec3, y: DVec3, weight: f64) -> Eight {
        // Entries below f32's own rounding of the vector would only breed subnormal products.
        let kept = |v: DVec3| {
            let floor = 1e-12 * v.length();
            v.to_array()
                .map(|c| if c.abs() < floor { 0.0 } else { c as f32 })
        };
        let ([a, b, c], [d, e, f]) = (kept(g), kept(y));
        Eight([a, b, c, d, e, f, weight as f32, 0.0])
    }

    #[inline(always)]
    fn matrix(on_gradient: DMat3, on_offset: DMat3) -> Matrix {
        let row = |a: DVec3, b: DVec3| [a.x, a.y, a.z, b.x, b.y, b.z, 0.0, 0.0].map(|v| v as f32);
        Matrix([
            row(on_gradient.x_axis, on_offset.x_axis),
            row(on_gradient.y_axis, on_offset.y_axis),
            row(on_gradient.z_axis, on_offset.z_axis),
        ])
    }

    fn pair_gradient(pair: &Eight) -> DVec3 {
        DVec3::new(pair.0[0].into(), pair.0[1].into(), pair.0[2].into())
    }

    fn incoming_gradient(pair: &Eight) -> DVec3 {
        Self::pair_gradient(pair)
    }

    fn pair_offset(pair: &Eight) -> DVec3 {
        DVec3::new(pair.0[3].into(), pair.0[4].into(), pair.0[5].into())
    }

    fn incoming_offset(pair: &Eight) -> DVec3 {
        Self::pair_offset(pair)
    }

    fn weight(pair: &Eight) -> f64 {
        pair.0[6].into()
    }

    #[inline(always)]
    fn gather_gradient(
        own: &Move,
        indices: &[u32],
        pairs: &[Eight],
        moves: &[Move],
    ) -> (DMat3, DMat3) {
        let [x, y, z] = gradient_lanes(own, indices, pairs, moves);
        let half = |k: usize| {
            let column =
                |row: &[f32; 8]| DVec3::new(row[k].into(), row[k + 1].into(), row[k + 2].into());
            DMat3::from_cols(column(&x), column(&y), column(&z))
        };
        (half(0), half(3))
    }

    #[inline(always)]
    fn gather_force(
        own: &Move,
        indices: &[u32],
        incoming: &[Eight],
        moves: &[Move],
        matrices: &[Matrix],
    ) -> DVec3 {
        let (lanes, direct) = force_lanes(own, indices, incoming, moves, matrices);
        let [x, y, z] = lanes.map(|row| {
            let [a, b, c, d] = row.map(f64::from);
            (a + c) + (b + d)
        });
        DVec3::new(x + direct[0], y + direct[1], z + direct[2])
    }
}

#[inline(never)]
fn gradient_lanes(own: &Move, indices: &[u32], pairs: &[Eight], moves: &[Move]) -> [[f32; 8]; 3] {
    let mut sum = [[0.0; 8]; 3];
    for (&j, z) in indices.iter().zip(pairs) {
        let other = &moves[j as usize];
        for r in 0..3 {
            let d = (other[r] - own[r]) as f32;
            for k in 0..8 {
                sum[r][k] += d * z.0[k];
            }
        }
    }
    sum
}

#[inline(never)]
fn force_lanes(
    own: &Move,
    indices: &[u32],
    incoming: &[Eight],
    moves: &[Move],
    matrices: &[Matrix],
) -> ([[f32; 4]; 3], [f64; 4]) {
    let mut sum = [[0.0; 4]; 3];
    let mut direct = [0.0; 4];
    for (&j, z) in indices.iter().zip(incoming) {
        let j = j as usize;
        let (other, m) = (&moves[j], &matrices[j]);
        let stiffness = (own[3] + other[3]) * f64::from(z.0[6]);
        for r in 0..3 {
            let row = &m.0[r];
            for lane in 0..4 {
                sum[r][lane] += row[lane] * z.0[lane] + row[lane + 4] * z.0[lane + 4];
            }
        }
        for r in 0..3 {
            direct[r] += stiffness * (other[r] - own[r]);
        }
    }
    (sum, direct)
}
