//! The largest eigenvalue by a method that shares nothing with the one that chooses the step.

use glam::DVec3;
use phyxel::Body;
use testkit::cloud::Random;

/// Largest eigenvalue (1/s²) of `M⁻¹ K` of a body where it is now, from below.
///
/// Lanczos iteration from a pseudo-random vector (Lanczos 1950) on
/// `M^-1/2 K M^-1/2` and the free directions: `products` products with the stiffness, no vector from
/// before, no guess where the stiff node is. Without reorthogonalization round-off repeats eigenvalues
/// and adds none, so the largest of the tridiagonal matrix stays a lower bound up to round-off.
pub fn largest_eigenvalue(body: &Body, products: usize, seed: u64) -> f64 {
    let masses = body.motion().masses();
    let supports = body.motion().supports();
    let scale: Vec<f64> = masses.iter().map(|m| m.sqrt().recip()).collect();
    let mut elastic = body.elastic().clone();
    let n = masses.len();
    let mut scaled = vec![DVec3::ZERO; n];
    let mut apply = |v: &[DVec3], out: &mut [DVec3]| {
        for ((s, v), scale) in scaled.iter_mut().zip(v).zip(&scale) {
            *s = *v * *scale;
        }
        elastic.tangent_product_into(&scaled, out);
        for (out, scale) in out.iter_mut().zip(&scale) {
            *out *= *scale;
        }
        supports.project(out);
    };
    let mut random = Random::new(seed);
    let mut v: Vec<DVec3> = (0..n).map(|_| random.vector(0.5)).collect();
    supports.project(&mut v);
    let mut before = vec![DVec3::ZERO; n];
    let mut image = vec![DVec3::ZERO; n];
    let (mut diagonal, mut beside) = (Vec::new(), Vec::new());
    let mut size = dot(&v, &v).sqrt();
    for _ in 0..products {
        if size <= 0.0 {
            break;
        }
        v.iter_mut().for_each(|v| *v /= size);
        apply(&v, &mut image);
        let alpha = dot(&v, &image);
        let beta = beside.last().copied().unwrap_or(0.0);
        for ((image, v), before) in image.iter_mut().zip(&v).zip(&before) {
            *image -= *v * alpha + *before * beta;
        }
        diagonal.push(alpha);
        size = dot(&image, &image).sqrt();
        beside.push(size);
        std::mem::swap(&mut before, &mut v);
        std::mem::swap(&mut v, &mut image);
    }
    largest_of_tridiagonal(&diagonal, &beside)
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

/// Largest eigenvalue of a symmetric tridiagonal matrix by bisection: `x` is above it if and only if
/// all pivots of `T - x` are negative (Sylvester's law of inertia).
fn largest_of_tridiagonal(diagonal: &[f64], beside: &[f64]) -> f64 {
    let off = |k: usize| beside.get(k).map_or(0.0, |b: &f64| b.abs());
    let rows = diagonal.iter().enumerate();
    let reach = |k: usize| off(k) + if k > 0 { off(k - 1) } else { 0.0 };
    // Gershgorin.
    let (mut low, mut high) = rows
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (k, d)| {
            (low.min(d - reach(k)), high.max(d + reach(k)))
        });
    if !(low.is_finite() && high.is_finite()) {
        return f64::NAN;
    }
    let above = |x: f64| {
        let mut pivot = f64::INFINITY;
        for (k, d) in diagonal.iter().enumerate() {
            let b = if k > 0 { off(k - 1) } else { 0.0 };
            pivot = d - x - b * b / pivot;
            if pivot >= 0.0 {
                return false;
            }
        }
        true
    };
    // 50 halvings leave 1e-15 of the width.
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if above(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

pub(crate) mod checks {
    use super::*;

    /// The second difference of n nodes has the eigenvalues `2 - 2 cos(k π / (n + 1))`.
    pub(crate) fn a_chain_has_the_eigenvalue_of_its_shortest_wave() {
        for n in [1_u32, 2, 7, 40] {
            let diagonal = vec![2.0; n as usize];
            let beside = vec![-1.0; n as usize];
            let exact = 2.0 + 2.0 * (std::f64::consts::PI / f64::from(n + 1)).cos();
            let found = largest_of_tridiagonal(&diagonal, &beside);
            assert!(
                (found - exact).abs() < 1e-12 * exact,
                "{n}: {found}, not {exact}"
            );
        }
    }
}
