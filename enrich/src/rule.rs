//! The rules by which a cut weakens a pair.

use glam::DVec3;

use crate::index::Bounds;
use crate::obstacle::Obstacle;
use crate::way::{OFFSET, WayScratch, shortest_way};

/// How the factor of a crossed pair is found. A pair that is not crossed has the factor 1 in all of
/// them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Rule {
    /// Shortest way round the cut, `f = W(L/h) / W(r/h)`; the diffraction criterion
    /// (Organ, Fleming, Terry, Belytschko 1996) with exponent 1, for any shape in the plane and in
    /// space.
    #[default]
    Diffraction,
    /// Nothing passes a cut, `f = 0` (Belytschko, Lu, Gu 1994). Comparator: the crack acts up to
    /// half a spacing too long.
    Visibility,
    /// The longer the way along the cut to its nearest edge, the weaker:
    /// `f = W(r'/h) / W(r/h)`, `r' = r + h (s/(kappa h))^exponent`, with s the distance of the
    /// crossing from the nearest edge (Organ et al. 1996). Comparator, made for straight cuts; it
    /// never severs pairs within `kappa h` of an edge.
    Transparency {
        /// Depth from which nothing passes, as a share of the influence radius.
        kappa: f64,
        /// Exponent, 2 or more.
        exponent: f64,
    },
}

/// Work space for [`Rule::factor`]; contents do not matter.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    near: Vec<u32>,
    ways: WayScratch,
}

/// Weight over the distance relative to the influence radius, `W(q) = (1 − q²)³` (Aras 2014,
/// eq. (15), without its constant).
fn kernel(q: f64) -> f64 {
    let s = (1.0 - q * q).max(0.0);
    s * s * s
}

impl Rule {
    /// Nothing farther than this share of the influence radius from a pair's middle can change its
    /// factor: half for the way itself, and the offset of its diffraction points.
    pub(crate) const MARGIN: f64 = 0.5 + OFFSET + 0.01;

    /// Factor of the pair with nodes at `a` and `b`.
    ///
    /// # Arguments
    /// * `cut` -- all pieces.
    /// * `a`, `b` -- rest positions (m).
    /// * `radius` -- influence radius of the pair (m).
    /// * `inside` -- whether a point lies in the uncut body.
    /// * `scratch` -- work space, contents do not matter.
    ///
    /// # Numerics
    /// Exactly 1 if the pair is not crossed, below 1 if it is, exactly 0 if it is severed. A way
    /// has any number of diffraction points.
    pub fn factor<C: Obstacle>(
        &self,
        cut: &C,
        a: DVec3,
        b: DVec3,
        radius: f64,
        inside: &(dyn Fn(DVec3) -> bool + Sync),
        scratch: &mut Scratch,
    ) -> f64 {
        if cut.crosses(a, b) {
            self.crossed_factor(cut, a, b, radius, inside, scratch).0
        } else {
            1.0
        }
    }

    /// Factor of a pair that is known to be crossed, and the direction out of the cut of the way it is bent round:
    /// zero where it is severed or the rule knows no way.
    pub(crate) fn crossed_factor<C: Obstacle>(
        &self,
        cut: &C,
        a: DVec3,
        b: DVec3,
        radius: f64,
        inside: &(dyn Fn(DVec3) -> bool + Sync),
        scratch: &mut Scratch,
    ) -> (f64, DVec3) {
        let direct = a.distance(b);
        let way = match *self {
            Self::Visibility => None,
            Self::Diffraction => shortest_way(cut, a, b, radius, inside, &mut scratch.ways),
            Self::Transparency { kappa, exponent } => {
                transparency_depth(cut, a, b, kappa * radius, inside, scratch)
                    .map(|depth| direct + radius * (depth / (kappa * radius)).powf(exponent))
                    .map(|length| (length, DVec3::ZERO))
            }
        };
        match way {
            Some((length, outward)) if length < radius && direct < radius => {
                // Below 1 even where the way touches the pair's line: crossed pairs stay known.
                let factor = kernel(length / radius) / kernel(direct / radius);
                (factor.min(1.0 - f64::EPSILON), outward)
            }
            _ => (0.0, DVec3::ZERO),
        }
    }
}

/// Largest distance, over the pieces that `ab` crosses, of the crossing from the nearest edge inside the
/// body; none if it is `limit` or more.
fn transparency_depth<C: Obstacle>(
    cut: &C,
    a: DVec3,
    b: DVec3,
    limit: f64,
    inside: &(dyn Fn(DVec3) -> bool + Sync),
    scratch: &mut Scratch,
) -> Option<f64> {
    let mut pieces = Vec::new();
    cut.pieces_into(&Bounds::of(&[a, b]), &mut pieces);
    let mut depth = 0.0_f64;
    for &piece in &pieces {
        if !cut.piece_crosses(piece as usize, a, b) {
            continue;
        }
        let at = cut.meeting_point(piece as usize, a, b);
        cut.diffraction_edges_into(&Bounds::of(&[at]).grown(limit), &mut scratch.near);
        let nearest = scratch
            .near
            .iter()
            .filter(|&&edge| inside(cut.diffraction_point(edge, at, at).point))
            .map(|&edge| cut.edge_distance(edge, at))
            .fold(f64::INFINITY, f64::min);
        depth = depth.max(nearest);
    }
    (depth < limit).then_some(depth)
}
