//! The rules by which a cut weakens a pair.

use glam::DVec3;

use crate::cuts::Cuts;
use crate::path::{OFFSET, PathScratch, shortest_path};

/// How the factor of a crossed pair is found; of a pair that is not crossed it is 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Rule {
    /// Shortest path around the cut, `f = W(L/h) / W(r/h)`; the diffraction criterion
    /// (Organ, Fleming, Terry, Belytschko 1996) with exponent 1, for any shape in the plane and in
    /// space.
    #[default]
    Diffraction,
    /// Nothing passes a cut, `f = 0` (Belytschko, Lu, Gu 1994). Baseline: the crack acts up to
    /// half a spacing too long.
    Visibility,
}

/// Weight over the distance relative to the influence radius, `W(q) = (1 − q²)³` (Aras 2014,
/// eq. (15), without its constant).
fn kernel(q: f64) -> f64 {
    let s = (1.0 - q * q).max(0.0);
    s * s * s
}

impl Rule {
    /// Nothing farther than this fraction of the influence radius from a pair's middle can change its
    /// factor: half for the path itself, and the offset of its diffraction points.
    pub(crate) const MARGIN: f64 = 0.5 + OFFSET;

    /// Factor of the pair with nodes at `a` and `b`: exactly 1 if it is not crossed, below 1 if it is, exactly 0 if it
    /// is severed.
    ///
    /// # Arguments
    /// * `cut` -- all triangles.
    /// * `a`, `b` -- rest positions (m).
    /// * `radius` -- influence radius of the pair (m).
    /// * `inside` -- whether a point lies in the uncut body.
    #[must_use]
    pub fn factor(
        self,
        cut: &Cuts,
        a: DVec3,
        b: DVec3,
        radius: f64,
        inside: &(dyn Fn(DVec3) -> bool + Sync),
    ) -> f64 {
        if cut.crosses(a, b) {
            let scratch = &mut PathScratch::default();
            self.crossed_factor(cut, a, b, radius, inside, scratch).0
        } else {
            1.0
        }
    }

    /// Factor of a pair that is known to be crossed, and the direction out of the cut of the path that it is bent
    /// around: zero where it is severed or the rule knows no path.
    pub(crate) fn crossed_factor(
        self,
        cut: &Cuts,
        a: DVec3,
        b: DVec3,
        radius: f64,
        inside: &(dyn Fn(DVec3) -> bool + Sync),
        scratch: &mut PathScratch,
    ) -> (f64, DVec3) {
        let direct = a.distance(b);
        let path = match self {
            Self::Visibility => None,
            Self::Diffraction => shortest_path(cut, a, b, radius, inside, scratch),
        };
        match path {
            Some((length, outward)) if length < radius && direct < radius => {
                // Below 1 even where the path touches the pair's line: crossed pairs stay known.
                let factor = kernel(length / radius) / kernel(direct / radius);
                (factor.min(1.0 - f64::EPSILON), outward)
            }
            _ => (0.0, DVec3::ZERO),
        }
    }
}
