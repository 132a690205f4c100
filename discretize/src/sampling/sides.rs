//! What stuffing asks of a body: signs at lattice points and crossings of edges.

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::{Crossing, Groups};
use crate::sampling::{SHIFT, SampleError, Solid};

/// Values below this fraction of the box's diagonal count as on the surface.
const ON_SURFACE: f64 = 1e-13;
/// Smallest offset of the lattice from a mesh's faces, in cells: far above round-off and far below what
/// moves lattice points onto the surface.
const OFFSET: f64 = 1.0 / 1024.0;
/// Halvings of an edge until its crossing is known to round-off.
const HALVINGS: usize = 60;

/// All of them, or the error of the first that has one: on threads, `collect` returns that of any.
pub(crate) fn first_error<T: Send>(
    all: impl IndexedParallelIterator<Item = Result<T, SampleError>>,
) -> Result<Vec<T>, SampleError> {
    let all: Vec<Result<T, SampleError>> = all.collect();
    all.into_iter().collect()
}

impl Solid {
    /// By how much of a cell the background leaves the box's lower corner. A face of a mesh in a plane of
    /// the lattice would leave it to round-off which of the points there are inside; of an implicit
    /// body these have sign 0.
    pub(crate) fn offset(&self) -> DVec3 {
        match self.mesh() {
            Some(_) => OFFSET * SHIFT,
            None => DVec3::ZERO,
        }
    }

    /// Connected parts of a mesh over shared vertices: part per triangle, and their number; none of an implicit body.
    pub(crate) fn parts(&self) -> &(Vec<u32>, usize) {
        self.parts.get_or_init(|| {
            let Some(mesh) = self.mesh() else {
                return (Vec::new(), 0);
            };
            let mut parts = Groups::new(mesh.vertices.len());
            for [a, b, c] in &mesh.triangles {
                parts.join(*a, *b);
                parts.join(*a, *c);
            }
            parts.numbers(mesh.triangles.iter().map(|t| t[0]))
        })
    }

    /// Sign at a point: 1 inside, 0 on the surface, -1 outside.
    pub(crate) fn sign_at(&self, at: DVec3) -> Result<i8, SampleError> {
        if self.mesh().is_some() {
            return Ok(if self.contains(at) { 1 } else { -1 });
        }
        let value = self.signed_distance(at);
        if value.is_nan() {
            return Err(SampleError::NotANumber { at });
        }
        let on_surface = value.abs() <= ON_SURFACE * self.bounds().diagonal();
        let side = if value < 0.0 { 1 } else { -1 };
        Ok(if on_surface { 0 } else { side })
    }

    /// Where the edge from an inside to an outside point leaves the body (first time), and the
    /// part of the surface met there (`u32::MAX` if not known).
    pub(crate) fn crossing(
        &self,
        inside: DVec3,
        outside: DVec3,
        scratch: &mut Vec<Crossing>,
    ) -> (DVec3, u32) {
        if let Some(hierarchy) = self.hierarchy() {
            scratch.clear();
            hierarchy.crossings_into(inside, outside, scratch);
            let first = scratch.iter().min_by(|a, b| {
                a.parameter
                    .total_cmp(&b.parameter)
                    .then(a.triangle.cmp(&b.triangle))
            });
            if let Some(first) = first {
                let at = inside + first.parameter * (outside - inside);
                return (at, self.parts().0[first.triangle as usize]);
            }
        }
        (self.bisect(inside, outside), u32::MAX)
    }

    /// Regula falsi of the Illinois kind, kept inside a shrinking bracket.
    fn bisect(&self, inside: DVec3, outside: DVec3) -> DVec3 {
        let value = |t: f64| self.signed_distance(inside + t * (outside - inside));
        let (mut a, mut b) = (0.0, 1.0);
        let (mut fa, mut fb) = (value(a), value(b));
        let mut side = 0;
        for round in 0..HALVINGS {
            let secant = (a * fb - b * fa) / (fb - fa);
            let t = if round % 4 == 3 || !(secant > a && secant < b) {
                0.5 * (a + b)
            } else {
                secant
            };
            let ft = value(t);
            if ft == 0.0 {
                return inside + t * (outside - inside);
            }
            if ft < 0.0 {
                (a, fa) = (t, ft);
                if side == -1 {
                    fb *= 0.5;
                }
                side = -1;
            } else {
                (b, fb) = (t, ft);
                if side == 1 {
                    fa *= 0.5;
                }
                side = 1;
            }
            if b - a < 4.0 * f64::EPSILON {
                break;
            }
        }
        inside + a * (outside - inside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// A thread that waits before the first error does not let a later one pass for it.
    #[test]
    fn the_first_error_is_returned_on_any_number_of_threads() {
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let found = pool.build().unwrap().install(|| {
                first_error((0..64_u8).into_par_iter().map(|k| {
                    if k == 0 {
                        std::thread::sleep(Duration::from_millis(20));
                    }
                    let at = DVec3::splat(f64::from(k));
                    let fails = k == 3 || k > 40;
                    if fails {
                        Err(SampleError::NotANumber { at })
                    } else {
                        Ok(k)
                    }
                }))
            });
            let first = SampleError::NotANumber {
                at: DVec3::splat(3.0),
            };
            assert_eq!(found.unwrap_err().to_string(), first.to_string());
        }
    }
}
