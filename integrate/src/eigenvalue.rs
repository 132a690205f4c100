//! Largest eigenvalue of `M⁻¹ K` and the step it allows.

use crate::supports::BoundaryConditions;
use crate::vector::{add_scaled, combine, products, scale_by};
use glam::DVec3;

/// How long to iterate, and how much to add to the result.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EigenvalueSettings {
    /// Products with the stiffness at most.
    pub iterations: usize,
    /// Stops when `|A y − λ y| ≤ tolerance · λ`; the eigenvalue's own error is then of the order of
    /// its square.
    pub tolerance: f64,
    /// Relative amount added to the eigenvalue, because the iteration comes from below.
    pub margin: f64,
}

impl Default for EigenvalueSettings {
    /// 60 iterations at most, tolerance 2 %, 2 % added.
    fn default() -> Self {
        Self {
            iterations: 60,
            tolerance: 0.02,
            margin: 0.02,
        }
    }
}

/// Why no eigenvalue was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EigenvalueError {
    /// A mass is not positive and finite.
    #[error("node {node} has mass {mass} kg, which must be positive and finite")]
    BadMass {
        /// Index of the node.
        node: usize,
        /// Its mass (kg).
        mass: f64,
    },
    /// The stiffness product is not finite.
    #[error("the stiffness product is not finite at node {node}")]
    NotFinite {
        /// First such node.
        node: usize,
    },
}

/// What the iteration found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Eigenvalue {
    /// Largest eigenvalue of `M⁻¹ K` (1/s²), margin included; 0 if nothing resists motion.
    pub value: f64,
    /// The Rayleigh quotient reached (1/s²), never above the true value but for round-off.
    pub rayleigh: f64,
    /// `|A y − λ y| / λ` with the unit vector `y` found.
    pub residual: f64,
    /// Products with the stiffness taken.
    pub iterations: usize,
    /// `2 / sqrt(value)` (s); infinite if nothing resists motion.
    pub critical_step: f64,
}

/// Largest step (s) of velocity Verlet and symplectic Euler: `2/ω · (sqrt(1 + ξ²) − ξ)`, with
/// `ω = sqrt(eigenvalue)` and `ξ = viscosity · ω / 2` the damping ratio of that mode under
/// stiffness-proportional damping (central difference method with lagged damping forces: Belytschko,
/// Liu, Moran, section 6.2). Infinite for the eigenvalue 0. Mass-proportional damping, applied
/// exactly as here, leaves the limit alone.
///
/// * `eigenvalue` -- largest one of `M⁻¹ K` (1/s²), or any upper bound, such as a row sum.
/// * `viscosity` -- factor on the stiffness (s), 0 without.
#[must_use]
pub fn critical_step(eigenvalue: f64, viscosity: f64) -> f64 {
    if eigenvalue <= 0.0 {
        return f64::INFINITY;
    }
    let omega = eigenvalue.sqrt();
    let xi = 0.5 * viscosity * omega;
    // The difference of the formula, rationalised: it would be lost to round-off where damping is strong.
    2.0 / (omega * ((1.0 + xi * xi).sqrt() + xi))
}

/// Finds the largest eigenvalue of `M⁻¹ K` on the free directions, one stiffness product an iteration.
///
/// Power iteration that keeps its last direction: each step takes the best vector (Rayleigh-Ritz) in
/// the span of the current vector, its residual and the previous direction (locally optimal conjugate
/// gradients: Knyazev 2001, doi:10.1137/S1064827500366124, without preconditioner). Plain power
/// iteration needs about the square of the iterations.
///
/// * `masses` -- nodal masses (kg), shape `(n)`, positive.
/// * `supports` -- fixed directions do not move.
/// * `stiffness` -- writes `K v` (N/m · v) for `v`, shape `(n)`; `K` symmetric.
/// * `warm` -- the vector found last time, or empty; overwritten with the one found now. A stale
///   vector costs iterations, never correctness.
///
/// Without a warm vector the start is a fixed pseudo-random one, so results repeat bit for bit.
///
/// # Errors
/// [`EigenvalueError::BadMass`] and [`EigenvalueError::NotFinite`].
///
/// # Panics
/// If `supports` is for another number of nodes.
pub fn largest_eigenvalue(
    masses: &[f64],
    supports: &BoundaryConditions,
    stiffness: impl FnMut(&[DVec3], &mut [DVec3]),
    warm: &mut Vec<DVec3>,
    settings: &EigenvalueSettings,
) -> Result<Eigenvalue, EigenvalueError> {
    let bad = |mass: &f64| !(mass.is_finite() && *mass > 0.0);
    if let Some(node) = masses.iter().position(bad) {
        let mass = masses[node];
        return Err(EigenvalueError::BadMass { node, mass });
    }
    let all = EigenvalueShare {
        first: 0,
        masses,
        supports,
    };
    let sum = |parts: &[f64]| parts.iter().sum();
    largest_eigenvalue_of_share(&all, stiffness, sum, warm, settings)
}

