//! Arithmetic on planes, sixteen lanes at a time, and the way from components to nodes.
#![allow(
    clippy::needless_range_loop,
    reason = "components and lanes are walked in step over several arrays"
)]

use std::hint::black_box;

use crate::kernel::storage::{BLOCK, Plane};
use crate::law::arithmetic::Arithmetic;

pub(crate) const ZERO: Plane = Plane::of(0.0);

/// `a b + c`, lane by lane. Into a plane of its own: loops that write where they read are turned
/// inside out by compilers, and then gather.
#[inline(always)]
pub(crate) fn add<A: Arithmetic>(a: &Plane, b: &Plane, c: &Plane) -> Plane {
    let mut sum = ZERO;
    for lane in 0..BLOCK {
        sum[lane] = A::add(a[lane], b[lane], c[lane]);
    }
    sum
}

/// `a_0 b_0 + a_1 b_1 + a_2 b_2`, lane by lane.
#[inline(always)]
pub(crate) fn product<A: Arithmetic>(a: &[Plane], b: [&Plane; 3]) -> Plane {
    let sum = add::<A>(&a[2], b[2], &ZERO);
    let sum = add::<A>(&a[1], b[1], &sum);
    add::<A>(&a[0], b[0], &sum)
}

/// `c - a b`, lane by lane.
#[inline(always)]
pub(crate) fn subtract<A: Arithmetic>(a: &Plane, b: &Plane, c: &Plane) -> Plane {
    let mut sum = ZERO;
    for lane in 0..BLOCK {
        sum[lane] = A::add(-a[lane], b[lane], c[lane]);
    }
    sum
}

/// Four components of nodes, one after the other, as nodes with four components each.
///
/// Compilers make shuffles of this as long as they do not see where it goes; else they gather number by
/// number, which takes several times as long.
#[inline(always)]
pub(crate) fn weave(planes: &[Plane; 4]) -> [[f64; 4]; BLOCK] {
    let mut woven = [[0.0; 4]; BLOCK];
    for lane in 0..BLOCK {
        for i in 0..4 {
            woven[lane][i] = planes[i][lane];
        }
    }
    black_box(woven)
}
