//! Stress intensities by a fit of a series to displacements around a crack's tip: Williams' (1957) where the crack is
//! straight, and what becomes of it where the crack is an arc of a circle.

use std::f64::consts::PI;

use glam::DVec2;

use crate::problems::cracks::{POISSON, YOUNG};

/// Terms `w^(n/2)` of the series at a straight crack, n from -1: a tip that a body resolves a fraction of a spacing off leaves
/// a term of `w^(-1/2)`, which is no part of the intensity.
const TERMS: usize = 9;
/// The same at an arc, whose field they follow to 0.8 radii within 5e-4; 9 and 11 terms leave 6 and 1 % of an intensity there.
const TERMS_OF_ARC: usize = 13;

fn conjugate(z: DVec2) -> DVec2 {
    DVec2::new(z.x, -z.y)
}

fn ratio(a: DVec2, b: DVec2) -> DVec2 {
    a.rotate(conjugate(b)) / b.length_squared()
}

/// `z^n`, with its cut along negative x; a point of the cut counts to its upper face, with y of -0 to the lower one.
fn power(z: DVec2, n: f64) -> DVec2 {
    DVec2::from_angle(n * z.y.atan2(z.x)) * z.length().powf(n)
}

/// A position in the frame of the tip, which straightens a crack of curvature `k` behind it.
#[derive(Debug, Clone, Copy)]
struct Place {
    z: DVec2,
    /// `w = log(1 + i k z) / (i k)`: real along the circle of the crack, negative behind the tip.
    straight: DVec2,
    /// `dw/dz`.
    slope: DVec2,
    /// The position mirrored in the circle, which is `w` conjugated.
    mirrored: DVec2,
}

impl Place {
    /// Places within `level` of the crack's line lie on its upper face, or on the lower one if that is negative.
    fn new(z: DVec2, k: f64, level: f64) -> Self {
        let turn = DVec2::X + DVec2::new(-z.y, z.x) * k;
        let mut straight = if k == 0.0 {
            z
        } else {
            DVec2::new(turn.y.atan2(turn.x), -turn.length().ln()) / k
        };
        if straight.y.abs() < level.abs() {
            straight.y = 0.0_f64.copysign(level);
        }
        Self {
            z,
            straight,
            slope: ratio(DVec2::X, turn),
            mirrored: ratio(conjugate(z), conjugate(turn)),
        }
    }

    /// Displacement of the potentials (Muskhelishvili 1953) `φ = c w^(n/2)`, `ω = ± c w^(n/2)` (+ for odd n), which
    /// leave the crack's faces free of traction: `2 μ (u_x + i u_y) = κ φ(z) - ω(z*) - (z - z*) conj(φ'(z))` with
    /// the mirrored position `z*`; plane strain.
    fn displacement(&self, order: usize, c: DVec2) -> DVec2 {
        let half = 0.5 * (order as f64 - 1.0);
        let (double_shear, kappa) = (YOUNG / (1.0 + POISSON), 3.0 - 4.0 * POISSON);
        let sign = if order.is_multiple_of(2) { 1.0 } else { -1.0 };
        let phi = c.rotate(power(self.straight, half));
        let omega = c.rotate(conjugate(power(self.straight, half))) * sign;
        let slope = c.rotate(power(self.straight, half - 1.0)) * half;
        let last = (self.z - self.mirrored).rotate(conjugate(slope.rotate(self.slope)));
        (phi * kappa - omega - last) / double_shear
    }
}

/// `K_I` and `K_II` (Pa m^1/2) of the least squares of displacements (m) at positions (m) in the frame of the tip: the
/// crack comes along negative x, on an arc of the `curvature` (1/m) whose middle lies at y = 1 / `curvature`. Places
/// within `level` (m) of its line are on its upper face, or on the lower one if that is negative.
pub(super) fn stress_intensities(field: &[(DVec2, DVec2)], curvature: f64, level: f64) -> [f64; 2] {
    // In units of the largest distance, so that no term outweighs the others.
    let size = field
        .iter()
        .fold(0.0_f64, |most, (at, _)| most.max(at.length()));
    let terms = if curvature == 0.0 {
        TERMS
    } else {
        TERMS_OF_ARC
    };
    let unknowns = 2 * terms;
    let mut system = vec![vec![0.0; unknowns + 1]; unknowns];
    for (at, moved) in field {
        let place = Place::new(*at / size, curvature * size, level / size);
        let terms: Vec<DVec2> = (0..unknowns)
            .map(|k| place.displacement(k / 2, [DVec2::X, DVec2::Y][k % 2]))
            .collect();
        for axis in 0..2 {
            for (row, line) in system.iter_mut().enumerate() {
                for (entry, term) in line.iter_mut().zip(&terms) {
                    *entry += terms[row][axis] * term[axis];
                }
                line[unknowns] += terms[row][axis] * moved[axis];
            }
        }
    }
    let found = solved(system);
    // K_I - i K_II = lim 2 sqrt(2 π w) φ'.
    let unit = (2.0 * PI / size).sqrt();
    [found[4] * unit, -found[5] * unit]
}