/// [`largest_eigenvalue`] of some nodes of a body, all others fixed.
///
/// * `nodes` -- numbers of the nodes in the body, shape `(k)`.
/// * `masses` -- masses (kg) of all nodes of the body.
/// * `supports` -- those of all nodes of the body.
/// * `stiffness` -- writes the rows of `K v` (N/m · v) of `nodes` for their entries of `v`, shape `(k)`, the others 0.
/// * `warm` -- the vector to begin with, shape `(k)`, or empty; overwritten with the one found.
///
/// # Errors
/// As [`largest_eigenvalue`], with nodes counted among `nodes`.
///
/// # Panics
/// If one of `nodes` is not in the body.
pub fn largest_eigenvalue_within(
    nodes: &[u32],
    masses: &[f64],
    supports: &BoundaryConditions,
    mut stiffness: impl FnMut(&[DVec3], &mut [DVec3]),
    warm: &mut Vec<DVec3>,
    settings: &EigenvalueSettings,
) -> Result<Eigenvalue, EigenvalueError> {
    let masses: Vec<f64> = nodes.iter().map(|&node| masses[node as usize]).collect();
    let free = |at: usize, v: DVec3| {
        let support = supports.of(nodes[at] as usize);
        support.map_or(v, |support| support.free * v)
    };
    let mut freed = vec![DVec3::ZERO; nodes.len()];
    let projected = |v: &[DVec3], out: &mut [DVec3]| {
        for (at, (freed, v)) in freed.iter_mut().zip(v).enumerate() {
            *freed = free(at, *v);
        }
        stiffness(&freed, out);
        for (at, out) in out.iter_mut().enumerate() {
            *out = free(at, *out);
        }
    };
    let unheld = BoundaryConditions::free(nodes.len());
    largest_eigenvalue(&masses, &unheld, projected, warm, settings)
}

/// Nodes of a body whose largest eigenvalue is looked for where its nodes are partitioned.
#[derive(Debug, Clone, Copy)]
pub struct EigenvalueShare<'a> {
    /// Number in the body of the first node, a multiple of [`crate::SHARED_NODES`].
    pub first: usize,
    /// Masses (kg) of the nodes, positive.
    pub masses: &'a [f64],
    /// Their supports.
    pub supports: &'a BoundaryConditions,
}

/// [`largest_eigenvalue`] of a body whose nodes are partitioned, called with every share at once: all
/// get the same result, with the bits of the body in one piece.
///
/// * `stiffness` -- writes the share's rows of `K v` for the share's part of `v`.
/// * `sum` -- gets what the share's chunks of [`crate::SHARED_NODES`] nodes add to a sum and returns the sum of
///   all chunks of the body, added in their order: the same number in every share.
/// * `warm` -- the share's part of the vector.
///
/// # Errors
/// [`EigenvalueError::NotFinite`] in all shares at once, with a node of this share, counted in the body; the
/// first one after it if the share has no such node.
///
/// # Panics
/// If `supports` is for another number of nodes.
pub fn largest_eigenvalue_of_share(
    share: &EigenvalueShare<'_>,
    mut stiffness: impl FnMut(&[DVec3], &mut [DVec3]),
    mut sum: impl FnMut(&[f64]) -> f64,
    warm: &mut Vec<DVec3>,
    settings: &EigenvalueSettings,
) -> Result<Eigenvalue, EigenvalueError> {
    iterate(share, &mut stiffness, &mut sum, warm, settings)
}

