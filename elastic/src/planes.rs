//! Arithmetic on planes, sixteen lanes at a time, and the way from components to nodes.
#![allow(
    clippy::needless_range_loop,
    reason = "components and lanes are walked in step over several arrays"
)]

use std::hint::black_box;

use crate::gather::Arithmetic;
use crate::storage::{BLOCK, Number, Plane};

/// Numbers of a block's nodes in f64.
pub(crate) type Wide = Plane<f64>;

pub(crate) const ZERO: Wide = [0.0; BLOCK];

/// `a b + c`, lane by lane. Into a plane of its own: loops that write where they read are turned
/// inside out by compilers, and then gather.
#[inline(always)]
pub(crate) fn add<A: Arithmetic, T: Number>(a: &Wide, b: &Plane<T>, c: &Wide) -> Wide {
    let mut sum = ZERO;
    for lane in 0..BLOCK {
        sum[lane] = A::add(a[lane], b[lane].wide(), c[lane]);
    }
    sum
}

/// `a_0 b_0 + a_1 b_1 + a_2 b_2`, lane by lane.
#[inline(always)]
pub(crate) fn product<A: Arithmetic, T: Number>(a: &[Wide], b: [&Plane<T>; 3]) -> Wide {
    let sum = add::<A, T>(&a[2], b[2], &ZERO);
    let sum = add::<A, T>(&a[1], b[1], &sum);
    add::<A, T>(&a[0], b[0], &sum)
}

/// `c - a b`, lane by lane.
#[inline(always)]
pub(crate) fn subtract<A: Arithmetic, T: Number>(a: &Wide, b: &Plane<T>, c: &Wide) -> Wide {
    let mut sum = ZERO;
    for lane in 0..BLOCK {
        sum[lane] = A::add(-a[lane], b[lane].wide(), c[lane]);
    }
    sum
}

/// Numbers as storing leaves them.
#[inline(always)]
pub(crate) fn rounded<T: Number>(plane: &Wide) -> Wide {
    let mut back = ZERO;
    for lane in 0..BLOCK {
        back[lane] = T::of(plane[lane]).wide();
    }
    back
}

/// A plane as it is stored.
#[inline(always)]
pub(crate) fn as_stored<T: Number>(plane: &Wide) -> Plane<T> {
    let mut stored = [T::ZERO; BLOCK];
    for lane in 0..BLOCK {
        stored[lane] = T::of(plane[lane]);
    }
    // Else what rounds is moved into the loops that read it.
    if T::ROUNDS { black_box(stored) } else { stored }
}

/// Four components of nodes, one after the other, as nodes with four components each.
///
/// Compilers make shuffles of this as long as they do not see where it goes; else they gather number by
/// number, which takes several times as long. Of f64 alone: of narrower numbers they make no shuffles.
#[inline(always)]
pub(crate) fn weave(planes: &[Wide; 4]) -> [[f64; 4]; BLOCK] {
    let mut woven = [[0.0; 4]; BLOCK];
    for lane in 0..BLOCK {
        for i in 0..4 {
            woven[lane][i] = planes[i][lane];
        }
    }
    black_box(woven)
}
