//! Everything in f64.
#![allow(
    clippy::needless_range_loop,
    reason = "lanes and axes are walked in step over several arrays"
)]

use glam::{DMat3, DVec3};

use super::{Lanes, Move};

/// f64 storage and arithmetic.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Double;

#[derive(Debug, Clone, Copy)]
#[repr(C, align(16))]
pub(crate) struct Pair([f64; 6]);

#[derive(Debug, Clone, Copy)]
pub(crate) struct Incoming([f64; 7]);

#[derive(Debug, Clone, Copy)]
#[repr(C, align(16))]
pub(crate) struct Matrix([[f64; 6]; 3]);

impl Lanes for Double {
    const WEIGHT_TOLERANCE: f64 = 1e-12;
    const LEAST_DISPLACEMENT: f64 = 0.0;
    type Pair = Pair;
    type Incoming = Incoming;
    type Matrix = Matrix;

    fn pair(g: DVec3, y: DVec3) -> Pair {
        Pair([g.x, g.y, g.z, y.x, y.y, y.z])
    }

    fn incoming(g: DVec3, y: DVec3, weight: f64) -> Incoming {
        Incoming([g.x, g.y, g.z, y.x, y.y, y.z, weight])
    }

    #[inline(always)]
    fn matrix(on_gradient: DMat3, on_offset: DMat3) -> Matrix {
        let row = |a: DVec3, b: DVec3| [a.x, a.y, a.z, b.x, b.y, b.z];
        Matrix([
            row(on_gradient.x_axis, on_offset.x_axis),
            row(on_gradient.y_axis, on_offset.y_axis),
            row(on_gradient.z_axis, on_offset.z_axis),
        ])
    }

    fn pair_gradient(pair: &Pair) -> DVec3 {
        DVec3::new(pair.0[0], pair.0[1], pair.0[2])
    }

    fn incoming_gradient(pair: &Incoming) -> DVec3 {
        DVec3::new(pair.0[0], pair.0[1], pair.0[2])
    }

    fn pair_offset(pair: &Pair) -> DVec3 {
        DVec3::new(pair.0[3], pair.0[4], pair.0[5])
    }

    fn incoming_offset(pair: &Incoming) -> DVec3 {
        DVec3::new(pair.0[3], pair.0[4], pair.0[5])
    }

    fn weight(pair: &Incoming) -> f64 {
        pair.0[6]
    }

    #[inline(always)]
    fn gather_gradient(
        own: &Move,
        indices: &[u32],
        pairs: &[Pair],
        moves: &[Move],
    ) -> (DMat3, DMat3) {
        let [x, y, z] = gradient_lanes(own, indices, pairs, moves);
        let half = |k: usize| {
            DMat3::from_cols(
                DVec3::new(x[k], x[k + 1], x[k + 2]),
                DVec3::new(y[k], y[k + 1], y[k + 2]),
                DVec3::new(z[k], z[k + 1], z[k + 2]),
            )
        };
        (half(0), half(3))
    }

    #[inline(always)]
    fn gather_force(
        own: &Move,
        indices: &[u32],
        incoming: &[Incoming],
        moves: &[Move],
        matrices: &[Matrix],
    ) -> DVec3 {
        let [x, y, z, xy, zz] = force_lanes(own, indices, incoming, moves, matrices);
        DVec3::new(
            x[0] + x[1] + xy[0],
            y[0] + y[1] + xy[1],
            z[0] + z[1] + zz[0],
        )
    }
}

#[inline(never)]
fn gradient_lanes(own: &Move, indices: &[u32], pairs: &[Pair], moves: &[Move]) -> [[f64; 6]; 3] {
    let mut sum = [[0.0; 6]; 3];
    for (&j, z) in indices.iter().zip(pairs) {
        let other = &moves[j as usize];
        for r in 0..3 {
            let d = other[r] - own[r];
            for k in 0..6 {
                sum[r][k] += d * z.0[k];
            }
        }
    }
    sum
}

/// Lanes 0 to 2: both lanes of `M z` per axis; 3 and 4: the direct part, x y and z.
#[inline(never)]
fn force_lanes(
    own: &Move,
    indices: &[u32],
    incoming: &[Incoming],
    moves: &[Move],
    matrices: &[Matrix],
) -> [[f64; 2]; 5] {
    let mut sum = [[0.0; 2]; 5];
    for (&j, z) in indices.iter().zip(incoming) {
        let j = j as usize;
        let (other, m) = (&moves[j], &matrices[j]);
        let stiffness = (own[3] + other[3]) * z.0[6];
        for r in 0..3 {
            let row = &m.0[r];
            for lane in 0..2 {
                sum[r][lane] += row[lane] * z.0[lane]
                    + row[lane + 2] * z.0[lane + 2]
                    + row[lane + 4] * z.0[lane + 4];
            }
        }
        for lane in 0..2 {
            sum[3][lane] += stiffness * (other[lane] - own[lane]);
        }
        sum[4][0] += stiffness * (other[2] - own[2]);
    }
    sum
}