/// [`largest_eigenvalue_of_share`], compiled once for all callers.
fn iterate(
    share: &EigenvalueShare<'_>,
    stiffness: &mut dyn FnMut(&[DVec3], &mut [DVec3]),
    sum: &mut dyn FnMut(&[f64]) -> f64,
    warm: &mut Vec<DVec3>,
    settings: &EigenvalueSettings,
) -> Result<Eigenvalue, EigenvalueError> {
    let EigenvalueShare {
        first,
        masses,
        supports,
    } = *share;
    let n = masses.len();
    assert_eq!(supports.node_count(), n, "supports for every node");
    let scale: Vec<f64> = masses.iter().map(|m| m.sqrt().recip()).collect();
    let mut scaled = vec![DVec3::ZERO; n];
    // A v = M^-1/2 K M^-1/2 v on the free directions; projector and mass commute, node by node.
    let mut apply = |v: &[DVec3], out: &mut Vec<DVec3>| {
        for ((s, v), scale) in scaled.iter_mut().zip(v).zip(&scale) {
            *s = *v * *scale;
        }
        stiffness(&scaled, out);
        for (out, scale) in out.iter_mut().zip(&scale) {
            *out *= *scale;
        }
        supports.project(out);
    };
    let mut dot = |a: &[DVec3], b: &[DVec3]| sum(&products(a, b));
    // All shares see the same sums, and so go the same way.
    let finite = |product: f64, image: &[DVec3]| {
        if product.is_finite() {
            return Ok(product);
        }
        let bad = image.iter().position(|v| !v.is_finite());
        let node = first + bad.unwrap_or(n);
        Err(EigenvalueError::NotFinite { node })
    };

    if warm.len() != n {
        *warm = vec![DVec3::ZERO; n];
    }
    supports.project(warm);
    if !normalize(warm, &mut dot) {
        *warm = start_vector(first, n);
        supports.project(warm);
        if !normalize(warm, &mut dot) {
            return Ok(result(0.0, 0.0, 0, settings));
        }
    }
    let y = warm;
    let mut ay = vec![DVec3::ZERO; n];
    apply(y, &mut ay);
    let (mut p, mut ap): (Vec<DVec3>, Vec<DVec3>) = (Vec::new(), Vec::new());
    let mut has_p = false;
    let (mut r, mut ar) = (vec![DVec3::ZERO; n], vec![DVec3::ZERO; n]);
    let mut iterations = 1;
    loop {
        let lambda = finite(dot(y, &ay), &ay)?;
        r.copy_from_slice(&ay);
        add_scaled(&mut r, -lambda, y);
        let size = dot(&r, &r).sqrt();
        let relative = if lambda > 0.0 { size / lambda } else { size };
        if relative <= settings.tolerance || iterations >= settings.iterations || size == 0.0 {
            return Ok(result(lambda, relative, iterations, settings));
        }
        // Orthonormal basis {y, r, p}; r is orthogonal to y up to round-off, p is made so.
        let c = dot(&r, y);
        add_scaled(&mut r, -c, y);
        if !normalize(&mut r, &mut dot) {
            return Ok(result(lambda, relative, iterations, settings));
        }
        apply(&r, &mut ar);
        iterations += 1;
        let of_r = finite(dot(&r, &ar), &ar)?;
        let keep_p = has_p && normalize_beside(&mut p, &mut ap, [(y, &ay), (&r, &ar)], &mut dot);
        let mut h = [[0.0; 3]; 3];
        h[0][0] = lambda;
        h[1][0] = dot(&r, &ay);
        h[1][1] = of_r;
        if keep_p {
            h[2][0] = dot(&p, &ay);
            h[2][1] = dot(&p, &ar);
            h[2][2] = dot(&p, &ap);
        }
        let c = largest_vector(h, if keep_p { 3 } else { 2 });
        if !keep_p {
            p = vec![DVec3::ZERO; n];
            ap = vec![DVec3::ZERO; n];
            has_p = true;
        }
        // New direction p = c1 r + c2 p, new vector y = c0 y + p.
        combine(&mut p, &r, |p, r| r * c[1] + p * c[2]);
        combine(&mut ap, &ar, |ap, ar| ar * c[1] + ap * c[2]);
        combine(y, &p, |y, p| y * c[0] + p);
        combine(&mut ay, &ap, |ay, ap| ay * c[0] + ap);
        let size = dot(y, y).sqrt();
        scale_by(y, size.recip());
        scale_by(&mut ay, size.recip());
    }
}

