//! Stress intensities by a fit of Williams' series (1957) to displacements round a crack's tip.

use std::f64::consts::PI;

use crate::problems::cracks::{POISSON, YOUNG};

/// Terms `r^(n/2)` of the series, n from -1: a tip that a body resolves a share of a spacing off leaves a term of
/// `r^(-1/2)`, which is no part of the intensity.
const TERMS: usize = 9;
const UNKNOWNS: usize = 2 * TERMS;

/// Displacements of unit coefficients, symmetric and antisymmetric, at a place in the frame of the tip; plane
/// strain. The crack runs along negative x.
fn term(k: usize, [x, y]: [f64; 2]) -> [[f64; 2]; 2] {
    let (shear, kappa) = (YOUNG / (2.0 * (1.0 + POISSON)), 3.0 - 4.0 * POISSON);
    let (r, theta) = (x.hypot(y), y.atan2(x));
    #[allow(clippy::cast_precision_loss, reason = "a few terms")]
    let half = 0.5 * (k as f64 - 1.0);
    let sign = if k.is_multiple_of(2) { -1.0 } else { 1.0 };
    let scale = r.powf(half) / (2.0 * shear);
    let (s, c) = (half * theta).sin_cos();
    let (t, d) = ((half - 2.0) * theta).sin_cos();
    [
        [
            scale * ((kappa + half + sign) * c - half * d),
            scale * ((kappa - half - sign) * s + half * t),
        ],
        [
            -scale * ((kappa + half - sign) * s - half * t),
            scale * ((kappa - half + sign) * c + half * d),
        ],
    ]
}

/// `K_I` and `K_II` (Pa m^1/2) of the least squares of displacements (m) at places (m) in the frame of the tip.
pub(super) fn stress_intensities(field: &[([f64; 2], [f64; 2])]) -> [f64; 2] {
    // In units of the largest distance, so that no term outweighs the others.
    let size = field
        .iter()
        .fold(0.0_f64, |most, ([x, y], _)| most.max(x.hypot(*y)));
    let mut system = [[0.0; UNKNOWNS + 1]; UNKNOWNS];
    for ([x, y], moved) in field {
        let terms: Vec<[[f64; 2]; 2]> = (0..TERMS).map(|k| term(k, [x / size, y / size])).collect();
        for (axis, moved) in moved.iter().enumerate() {
            let of = |unknown: usize| terms[unknown / 2][unknown % 2][axis];
            for (row, line) in system.iter_mut().enumerate() {
                for (column, entry) in line[..UNKNOWNS].iter_mut().enumerate() {
                    *entry += of(row) * of(column);
                }
                line[UNKNOWNS] += of(row) * moved;
            }
        }
    }
    let found = solved(system);
    let unit = (2.0 * PI / size).sqrt();
    [found[4] * unit, -found[5] * unit]
}

/// Gauss' elimination with pivots. A rotation has no antisymmetric twin: its column is zero and is left out.
fn solved(mut system: [[f64; UNKNOWNS + 1]; UNKNOWNS]) -> [f64; UNKNOWNS] {
    let mut answer = [0.0; UNKNOWNS];
    let mut lead = [None; UNKNOWNS];
    let mut row = 0;
    for column in 0..UNKNOWNS {
        let best = (row..UNKNOWNS).max_by(|&a, &b| {
            let size = |at: usize| system[at][column].abs();
            size(a).total_cmp(&size(b))
        });
        let Some(best) = best.filter(|&best| system[best][column].abs() > f64::MIN_POSITIVE) else {
            continue;
        };
        system.swap(row, best);
        let pivot = system[row];
        for (at, line) in system.iter_mut().enumerate() {
            if at != row {
                let share = line[column] / pivot[column];
                for (entry, pivot) in line.iter_mut().zip(&pivot) {
                    *entry -= share * pivot;
                }
            }
        }
        lead[column] = Some(row);
        row += 1;
    }
    for (column, row) in lead.iter().enumerate() {
        if let Some(row) = row {
            answer[column] = system[*row][UNKNOWNS] / system[*row][column];
        }
    }
    answer
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The crack `|x| < 1` in an infinite plane under tension and shear at infinity (Muskhelishvili 1953):
    /// `2 μ (u_x + i u_y) = κ φ(z) - φ(conj z) - (z - conj z) conj(φ'(z))`, `φ = (σ - i τ)/2 sqrt(z² - 1)`.
    fn griffith([tension, shear]: [f64; 2], x: f64, y: f64) -> [f64; 2] {
        type Complex = [f64; 2];
        let times = |a: Complex, b: Complex| [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]];
        let (mu, kappa) = (YOUNG / (2.0 * (1.0 + POISSON)), 3.0 - 4.0 * POISSON);
        // sqrt(z² - 1) with its cut along the crack: sqrt(z - 1) sqrt(z + 1).
        let root = |w: Complex| {
            let (r, t) = (w[0].hypot(w[1]).sqrt(), 0.5 * w[1].atan2(w[0]));
            [r * t.cos(), r * t.sin()]
        };
        let s = times(root([x - 1.0, y]), root([x + 1.0, y]));
        let norm = s[0] * s[0] + s[1] * s[1];
        let half = [0.5 * tension, -0.5 * shear];
        let (phi, mirrored) = (times(half, s), times(half, [s[0], -s[1]]));
        let slope = times(half, times([x, y], [s[0] / norm, -s[1] / norm]));
        let last = times([0.0, 2.0 * y], [slope[0], -slope[1]]);
        [0, 1].map(|k| (kappa * phi[k] - mirrored[k] - last[k]) / (2.0 * mu))
    }

    #[test]
    fn a_crack_in_a_plane_has_its_stress_intensities() {
        for load in [[1.0, 0.0], [0.0, 1.0], [0.7, -0.4]] {
            let mut field = Vec::new();
            for k in 0..400_u32 {
                let r = 0.02 + 0.3 * f64::from(k % 20) / 20.0;
                let theta = PI * (f64::from(k / 20) + 0.5) / 10.0 - PI;
                let (s, c) = theta.sin_cos();
                let at = [r * c, r * s];
                field.push((at, griffith(load, 1.0 + at[0], at[1])));
            }
            let found = stress_intensities(&field);
            for (found, load) in found.iter().zip(load) {
                let expected = load * PI.sqrt();
                assert!(
                    (found - expected).abs() < 2e-3,
                    "{load}: {found} of {expected}"
                );
            }
        }
    }
}
