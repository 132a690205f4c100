//! Sums and updates of nodal vectors, bitwise identical at any number of threads.

use bytemuck::{cast_slice, cast_slice_mut};
use glam::DVec3;
use rayon::prelude::*;

/// Nodes per chunk; partial sums are per chunk, so this fixes the order of summation.
pub(crate) const CHUNK: usize = 1024;

const PARALLEL_FROM: usize = 32 * CHUNK;

/// Partial sums at a time; as a sum waits for the one before it, one alone takes four times as long.
const LANES: usize = 8;

/// `a · b` of numbers side by side, in eight sums that are added in order. What one slice has more than
/// the other does not count.
#[inline(always)]
pub(crate) fn dot_in_order(a: &[DVec3], b: &[DVec3]) -> f64 {
    let (a, b): (&[f64], &[f64]) = (cast_slice(a), cast_slice(b));
    let len = a.len().min(b.len());
    let (a, rest_of_a) = a[..len].as_chunks::<LANES>();
    let (b, rest_of_b) = b[..len].as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for k in 0..LANES {
            sums[k] += a[k] * b[k];
        }
    }
    let rest = rest_of_a.iter().zip(rest_of_b).map(|(a, b)| a * b);
    rest.fold(sums.iter().sum(), |sum, more| sum + more)
}

/// Sum of vectors, as [`dot_in_order`] adds numbers.
#[inline(always)]
pub(crate) fn sum_in_order(a: &[DVec3]) -> DVec3 {
    let (a, rest) = a.as_chunks::<4>();
    let mut sums = [DVec3::ZERO; 4];
    for a in a {
        for k in 0..4 {
            sums[k] += a[k];
        }
    }
    sums.iter().chain(rest).sum()
}

/// `sum_i w_i |a_i - b_i|²` of slices of one length, as [`sum_in_order`] adds vectors.
#[inline(always)]
pub(crate) fn weighted_squares(weights: &[f64], a: &[DVec3], b: &[DVec3]) -> f64 {
    let square = |w: &f64, a: &DVec3, b: &DVec3| w * (*a - *b).length_squared();
    let (weights, more_weights) = weights.as_chunks::<4>();
    let ((a, more_a), (b, more_b)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (w, (a, b)) in weights.iter().zip(a.iter().zip(b)) {
        for k in 0..4 {
            sums[k] += square(&w[k], &a[k], &b[k]);
        }
    }
    let rest = more_weights.iter().zip(more_a.iter().zip(more_b));
    rest.fold(sums.iter().sum(), |sum, (w, (a, b))| sum + square(w, a, b))
}

/// `a · b`, summed by chunks in order.
pub(crate) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    products(a, b).iter().sum()
}

/// `a · b` of each chunk.
pub(crate) fn products(a: &[DVec3], b: &[DVec3]) -> Vec<f64> {
    let part = |(a, b): (&[DVec3], &[DVec3])| dot_in_order(a, b);
    if a.len() >= PARALLEL_FROM {
        let chunks = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK));
        chunks.map(part).collect()
    } else {
        let chunks = a.chunks(CHUNK).zip(b.chunks(CHUNK));
        chunks.map(part).collect()
    }
}

/// Position of the first of the largest numbers, 0 if none is above zero.
pub(crate) fn largest(numbers: impl Iterator<Item = f64>) -> usize {
    let mut best = (0, 0.0);
    for (at, number) in numbers.enumerate() {
        if number > best.1 {
            best = (at, number);
        }
    }
    best.0
}

pub(crate) fn norm(a: &[DVec3]) -> f64 {
    dot(a, a).sqrt()
}

/// `a[i] = f(i, a[i])`.
pub(crate) fn update(a: &mut [DVec3], f: impl Fn(usize, &mut DVec3) + Sync) {
    by_chunks(a, &|first, a| {
        for (i, a) in (first..).zip(a) {
            f(i, a);
        }
    });
}

/// `a = f(a, b)`, number by number.
pub(crate) fn combine(a: &mut [DVec3], b: &[DVec3], f: impl Fn(f64, f64) -> f64 + Sync) {
    by_chunks(a, &|first, a| {
        let (a, b): (&mut [f64], &[f64]) = (cast_slice_mut(a), cast_slice(&b[first..]));
        for (a, b) in a.iter_mut().zip(b) {
            *a = f(*a, *b);
        }
    });
}

/// Calls `f` with chunks and the number of their first node. It is compiled once for all functions.
fn by_chunks(a: &mut [DVec3], f: &(dyn Fn(usize, &mut [DVec3]) + Sync)) {
    if a.len() >= PARALLEL_FROM {
        let chunks = a.par_chunks_mut(CHUNK).enumerate();
        chunks.for_each(|(chunk, a)| f(chunk * CHUNK, a));
    } else {
        f(0, a);
    }
}

/// `a += factor · b`.
pub(crate) fn add_scaled(a: &mut [DVec3], factor: f64, b: &[DVec3]) {
    combine(a, b, |a, b| a + b * factor);
}

pub(crate) fn scale_by(a: &mut [DVec3], factor: f64) {
    update(a, |_, a| *a *= factor);
}

/// Opposite corners of the box around points (m).
pub(crate) fn bounds_of<'a>(points: impl IntoIterator<Item = &'a DVec3>) -> [DVec3; 2] {
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let points = points.into_iter();
    points.fold(none, |[min, max], x| [min.min(*x), max.max(*x)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::cloud::uniform;

    #[test]
    fn sums_in_lanes_are_sums() {
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-14 * (1.0 + b.abs());
        for n in [0, 1, 2, 3, 7, 8, 127] {
            let (a, b) = (uniform(n, 1.0, 1), uniform(n, 1.0, 2));
            let plain: f64 = a.iter().zip(&b).map(|(a, b)| a.dot(*b)).sum();
            assert!(close(dot_in_order(&a, &b), plain), "{n} products");
            let plain: DVec3 = a.iter().sum();
            let lanes = sum_in_order(&a);
            assert!((lanes - plain).length() <= 1e-13, "{n} vectors: {lanes}");
            let weights: Vec<f64> = (0..n).map(|i| 0.5 + i as f64).collect();
            let squares = a.iter().zip(&b).map(|(a, b)| (*a - *b).length_squared());
            let plain: f64 = weights.iter().zip(squares).map(|(w, s)| w * s).sum();
            let squares = weighted_squares(&weights, &a, &b);
            assert!(close(squares, plain), "{n} squares");
        }
        let (long, short) = ([DVec3::ONE; 9], [DVec3::ONE; 2]);
        assert!(close(dot_in_order(&long, &short), 6.0), "what both have");
        assert!(close(dot_in_order(&long, &[]), 0.0), "nothing");
    }

    #[test]
    fn parallel_sums_equal_serial_ones_to_the_bit() {
        let (a, b) = (
            uniform(PARALLEL_FROM + 321, 1.0, 1),
            uniform(PARALLEL_FROM + 321, 1.0, 2),
        );
        let pair = |n: usize| {
            testkit::on_threads(n, || {
                let mut c = a.clone();
                add_scaled(&mut c, 0.3, &b);
                (dot(&a, &b).to_bits(), norm(&c).to_bits())
            })
        };
        assert_eq!(pair(1), pair(3), "threads");
        let chunks = a.chunks(CHUNK).zip(b.chunks(CHUNK));
        let serial: f64 = chunks.map(|(a, b)| dot_in_order(a, b)).sum();
        assert_eq!(serial.to_bits(), pair(2).0, "serial twin");
    }
}
