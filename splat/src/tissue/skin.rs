//! Samples on a growing cut surface.

use crate::cast::whole;
use crate::tissue::{map_bytes, scatter};
use glam::DVec3;
use std::collections::HashMap;

/// Area of a triangle (m²).
#[must_use]
pub fn triangle_area(&[a, b, c]: &[DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// Step of the two-dimensional low-discrepancy sequence R2 (inverse powers of the plastic number).
const R2: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3];
/// Candidates per sample that is kept.
const CANDIDATES: usize = 10;
/// Samples chosen from one pool of candidates: bounds the quadratic cost of choosing.
const POOL: usize = 48;

/// Samples a cut that arrives triangle by triangle at a fixed density.
///
/// Replaces the algorithm of Aras 2014, fig. 63 (which repeats a coordinate, counts by area over
/// edge length, divides by zero at one step and samples shared edges twice). The number of samples
/// after any number of triangles is `floor(density · area)` exactly: the remainder is carried. Each
/// batch draws ten times as many candidates from a low-discrepancy sequence and keeps those
/// farthest from all samples so far; candidates left in holes wait for the next batch, so spacing is
/// even across strips that arrive one by one.
#[derive(Debug, Clone)]
pub struct CutSampler {
    density: f64,
    carried: f64,
    /// Starts of the sequence so far: like parts that arrive one by one would else sample it in step.
    shift: u32,
    cells: HashMap<[i64; 3], Vec<DVec3>>,
    /// Candidates of earlier triangles in the largest holes, and how far other samples are.
    reserve: Vec<(SkinSample, f64)>,
}

/// Clearance (spacings) from which a candidate that was not chosen is kept for later.
const HOLE: f64 = 0.6;
/// Candidates kept for later at most.
const RESERVE: usize = 200;

/// A sample: its point, its triangle's unit normal and number.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SkinSample {
    pub(crate) point: DVec3,
    pub(crate) normal: DVec3,
    pub(crate) triangle: u32,
}

/// The `i`th point of a sequence that starts at `shift`, folded into the triangle.
fn draw(&[a, b, c]: &[DVec3; 3], shift: [f64; 2], i: f64) -> DVec3 {
    let [mut u, mut v] = [0, 1].map(|k| (shift[k] + i * R2[k]).fract());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    a + (b - a) * u + (c - a) * v
}

impl CutSampler {
    /// Starts with nothing sampled; `density` in samples per m².
    ///
    /// # Panics
    /// If `density` is not positive and finite.
    #[must_use]
    pub fn new(density: f64) -> Self {
        let fits = density > 0.0 && density.is_finite();
        assert!(fits, "the sampling density must be positive and finite");
        Self {
            density,
            carried: 0.0,
            shift: 0,
            cells: HashMap::new(),
            reserve: Vec::new(),
        }
    }

    /// Mean distance of samples (m), `1 / sqrt(density)`.
    #[must_use]
    pub fn spacing(&self) -> f64 {
        self.density.sqrt().recip()
    }

    /// Heap bytes.
    pub(crate) fn bytes(&self) -> usize {
        let points: usize = self.cells.values().map(|cell| size_of_val(&**cell)).sum();
        points + map_bytes(&self.cells) + size_of_val(&*self.reserve)
    }

    /// Points sampled on further triangles; degenerate triangles give none.
    pub fn points(&mut self, triangles: &[[DVec3; 3]]) -> Vec<DVec3> {
        self.sample(triangles, 0)
            .into_iter()
            .map(|s| s.point)
            .collect()
    }

    /// Samples further triangles, the first of which has the number `first`.
    pub(crate) fn sample(&mut self, triangles: &[[DVec3; 3]], first: u32) -> Vec<SkinSample> {
        let mut out = Vec::new();
        let mut candidates = std::mem::take(&mut self.reserve);
        let mut owed = 0.0;
        for (number, triangle) in (first..).zip(triangles) {
            let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
            let Some(normal) = normal.try_normalize() else {
                continue;
            };
            let mut left = triangle_area(triangle) * self.density;
            while left > 0.0 {
                // A large triangle is taken in several goes so that no pool grows too big.
                let take = left.min(POOL as f64);
                left -= take;
                owed += take;
                let draws = whole((take * CANDIDATES as f64).ceil()).max(2);
                self.shift = self.shift.wrapping_add(1);
                let shift = [0, 1]
                    .map(|k| f64::from(scatter(self.shift.wrapping_mul(2) + k)) / 4_294_967_296.0);
                for i in 1..=draws {
                    let point = draw(triangle, shift, i as f64);
                    let sample = SkinSample {
                        point,
                        normal,
                        triangle: number,
                    };
                    candidates.push((sample, self.clearance(point)));
                }
                if owed >= POOL as f64 {
                    self.choose(&mut owed, &mut candidates, &mut out);
                }
            }
        }
        self.choose(&mut owed, &mut candidates, &mut out);
        self.reserve = candidates;
        out
    }

    fn cell(&self, p: DVec3) -> [i64; 3] {
        #[allow(
            clippy::cast_possible_truncation,
            reason = "saturates; far cells only merge"
        )]
        (p / (2.0 * self.spacing()))
            .to_array()
            .map(|x| x.floor() as i64)
    }

    /// Distance to the nearest sample so far, at most two spacings.
    fn clearance(&self, p: DVec3) -> f64 {
        let [x, y, z] = self.cell(p);
        let mut best = (2.0 * self.spacing()).powi(2);
        for dx in -1..=1 {
            for dy in -1..=1 {
                for dz in -1..=1 {
                    let key = [x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz)];
                    for q in self.cells.get(&key).into_iter().flatten() {
                        best = best.min(q.distance_squared(p));
                    }
                }
            }
        }
        best.sqrt()
    }

    /// Keeps the candidates farthest from everything kept, as many as are owed.
    fn choose(
        &mut self,
        owed: &mut f64,
        candidates: &mut Vec<(SkinSample, f64)>,
        out: &mut Vec<SkinSample>,
    ) {
        self.carried += *owed;
        *owed = 0.0;
        let n = whole(self.carried);
        self.carried -= n as f64;
        for _ in 0..n {
            // Of several the first.
            let order = |a: &usize, b: &usize| candidates[*a].1.total_cmp(&candidates[*b].1);
            let best = (0..candidates.len()).rev().max_by(order).unwrap_or(0);
            let (sample, _) = candidates.swap_remove(best);
            let point = sample.point;
            for candidate in candidates.iter_mut() {
                candidate.1 = candidate.1.min(candidate.0.point.distance(point));
            }
            self.cells.entry(self.cell(point)).or_default().push(point);
            out.push(sample);
        }
        let least = HOLE * self.spacing();
        candidates.retain(|c| c.1 > least);
        if candidates.len() > RESERVE {
            candidates.sort_by(|a, b| b.1.total_cmp(&a.1));
            candidates.truncate(RESERVE);
        }
    }
}