/// Gauss' elimination with pivots; not a number where there are too few positions.
fn solved(mut system: Vec<Vec<f64>>) -> Vec<f64> {
    let unknowns = system.len();
    for column in 0..unknowns {
        let size = |line: &[f64]| line[column].abs();
        let best =
            (column..unknowns).max_by(|&a, &b| size(&system[a]).total_cmp(&size(&system[b])));
        system.swap(column, best.unwrap_or(column));
        let pivot = system[column].clone();
        for (at, line) in system.iter_mut().enumerate() {
            if at != column {
                let share = line[column] / pivot[column];
                for (entry, pivot) in line.iter_mut().zip(&pivot) {
                    *entry -= share * pivot;
                }
            }
        }
    }
    let rows = system.iter().enumerate();
    rows.map(|(row, line)| line[unknowns] / line[row]).collect()
}

pub(crate) mod checks {
    use super::*;
    use crate::problems::cracks::references::arc_intensities;

    const KAPPA: f64 = 3.0 - 4.0 * POISSON;
    const DOUBLE_SHEAR: f64 = YOUNG / (1.0 + POISSON);

    fn root(z: DVec2) -> DVec2 {
        power(z, 0.5)
    }

    /// The crack `|x| < 1` in an infinite plane under tension and shear at infinity (Muskhelishvili 1953):
    /// `2 μ (u_x + i u_y) = κ φ(z) - φ(conj z) - (z - conj z) conj(φ'(z))`, `φ = (σ - i τ)/2 sqrt(z² - 1)`.
    fn griffith(load: DVec2, z: DVec2) -> DVec2 {
        // sqrt(z² - 1) with its cut along the crack: sqrt(z - 1) sqrt(z + 1).
        let s = root(z - DVec2::X).rotate(root(z + DVec2::X));
        let half = conjugate(load) * 0.5;
        let (phi, mirrored) = (half.rotate(s), half.rotate(conjugate(s)));
        let slope = half.rotate(ratio(z, s));
        let last = DVec2::new(0.0, 2.0 * z.y).rotate(conjugate(slope));
        (phi * KAPPA - mirrored - last) / DOUBLE_SHEAR
    }

    pub(crate) fn a_crack_in_a_plane_has_its_stress_intensities() {
        for load in [[1.0, 0.0], [0.0, 1.0], [0.7, -0.4]] {
            let mut field = Vec::new();
            for k in 0..400_u32 {
                let r = 0.02 + 0.3 * f64::from(k % 20) / 20.0;
                let at = DVec2::from_angle(PI * (f64::from(k / 20) + 0.5) / 10.0 - PI) * r;
                field.push((at, griffith(load.into(), DVec2::X + at)));
            }
            let found = stress_intensities(&field, 0.0, 0.0);
            for (found, load) in found.iter().zip(load) {
                let expected = load * PI.sqrt();
                let off = (found - expected).abs();
                assert!(off < 2e-3, "{load}: {found} of {expected}");
            }
        }
    }

    /// Arc of the unit circle of `half` (rad) to either side of 1, under all-round tension of 1 at infinity, faces
    /// free. From `Φ = (c (z - cos half)) / X + d`, `Ω` the same with `-d`, `X = sqrt((z - a)(z - conj a))`,
    /// `a = e^(i half)`: `Φ` at infinity is 1/2, `Ω` there the conjugate of `Φ(0)`, and nothing turns or opens round
    /// the crack.
    struct Arc {
        tip: DVec2,
        c: f64,
        d: f64,
    }

    impl Arc {
        fn new(half: f64) -> Self {
            let square = (0.5 * half).sin().powi(2);
            let c = 0.5 / (1.0 + square);
            let (tip, d) = (DVec2::from_angle(half), c * square);
            Self { tip, c, d }
        }

        /// `X`, with its cut along the arc, on which `(z - a) / (z - conj a)` has one direction.
        fn root(&self, z: DVec2) -> DVec2 {
            let (a, b) = (self.tip, conjugate(self.tip));
            let turned = ratio(ratio(z - a, z - b), a);
            (z - b).rotate(root(turned)).rotate(root(a))
        }

