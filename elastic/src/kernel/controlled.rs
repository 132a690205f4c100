//! Rows with zero-energy control.
#![allow(
    clippy::needless_range_loop,
    reason = "lanes and axes are walked in step over several arrays"
)]

use std::hint::black_box;
use std::marker::PhantomData;

use glam::{DMat3, DVec3};

use super::{Anchored, Lanes, Real, Row, columns, stored};
use crate::body::Body;

/// Storage of `g` and `w` in `T`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Controlled<T>(PhantomData<T>);

/// `g`, `w`.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(16))]
pub(crate) struct Pair<T>([T; 4]);

/// Rows of three, nothing, three, nothing.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
pub(crate) struct Matrix<T>([[T; 8]; 3]);

impl<T: Real> Lanes for Controlled<T> {
    const CONTROLLED: bool = true;
    type Number = T;
    type State = Anchored;
    type Pair = Pair<T>;
    type Matrix = Matrix<T>;

    #[inline(always)]
    fn states(body: &Body) -> &[Anchored] {
        &body.anchored
    }

    fn pair(gradient: DVec3, weight: f64) -> Pair<T> {
        let [x, y, z] = stored(gradient);
        Pair([x, y, z, T::of(weight)])
    }

    #[inline(always)]
    fn matrix(on_gradient: DMat3, on_offset: DMat3) -> Matrix<T> {
        let row =
            |a: DVec3, b: DVec3| [a.x, a.y, a.z, 0.0, b.x, b.y, b.z, 0.0].map(|value| T::of(value));
        Matrix([
            row(on_gradient.x_axis, on_offset.x_axis),
            row(on_gradient.y_axis, on_offset.y_axis),
            row(on_gradient.z_axis, on_offset.z_axis),
        ])
    }

    fn gradient(pair: &Pair<T>) -> DVec3 {
        DVec3::new(pair.0[0].wide(), pair.0[1].wide(), pair.0[2].wide())
    }

    fn offset(pair: &Pair<T>, x: DVec3) -> DVec3 {
        let [x, y, z] = x.to_array().map(|x| (T::of(x) * pair.0[3]).wide());
        DVec3::new(x, y, z)
    }

    fn weight(pair: &Pair<T>) -> f64 {
        pair.0[3].wide()
    }

    fn linked(pair: &Pair<T>, _: &Pair<T>) -> bool {
        pair.0[3] != T::ZERO
    }

    #[inline(always)]
    fn gather_gradient(row: Row<'_, Pair<T>>, states: &[Anchored]) -> (DMat3, DMat3) {
        let own = states[row.node].0;
        let mut sum = [[T::ZERO; 8]; 3];
        for (&j, pair) in row.indices.iter().zip(row.pairs) {
            let other = &states[j as usize].0;
            let mut d = [T::ZERO; 8];
            for k in 0..8 {
                d[k] = T::of(other[k] - own[k]);
            }
            let z = lanes(pair, &d);
            for r in 0..3 {
                for k in 0..8 {
                    sum[r][k] += d[r] * z[k];
                }
            }
        }
        let sum = black_box(sum);
        (columns(&sum, 0), columns(&sum, 4))
    }

    #[inline(always)]
    fn gather_force(row: Row<'_, Pair<T>>, states: &[Anchored], matrices: &[Matrix<T>]) -> DVec3 {
        let own = states[row.node].0;
        let mut sum = [[T::ZERO; 8]; 3];
        let mut direct = [0.0; 4];
        for (&j, pair) in row.indices.iter().zip(row.pairs) {
            let (other, m) = (&states[j as usize].0, &matrices[j as usize]);
            let mut d = [0.0; 8];
            for k in 0..8 {
                d[k] = own[k] - other[k];
            }
            let z = lanes(pair, &d.map(T::of));
            for r in 0..3 {
                for k in 0..8 {
                    sum[r][k] += m.0[r][k] * z[k];
                }
            }
            let stiffness = (own[3] + other[3]) * pair.0[3].wide();
            for r in 0..4 {
                direct[r] -= stiffness * d[r];
            }
        }
        let (sum, direct) = black_box((sum, direct));
        let [x, y, z] = sum.map(|row| {
            let [a, b, c, _, d, e, f, _] = row.map(Real::wide);
            ((a + b) + c) + ((d + e) + f)
        });
        DVec3::new(x + direct[0], y + direct[1], z + direct[2])
    }
}

/// `(g, w, w X, 0)` of a pair whose states differ by `d = (u, c, X, 0)`.
#[inline(always)]
fn lanes<T: Real>(pair: &Pair<T>, d: &[T; 8]) -> [T; 8] {
    let mut z = [T::ZERO; 8];
    for k in 0..4 {
        z[k] = pair.0[k];
        z[4 + k] = d[4 + k] * pair.0[3];
    }
    z
}
