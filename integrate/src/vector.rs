//! Sums and updates of nodal vectors, the same bits at any number of threads.

use glam::DVec3;
use rayon::prelude::*;

const CHUNK: usize = 1024;
const PARALLEL_FROM: usize = 32 * CHUNK;

/// `a · b`, summed by chunks in order.
pub(crate) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    let part =
        |(a, b): (&[DVec3], &[DVec3])| -> f64 { a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum() };
    if a.len() >= PARALLEL_FROM {
        let parts: Vec<f64> = a
            .par_chunks(CHUNK)
            .zip(b.par_chunks(CHUNK))
            .map(part)
            .collect();
        parts.iter().sum()
    } else {
        a.chunks(CHUNK).zip(b.chunks(CHUNK)).map(part).sum()
    }
}

pub(crate) fn norm(a: &[DVec3]) -> f64 {
    dot(a, a).sqrt()
}

/// `a[i] = f(i, a[i])`.
pub(crate) fn update(a: &mut [DVec3], f: impl Fn(usize, &mut DVec3) + Sync) {
    if a.len() >= PARALLEL_FROM {
        a.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, a)| {
            for (k, a) in a.iter_mut().enumerate() {
                f(chunk * CHUNK + k, a);
            }
        });
    } else {
        for (i, a) in a.iter_mut().enumerate() {
            f(i, a);
        }
    }
}

/// `a += factor · b`.
pub(crate) fn add_scaled(a: &mut [DVec3], factor: f64, b: &[DVec3]) {
    update(a, |i, a| *a += b[i] * factor);
}

pub(crate) fn scale_by(a: &mut [DVec3], factor: f64) {
    update(a, |_, a| *a *= factor);
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::cloud::uniform;

    #[test]
    fn parallel_sums_equal_serial_ones_to_the_bit() {
        let (a, b) = (
            uniform(PARALLEL_FROM + 321, 1.0, 1),
            uniform(PARALLEL_FROM + 321, 1.0, 2),
        );
        let pair = |n: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(n)
                .build()
                .unwrap();
            pool.install(|| {
                let mut c = a.clone();
                add_scaled(&mut c, 0.3, &b);
                (dot(&a, &b).to_bits(), norm(&c).to_bits())
            })
        };
        assert_eq!(pair(1), pair(3), "threads");
        let chunks = a.chunks(CHUNK).zip(b.chunks(CHUNK));
        let serial: f64 = chunks
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>())
            .sum();
        assert_eq!(serial.to_bits(), pair(2).0, "serial twin");
    }
}
