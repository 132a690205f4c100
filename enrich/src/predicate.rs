//! Exact crossing tests, with one rule for points that lie exactly on a cut.
//!
//! The rule: every query point is moved by the same infinitesimal vector `(e, e², e³)`. A point on
//! a cut therefore belongs to the side that this vector points to: the side of larger x, or, where
//! the cut contains the x direction, of larger y, then z. Because all query points move alike, the
//! test is that of points in general position: exact, the same for a reversed segment, for any order
//! of a triangle's corners, and free of gaps and double hits along shared edges.
//!
//! Signs come from Shewchuk 1997 (crate `robust`).

use glam::{DVec2, DVec3};
use robust::{Coord, Coord3D, orient2d, orient3d};

fn coord3(p: DVec3) -> Coord3D<f64> {
    Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    }
}

/// Exact sign of twice the area of the triangle of `(x, y)` points, positive counter-clockwise.
fn area_sign(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> i8 {
    let at = |p: (f64, f64)| Coord { x: p.0, y: p.1 };
    sign(orient2d(at(a), at(b), at(c)))
}

fn sign(value: f64) -> i8 {
    if value > 0.0 {
        1
    } else if value < 0.0 {
        -1
    } else {
        0
    }
}

/// Exact signs of the components of a triangle's normal `(q − p) × (r − p)`.
pub(crate) fn normal_signs(p: DVec3, q: DVec3, r: DVec3) -> [i8; 3] {
    [
        area_sign((p.y, p.z), (q.y, q.z), (r.y, r.z)),
        area_sign((p.z, p.x), (q.z, q.x), (r.z, r.x)),
        area_sign((p.x, p.y), (q.x, q.y), (r.x, r.y)),
    ]
}

/// Whether `a` lies on the side of triangle `pqr` that its normal `(q − p) × (r − p)` points to.
///
/// Exact, with the module's rule for points on the plane. False for a degenerate triangle.
pub(crate) fn above(p: DVec3, q: DVec3, r: DVec3, a: DVec3) -> bool {
    // det[p − a, q − a, r − a] falls along the normal.
    let exact = sign(orient3d(coord3(p), coord3(q), coord3(r), coord3(a)));
    let value = match exact {
        0 => first_nonzero(normal_signs(p, q, r)),
        s => -s,
    };
    value > 0
}

fn first_nonzero(signs: [i8; 3]) -> i8 {
    signs.into_iter().find(|&s| s != 0).unwrap_or(0)
}

/// Side on which the directed line `a -> b` passes the directed edge `p -> q`; 0 only if parallel.
fn passing_side(a: DVec3, b: DVec3, p: DVec3, q: DVec3) -> i8 {
    match sign(orient3d(coord3(a), coord3(b), coord3(p), coord3(q))) {
        0 => first_nonzero([
            product_difference_sign([b.y, a.y, p.z, q.z], [b.z, a.z, p.y, q.y]),
            product_difference_sign([b.z, a.z, p.x, q.x], [b.x, a.x, p.z, q.z]),
            product_difference_sign([b.x, a.x, p.y, q.y], [b.y, a.y, p.x, q.x]),
        ]),
        s => s,
    }
}

/// Whether the segment `ab` crosses the triangle `pqr`.
pub(crate) fn segment_crosses_triangle(a: DVec3, b: DVec3, p: DVec3, q: DVec3, r: DVec3) -> bool {
    if above(p, q, r, a) == above(p, q, r, b) {
        return false;
    }
    let first = passing_side(a, b, p, q);
    first != 0 && first == passing_side(a, b, q, r) && first == passing_side(a, b, r, p)
}

/// Whether `a` lies to the left of the directed line `p -> q` in the plane.
///
/// Exact, with the module's rule for points on the line. False if `p = q`.
pub(crate) fn left_of(p: DVec2, q: DVec2, a: DVec2) -> bool {
    let value = match area_sign((p.x, p.y), (q.x, q.y), (a.x, a.y)) {
        0 => first_nonzero([sign(p.y - q.y), sign(q.x - p.x), 0]),
        s => s,
    };
    value > 0
}

/// Exact sign of `(m0 − m1)(m2 − m3) − (n0 − n1)(n2 − n3)`.
fn product_difference_sign(m: [f64; 4], n: [f64; 4]) -> i8 {
    /// Bounds the relative round-off of either product and of their difference (4.5e-16).
    const FILTER: f64 = 1e-15;
    let left = (m[0] - m[1]) * (m[2] - m[3]);
    let right = (n[0] - n[1]) * (n[2] - n[3]);
    let value = left - right;
    if value.abs() > FILTER * (left.abs() + right.abs()) {
        return sign(value);
    }
    let mut sum = Expansion::default();
    sum.add_product(two_difference(m[0], m[1]), two_difference(m[2], m[3]));
    let (high, low) = two_difference(n[0], n[1]);
    sum.add_product((-high, -low), two_difference(n[2], n[3]));
    sum.sign()
}

/// A sum of at most 16 numbers kept without any round-off (Shewchuk 1997, Grow-Expansion).
#[derive(Default)]
struct Expansion {
    terms: [f64; 16],
    count: usize,
}

impl Expansion {
    fn add(&mut self, value: f64) {
        let mut carry = value;
        for term in &mut self.terms[..self.count] {
            let (high, low) = two_sum(carry, *term);
            *term = low;
            carry = high;
        }
        self.terms[self.count] = carry;
        self.count += 1;
    }

    fn add_product(&mut self, a: (f64, f64), b: (f64, f64)) {
        for (x, y) in [(a.1, b.1), (a.1, b.0), (a.0, b.1), (a.0, b.0)] {
            let (high, low) = two_product(x, y);
            self.add(low);
            self.add(high);
        }
    }

    fn sign(&self) -> i8 {
        let terms = self.terms[..self.count].iter().rev();
        terms.map(|&t| sign(t)).find(|&s| s != 0).unwrap_or(0)
    }
}

fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let high = a + b;
    let b_part = high - a;
    let a_part = high - b_part;
    (high, (a - a_part) + (b - b_part))
}

