//! Rows without zero-energy control: gradients alone.
#![allow(
    clippy::needless_range_loop,
    reason = "lanes and axes are walked in step over several arrays"
)]

use std::hint::black_box;
use std::marker::PhantomData;

use glam::{DMat3, DVec3};

use super::{Lanes, Move, Real, Row, columns, stored};
use crate::body::Body;

/// Storage of `g` in `T`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bare<T>(PhantomData<T>);

impl<T: Real> Lanes for Bare<T> {
    const CONTROLLED: bool = false;
    type Number = T;
    type State = Move;
    type Pair = [T; 3];
    type Matrix = [[T; 3]; 3];

    #[inline(always)]
    fn states(body: &Body) -> &[Move] {
        &body.moves
    }

    fn pair(gradient: DVec3, _: f64) -> [T; 3] {
        stored(gradient)
    }

    #[inline(always)]
    fn matrix(on_gradient: DMat3, _: DMat3) -> [[T; 3]; 3] {
        on_gradient
            .to_cols_array_2d()
            .map(|row| row.map(|value| T::of(value)))
    }

    fn gradient(pair: &[T; 3]) -> DVec3 {
        DVec3::from_array(pair.map(Real::wide))
    }

    fn offset(_: &[T; 3], _: DVec3) -> DVec3 {
        DVec3::ZERO
    }

    fn weight(_: &[T; 3]) -> f64 {
        0.0
    }

    fn linked(pair: &[T; 3], back: &[T; 3]) -> bool {
        *pair != [T::ZERO; 3] || *back != [T::ZERO; 3]
    }

    #[inline(always)]
    fn gather_gradient(row: Row<'_, [T; 3]>, moves: &[Move]) -> (DMat3, DMat3) {
        let own = moves[row.node];
        let mut sum = [[T::ZERO; 3]; 3];
        for (&j, g) in row.indices.iter().zip(row.pairs) {
            let other = &moves[j as usize];
            for r in 0..3 {
                let d = T::of(other[r] - own[r]);
                for k in 0..3 {
                    sum[r][k] += d * g[k];
                }
            }
        }
        (columns(&black_box(sum), 0), DMat3::ZERO)
    }

    #[inline(always)]
    fn gather_force(row: Row<'_, [T; 3]>, _: &[Move], matrices: &[[[T; 3]; 3]]) -> DVec3 {
        let mut sum = [[T::ZERO; 3]; 3];
        for (&j, g) in row.indices.iter().zip(row.pairs) {
            let m = &matrices[j as usize];
            for r in 0..3 {
                for k in 0..3 {
                    sum[r][k] += m[r][k] * g[k];
                }
            }
        }
        let [x, y, z] = black_box(sum).map(|row| {
            let [a, b, c] = row.map(Real::wide);
            (a + b) + c
        });
        DVec3::new(x, y, z)
    }
}