        /// `φ = c X + d z`, `ω = c X - d z`, by the formula of [`Place::displacement`].
        fn displacement(&self, z: DVec2) -> DVec2 {
            let mirrored = z / z.length_squared();
            let phi = self.root(z) * self.c + z * self.d;
            let omega = self.root(mirrored) * self.c - mirrored * self.d;
            let slope = ratio(z - DVec2::X * self.tip.x, self.root(z)) * self.c + DVec2::X * self.d;
            let last = (z - mirrored).rotate(conjugate(slope));
            (phi * KAPPA - omega - last) / DOUBLE_SHEAR
        }

        /// Stress on a surface through `z` with a unit normal, by differences of displacements.
        fn traction(&self, z: DVec2, normal: DVec2) -> DVec2 {
            let step = 1e-5;
            let slope = |axis: DVec2| {
                let ends = [1.0, -1.0].map(|side| self.displacement(z + axis * (side * step)));
                (ends[0] - ends[1]) / (2.0 * step)
            };
            let (x, y) = (slope(DVec2::X), slope(DVec2::Y));
            let shear = 0.5 * DOUBLE_SHEAR;
            let pressure = DOUBLE_SHEAR * POISSON / (1.0 - 2.0 * POISSON) * (x.x + y.y);
            let shearing = shear * (x.y + y.x);
            DVec2::new(
                normal.dot(DVec2::new(pressure + DOUBLE_SHEAR * x.x, shearing)),
                normal.dot(DVec2::new(shearing, pressure + DOUBLE_SHEAR * y.y)),
            )
        }
    }

    pub(crate) fn the_exact_arc_has_free_faces_tension_far_away_and_the_known_intensities() {
        let half = 0.25 * PI;
        let arc = Arc::new(half);
        for at in [-0.7, -0.3, 0.0, 0.5, 0.7_f64] {
            let normal = DVec2::from_angle(at);
            for side in [1.0 - 1e-4, 1.0 + 1e-4] {
                let traction = arc.traction(normal * side, normal);
                assert!(traction.length() < 5e-3, "{at}: {traction}");
            }
        }
        // No crack, no traction missing: on the rest of the circle it is of the order of the load.
        assert!(arc.traction(-DVec2::X, -DVec2::X).length() > 0.3);
        for normal in [DVec2::X, DVec2::Y, DVec2::new(-0.6, 0.8)] {
            let off = arc.traction(normal * 300.0, normal) - normal;
            assert!(off.length() < 1e-4, "{off}");
        }
        // Jump of the displacements near a tip: 8 (1 - ν²) / E sqrt(r / 2 π) (K_II along, K_I across).
        let r = 1e-6_f64;
        let behind = DVec2::from_angle(half - r);
        let sides = [1.0 - 1e-12, 1.0 + 1e-12].map(|side| arc.displacement(behind * side));
        let jump = sides[0] - sides[1];
        let scale = 8.0 * (1.0 - POISSON * POISSON) / YOUNG * (r / (2.0 * PI)).sqrt();
        // Ahead is turned to the left of the arc's normal; the upper face is the inner one.
        let [opening, sliding] = [jump.dot(arc.tip), jump.dot(arc.tip.perp())].map(|k| k / scale);
        for (found, known) in [-opening, sliding.abs()]
            .into_iter()
            .zip(arc_intensities(1.0, half))
        {
            assert!((found - known).abs() < 1e-3, "{found} of {known}");
        }
    }

    pub(crate) fn an_arc_has_its_stress_intensities_where_a_straight_fit_has_not() {
        let half = 0.25 * PI;
        let arc = Arc::new(half);
        // As the study has it: a lattice of a twelfth of the radius, between 2 spacings and 0.8 radii of the tip.
        let dx = 1.0 / 12.0;
        for side in [1.0, -1.0] {
            let along = arc.tip.perp();
            let known = arc_intensities(1.0, half);
            let (mut field, offset) = (Vec::new(), DVec2::new(0.11, 0.37) * dx);
            for i in -40..=40_i32 {
                for j in -40..=40_i32 {
                    let z = DVec2::new(f64::from(i), f64::from(j)) * dx - offset;
                    let from = z - arc.tip;
                    if (2.0 * dx..0.8).contains(&from.length()) {
                        // The other tip is this one mirrored.
                        let flip = |v: DVec2| ratio(v, along) * DVec2::new(1.0, side);
                        field.push((flip(from), flip(arc.displacement(z))));
                    }
                }
            }
            let [opening, sliding] = stress_intensities(&field, side, 0.0);
            for (found, known) in [opening, sliding.abs()].into_iter().zip(known) {
                assert!((found / known - 1.0).abs() < 2e-3, "{found} of {known}");
            }
            let straight = stress_intensities(&field, 0.0, 0.0)[0] / known[0];
            assert!((straight - 1.0).abs() > 0.04, "{straight} of the known");
        }
    }
}