fn two_difference(a: f64, b: f64) -> (f64, f64) {
    two_sum(a, -b)
}

fn two_product(a: f64, b: f64) -> (f64, f64) {
    let high = a * b;
    let (a_high, a_low) = split(a);
    let (b_high, b_low) = split(b);
    let error = ((high - a_high * b_high) - a_low * b_high) - a_high * b_low;
    (high, a_low * b_low - error)
}

/// Splits a number into halves of 26 bits (Dekker 1971).
fn split(a: f64) -> (f64, f64) {
    let c = 134_217_729.0 * a;
    let high = c - (c - a);
    (high, a - high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::cloud::Random;

    /// A triangle without area, a line without direction: nothing is on the side that they do not have.
    #[test]
    fn nothing_is_above_a_triangle_without_area() {
        let (p, q) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 4.0, 6.0));
        for a in [DVec3::ZERO, DVec3::X, -DVec3::X, DVec3::Z, p] {
            for [p, q, r] in [[p, p, p], [p, q, p], [p, q, DVec3::ZERO]] {
                assert!(!above(p, q, r, a), "{a} above {p}, {q}, {r}");
            }
            assert!(!left_of(p.truncate(), p.truncate(), a.truncate()), "{a}");
        }
    }

    #[test]
    fn products_are_compared_exactly() {
        // Integers up to 2^26: i128 is the reference. Offsets make the differences inexact in f64.
        let mut random = Random::new(3);
        let mut zeros = 0;
        for trial in 0..2000_u32 {
            let mut whole = || i64::from((random.bits() & 0x3ff_ffff) as u32) - (1 << 25);
            let shift = (0.1 * f64::from(trial % 3), 1e-9);
            let m = [whole(), whole(), whole(), whole()];
            let n = if trial % 2 == 0 {
                [m[2], m[3], m[0], m[1]]
            } else {
                [whole(), whole(), whole(), whole()]
            };
            let exact = |v: [i64; 4]| i128::from(v[0] - v[1]) * i128::from(v[2] - v[3]);
            let expected = (exact(m) - exact(n)).signum();
            let float = |v: [i64; 4]| v.map(|x| x as f64);
            let found = product_difference_sign(float(m), float(n));
            assert_eq!(i128::from(found), expected);
            zeros += u32::from(expected == 0);
            // Same lines, moved so that no coordinate is representable: still antisymmetric.
            let moved = |v: [i64; 4]| v.map(|x| x as f64 * shift.1 + shift.0);
            let (m, n) = (moved(m), moved(n));
            let turned = -product_difference_sign(n, m);
            assert_eq!(product_difference_sign(m, n), turned);
        }
        assert!(zeros > 500, "{zeros}");
    }

    #[test]
    fn order_and_orientation_do_not_matter() {
        // Points on a coarse lattice: most tests are ties.
        let mut random = Random::new(7);
        let mut hits = 0;
        for _ in 0..20_000 {
            let mut point = || {
                let mut c = || (random.bits() % 4) as f64 - 1.0;
                DVec3::new(c(), c(), c())
            };
            let (a, b, p, q, r) = (point(), point(), point(), point(), point());
            if normal_signs(p, q, r) == [0; 3] {
                continue;
            }
            let hit = segment_crosses_triangle(a, b, p, q, r);
            hits += u32::from(hit);
            for (x, y, z) in [(q, r, p), (r, p, q), (r, q, p), (q, p, r), (p, r, q)] {
                assert_eq!(segment_crosses_triangle(a, b, x, y, z), hit);
                assert_eq!(segment_crosses_triangle(b, a, x, y, z), hit);
            }
        }
        assert!(hits > 300, "{hits}");
    }

    #[test]
    fn tetrahedra_are_watertight_for_lattice_points() {
        // A closed surface is crossed an even number of times by a segment between two points of
        // the same side, even where the segment runs through corners and edges.
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|p| p * 2.0);
        let faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
        let faces = faces.map(|face| face.map(|k| corners[k]));
        let count = |a: DVec3, b: DVec3| {
            let crossed = |[p, q, r]: &&[DVec3; 3]| segment_crosses_triangle(a, b, *p, *q, *r);
            faces.iter().filter(crossed).count()
        };
        let far = DVec3::new(-11.0, -5.0, -7.0);
        let lattice: Vec<DVec3> = (0..125)
            .map(|k| DVec3::new((k % 5) as f64, (k / 5 % 5) as f64, (k / 25) as f64) - DVec3::ONE)
            .collect();
        let inside: Vec<bool> = lattice.iter().map(|&p| count(p, far) % 2 == 1).collect();
        assert!(inside.iter().any(|&x| x) && inside.iter().any(|&x| !x));
        for (i, &a) in lattice.iter().enumerate() {
            for (j, &b) in lattice.iter().enumerate() {
                assert_eq!(count(a, b) % 2 == 1, inside[i] != inside[j], "{a} {b}");
            }
        }
    }

    #[test]
    fn point_on_the_cut_belongs_to_the_side_of_larger_x() {
        let (p, q, r) = (DVec3::ZERO, DVec3::Y, DVec3::Z);
        let on = DVec3::new(0.0, 0.25, 0.25);
        assert!(!segment_crosses_triangle(on, on + DVec3::X, p, q, r));
        assert!(segment_crosses_triangle(on, on - DVec3::X, p, q, r));
    }
}
