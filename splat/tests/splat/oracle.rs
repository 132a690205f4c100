//! Exact pictures of a sphere, a torus and a box: where rays meet them, and surfels on them.

use glam::DVec3;
use phyxel_splat::{Camera, Frame, Lens};
use std::f64::consts::{PI, TAU};
use testkit::cloud::golden_sphere;
use testkit::picture::{self, Difference, Hit};

/// Distance along a ray to where a signed distance is 0: sphere tracing, to 1e-9.
pub(crate) fn trace(distance: impl Fn(DVec3) -> f64, from: DVec3, direction: DVec3) -> Option<f64> {
    let mut t = 0.0;
    for _ in 0..2000 {
        let d = distance(from + direction * t);
        if d < 1e-9 {
            return Some(t);
        }
        t += d;
        if t > 1e3 {
            return None;
        }
    }
    Some(t)
}

/// Surfel positions, normals and areas.
pub(crate) type Samples = (Vec<DVec3>, Vec<DVec3>, Vec<f64>);

/// A body whose surface is known exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shape {
    /// Radius 1.
    Sphere,
    /// Radius 1, sampled 40 times more densely at one pole than at the other.
    UnevenSphere,
    /// Axis y, radii 0.7 and 0.3.
    Torus,
    /// Half-widths 0.8, 0.6, 0.7.
    Block,
}

const MAJOR: f64 = 0.7;
const MINOR: f64 = 0.3;
const HALF: DVec3 = DVec3::new(0.8, 0.6, 0.7);

/// Signed distance to a box around the origin.
pub(crate) fn box_distance(p: DVec3, half: DVec3) -> f64 {
    let q = p.abs() - half;
    q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
}

impl Shape {
    /// All of them.
    pub(crate) const ALL: [Self; 4] = [Self::Sphere, Self::UnevenSphere, Self::Torus, Self::Block];

    /// Exact signed distance.
    pub(crate) fn distance(self, p: DVec3) -> f64 {
        match self {
            Self::Sphere | Self::UnevenSphere => p.length() - 1.0,
            Self::Torus => (p.x.hypot(p.z) - MAJOR).hypot(p.y) - MINOR,
            Self::Block => box_distance(p, HALF),
        }
    }

    /// Outward normal at a surface point.
    pub(crate) fn normal(self, p: DVec3) -> DVec3 {
        match self {
            Self::Sphere | Self::UnevenSphere => p.normalize(),
            Self::Torus => {
                let ring = DVec3::new(p.x, 0.0, p.z).normalize() * MAJOR;
                (p - ring).normalize()
            }
            Self::Block => {
                let axis = (p.abs() - HALF).max_position();
                DVec3::AXES[axis] * p[axis].signum()
            }
        }
    }

    /// About `n` evenly spread surfels.
    pub(crate) fn samples(self, n: u32) -> Samples {
        let mut out: Samples = (vec![], vec![], vec![]);
        match self {
            Self::Sphere => {
                out.0 = golden_sphere(n);
                out.2 = vec![4.0 * PI / f64::from(n); out.0.len()];
            }
            Self::UnevenSphere => {
                // Density falls as 1 / (low + (2 - 2 low) t) along y; the spiral keeps cells round.
                let low = 0.05 / 1.025;
                for (i, even) in (0..).zip(golden_sphere(n)) {
                    let t = (f64::from(i) + 0.5) / f64::from(n);
                    let y = 1.0 - 2.0 * (low * t + (1.0 - low) * t * t);
                    let ring = even.with_y(0.0).normalize() * (1.0 - y * y).sqrt();
                    out.0.push(ring.with_y(y));
                    let share = low + 2.0 * (1.0 - low) * t;
                    out.2.push(4.0 * PI * share / f64::from(n));
                }
            }
            Self::Torus => {
                // Rank-1 lattice in two angles, the small one stretched to even area.
                for i in 0..n {
                    let u = (f64::from(i) + 0.5) / f64::from(n);
                    let v = (f64::from(i) * 0.618_033_988_749_895).fract();
                    let mut a = TAU * u;
                    for _ in 0..20 {
                        let f = MAJOR * a + MINOR * a.sin() - MAJOR * TAU * u;
                        a -= f / (MAJOR + MINOR * a.cos());
                    }
                    let b = TAU * v;
                    let ring = MAJOR + MINOR * a.cos();
                    out.0
                        .push(DVec3::new(ring * b.cos(), MINOR * a.sin(), ring * b.sin()));
                    out.2.push(TAU * TAU * MAJOR * MINOR / f64::from(n));
                }
            }
            Self::Block => {
                let area = 8.0 * (HALF.x * HALF.y + HALF.y * HALF.z + HALF.z * HALF.x);
                let spacing = (area / f64::from(n)).sqrt();
                let count = |w: f64| (2.0 * w / spacing).round().max(1.0) as i32;
                let unit = |k: i32, n: i32| 2.0 * (f64::from(k) + 0.5) / f64::from(n) - 1.0;
                for axis in 0..3 {
                    let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
                    let (np, nq) = (count(HALF[p]), count(HALF[q]));
                    for sign in [-1.0, 1.0] {
                        for k in 0..np * nq {
                            let mut x = DVec3::ZERO;
                            x[axis] = HALF[axis] * sign;
                            x[p] = HALF[p] * unit(k % np, np);
                            x[q] = HALF[q] * unit(k / np, nq);
                            out.0.push(x);
                            out.2.push(4.0 * HALF[p] * HALF[q] / f64::from(np * nq));
                        }
                    }
                }
            }
        }
        out.1 = out.0.iter().map(|&p| self.normal(p)).collect();
        out
    }
}

/// Where the ray of an image's point begins, and its direction: `x` and `y` pixels from the upper left of an image `w` wide and
/// `h` high.
pub(crate) fn ray(camera: &Camera, (w, h): (f64, f64), (x, y): (f64, f64)) -> (DVec3, DVec3) {
    let aside = camera.right * (x - 0.5 * w) + camera.up * (0.5 * h - y);
    match camera.lens {
        Lens::Perspective { focal } => {
            let along = camera.forward + aside / (focal * h);
            (camera.eye, along.normalize())
        }
        Lens::Orthographic { height } => (camera.eye + aside * (height / h), camera.forward),
    }
}

/// Compares a frame with the exact picture.
pub(crate) fn compare(shape: Shape, camera: &Camera, frame: &Frame) -> Difference {
    let (w, h) = (f64::from(frame.width), f64::from(frame.height));
    let exact = (0..frame.width * frame.height).map(|k| {
        let (x, y) = (f64::from(k % frame.width), f64::from(k / frame.width));
        let (from, along) = ray(camera, (w, h), (x + 0.5, y + 0.5));
        let at = from + along * trace(|p| shape.distance(p), from, along)?;
        Some(Hit {
            depth: (at - camera.eye).dot(camera.forward),
            normal: shape.normal(at),
        })
    });
    let exact: Vec<Option<Hit>> = exact.collect();
    picture::compare(frame.width as usize, &exact, &frame.depth, |k| {
        let n = frame.normals[k].as_dvec3();
        camera.right * n.x + camera.up * n.y - camera.forward * n.z
    })
}