/// Takes out of a direction, and of its image, what they have of two that are orthonormal, and makes it of unit length;
/// whether anything but round-off is left.
fn normalize_beside(
    p: &mut [DVec3],
    image: &mut [DVec3],
    others: [(&Vec<DVec3>, &Vec<DVec3>); 2],
    dot: &mut impl FnMut(&[DVec3], &[DVec3]) -> f64,
) -> bool {
    let before = dot(p, p).sqrt();
    for (other, its_image) in others {
        let c = dot(p, other);
        add_scaled(p, -c, other);
        add_scaled(image, -c, its_image);
    }
    let after = dot(p, p).sqrt();
    // A direction that lost ten digits to the other two holds nothing but round-off.
    let keep = after > 1e-10 * before;
    if keep {
        scale_by(p, after.recip());
        scale_by(image, after.recip());
    }
    keep
}

fn result(
    rayleigh: f64,
    residual: f64,
    iterations: usize,
    settings: &EigenvalueSettings,
) -> Eigenvalue {
    let value = rayleigh.max(0.0) * (1.0 + settings.margin);
    Eigenvalue {
        value,
        rayleigh,
        residual,
        iterations,
        critical_step: critical_step(value, 0.0),
    }
}

/// Unit-free pseudo-random components in [-0.5, 0.5) from the index alone (multiplicative hashing), of `n`
/// nodes from `first` on.
fn start_vector(first: usize, n: usize) -> Vec<DVec3> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut next = || {
        state = state
            .wrapping_mul(0x5851_f42d_4c95_7f2d)
            .wrapping_add(0x1405_7b7e_f767_814f);
        let unit = (state >> 11) as f64 / (1_u64 << 53) as f64;
        unit - 0.5
    };
    let all = (0..first + n).map(|_| DVec3::new(next(), next(), next()));
    all.skip(first).collect()
}

/// A vector for [`largest_eigenvalue`] to begin with that turns with the body: the displacement of each node at `positions` (m)
/// from their mean, times a pseudo-random number in [-0.5, 0.5) from the index alone.
#[must_use]
pub fn radial_start(positions: &[DVec3]) -> Vec<DVec3> {
    let middle = positions.iter().sum::<DVec3>() / positions.len().max(1) as f64;
    let factors = start_vector(0, positions.len());
    let ways = positions.iter().zip(factors);
    ways.map(|(x, factor)| (*x - middle) * factor.x).collect()
}

/// Makes a vector one long, if it has a length.
fn normalize(a: &mut [DVec3], dot: &mut impl FnMut(&[DVec3], &[DVec3]) -> f64) -> bool {
    let length = dot(a, a).sqrt();
    let usable = length > 0.0 && length.is_finite();
    if usable {
        scale_by(a, length.recip());
    }
    usable
}

/// Unit eigenvector of the largest eigenvalue of a symmetric matrix (lower triangle given), by cyclic
/// Jacobi rotations.
#[allow(
    clippy::needless_range_loop,
    reason = "the rotation touches rows and columns of one matrix"
)]
fn largest_vector(lower: [[f64; 3]; 3], size: usize) -> [f64; 3] {
    let mut a = lower;
    for i in 0..size {
        for j in 0..i {
            a[j][i] = a[i][j];
        }
    }
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..30 {
        let mut off = 0.0;
        for p in 0..size {
            for q in p + 1..size {
                off += a[p][q].abs();
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = (t * t + 1.0).sqrt().recip();
                let s = t * c;
                for k in 0..size {
                    let (akp, akq) = (a[k][p], a[k][q]);
                    a[k][p] = c * akp - s * akq;
                    a[k][q] = s * akp + c * akq;
                }
                for k in 0..size {
                    let (apk, aqk) = (a[p][k], a[q][k]);
                    a[p][k] = c * apk - s * aqk;
                    a[q][k] = s * apk + c * aqk;
                    let (vkp, vkq) = (v[k][p], v[k][q]);
                    v[k][p] = c * vkp - s * vkq;
                    v[k][q] = s * vkp + c * vkq;
                }
            }
        }
        if off == 0.0 {
            break;
        }
    }
    let mut best = 0;
    for k in 1..size {
        if a[k][k] > a[best][best] {
            best = k;
        }
    }
    [v[0][best], v[1][best], v[2][best]]
}

#[cfg(test)]
#[path = "eigenvalue_tests.rs"]
mod tests;
