//! Common frame of a cut and the formulas in it.

use glam::{DVec2, DVec3};

use super::Enrichment;
use crate::bounds::Bounds;
use crate::face::nearest_on_triangle;
use crate::predicate::left_of;

/// Why the enrichment grid of a cut would be wrong.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// A coordinate is NaN or infinite.
    #[error("point {point} of the cut is not finite")]
    NotFinite {
        /// Position of the point (its capture).
        point: usize,
    },
    /// There is no piece.
    #[error("{found} captures make no cut; give at least 2")]
    TooFewPoints {
        /// Captures given.
        found: usize,
    },
    /// The mean direction or normal vanishes: the cut is closed, folded or twisted.
    #[error(
        "mean direction of the pieces has length {length:.3}: the cut closes, folds or twists and \
         has no common frame; use the diffraction rule"
    )]
    NoCommonFrame {
        /// Length of the weighted mean of unit vectors, 1 for a flat cut.
        length: f64,
    },
    /// Two pieces cover each other in the common frame.
    #[error(
        "pieces {first} and {second} overlap in the common frame, so a point there has two regions; \
         use the diffraction rule"
    )]
    OverlappingProjection {
        /// One of them.
        first: usize,
        /// The other.
        second: usize,
    },
    /// The separators give a piece's own middle to another piece.
    #[error("the middle of piece {piece} falls into region {region}; use the diffraction rule")]
    AmbiguousRegion {
        /// The piece.
        piece: usize,
        /// The region it falls into.
        region: u32,
    },
    /// A piece has no length or area.
    #[error("piece {piece} has no length or area; drop repeated points first")]
    DegeneratePiece {
        /// The piece.
        piece: usize,
    },
    /// More lattice points than allowed.
    #[error("{points:.3e} lattice points, limit {limit}; make the grid coarser")]
    TooLarge {
        /// Points asked for.
        points: f64,
        /// The limit.
        limit: usize,
    },
}

/// The two triangles of the piece between two edges (m).
pub(in crate::comparators) fn piece_between(
    [a, b]: [DVec3; 2],
    [c, d]: [DVec3; 2],
) -> [[DVec3; 3]; 2] {
    [[a, b, c], [c, b, d]]
}

/// Below this length of the mean of unit vectors a common frame means nothing: pieces stand at more
/// than 60 degrees to it on average.
const SMALLEST_MEAN: f64 = 0.5;

#[derive(Debug, Clone)]
pub(super) struct Frame {
    blades: Vec<[DVec3; 2]>,
    /// `c0` and `n0`, eqs. (45) and (46).
    pub(super) origin: DVec3,
    pub(super) normal: DVec3,
    /// Origin and direction of the separators between groups, fig. 30.
    separators: Vec<(DVec3, DVec3)>,
    /// Two triangles per group: corners, projected corners, unit normal.
    triangles: Vec<([DVec3; 3], [DVec3; 3], DVec3)>,
    /// Distance (m) in the plane up to which a point counts as beside the cut.
    beside: f64,
}

/// [`Frame::beside`] over the size of the cut: far above rounding, far below any lattice.
const BESIDE: f64 = 1e-12;

impl Frame {
    pub(super) fn new(blades: &[[DVec3; 2]]) -> Result<Self, GridError> {
        let found = blades.len();
        if found < 2 {
            return Err(GridError::TooFewPoints { found });
        }
        if let Some(point) = blades.iter().flatten().position(|p| !p.is_finite()) {
            return Err(GridError::NotFinite { point: point / 2 });
        }
        let mut corners = Vec::new();
        for w in blades.windows(2) {
            corners.extend(piece_between(w[0], w[1]));
        }
        let (mut total, mut origin, mut mean) = (0.0, DVec3::ZERO, DVec3::ZERO);
        let mut normals = Vec::new();
        for (piece, &[p, q, r]) in corners.iter().enumerate() {
            let area = (q - p).cross(r - p);
            let size = area.length();
            if size <= 0.0 {
                return Err(GridError::DegeneratePiece { piece: piece / 2 });
            }
            total += size;
            origin += size * (p + q + r) / 3.0;
            mean += area;
            normals.push(area / size);
        }
        let (origin, mean) = (origin / total, mean / total);
        let length = mean.length();
        if length < SMALLEST_MEAN {
            return Err(GridError::NoCommonFrame { length });
        }
        let normal = mean.normalize();
        let project = |p: DVec3| p - normal.dot(p - origin) * normal;
        let triangles = corners.into_iter().zip(normals);
        let triangles = triangles.map(|(c, n)| (c, c.map(project), n)).collect();
        let separator = |&[p, q]: &[DVec3; 2]| (project(p), normal.cross(project(q) - project(p)));
        let separators = blades.iter().map(separator).collect();
        let bounds = Bounds::of(blades.as_flattened());
        let frame = Self {
            blades: blades.to_vec(),
            origin,
            normal,
            separators,
            triangles,
            beside: BESIDE * bounds.low.distance(bounds.high),
        };
        frame.check()?;
        Ok(frame)
    }

    pub(super) fn bounds(&self) -> Bounds {
        Bounds::of(self.blades.as_flattened())
    }

    /// Cosine of the largest angle between a triangle and the common plane.
    pub(super) fn least_cosine(&self) -> f64 {
        let cosines = self.triangles.iter().map(|(.., n)| n.dot(self.normal));
        cosines.fold(1.0, f64::min)
    }

    fn region(&self, projected: DVec3) -> usize {
        let groups = self.blades.len() - 1;
        let mut region = 0;
        for r in 1..groups {
            let (origin, direction) = self.separators[r];
            if direction.dot(projected - origin) > 0.0 {
                region = r;
            }
        }
        region
    }

    pub(super) fn evaluate(&self, point: DVec3) -> Enrichment {
        let projected = point - self.normal.dot(point - self.origin) * self.normal;
        let region = self.region(projected);
        let distance = |k: usize| {
            let (_, flat, _) = self.triangles[k];
            nearest_on_triangle(flat, projected).distance(projected)
        };
        let (first, second) = (distance(2 * region), distance(2 * region + 1));
        // The master triangle is the nearer one in the plane.
        let (master, d_plus) = if second < first {
            (2 * region + 1, second)
        } else {
            (2 * region, first)
        };
        // What rounding leaves beside the cut would outweigh an `s` as small, of points on the cut.
        let d_plus = if d_plus > self.beside { d_plus } else { 0.0 };
        let (corners, _, normal) = self.triangles[master];
        enrichment(region, normal.dot(point - corners[0]), d_plus)
    }

    /// Refuses projections that cover themselves and regions that are not the pieces' own.
    fn check(&self) -> Result<(), GridError> {
        let across = self.normal.any_orthonormal_vector();
        let up = self.normal.cross(across);
        let flat = |p: DVec3| DVec2::new(across.dot(p), up.dot(p));
        let triangles: Vec<[DVec2; 3]> =
            self.triangles.iter().map(|(_, t, _)| t.map(flat)).collect();
        let bounds = self.bounds();
        let size = bounds.low.distance(bounds.high);
        for (k, &[p, q, r]) in triangles.iter().enumerate() {
            if (q - p).perp_dot(r - p) <= 1e-12 * size * size {
                // Seen from behind or on edge: it covers its neighbour.
                let (first, second) = ((k / 2).saturating_sub(1), k / 2);
                return Err(GridError::OverlappingProjection { first, second });
            }
            let mut before = triangles[..k].iter();
            if let Some(m) = before.position(|other| triangles_overlap([p, q, r], *other)) {
                let (first, second) = (m / 2, k / 2);
                return Err(GridError::OverlappingProjection { first, second });
            }
        }
        for piece in 0..self.blades.len() - 1 {
            let corners = &self.triangles[2 * piece..2 * piece + 2];
            let middle = corners.iter().flat_map(|(_, t, _)| *t).sum::<DVec3>() / 6.0;
            let found = self.region(middle);
            if found != piece {
                let region = crate::index32(found);
                return Err(GridError::AmbiguousRegion { piece, region });
            }
        }
        Ok(())
    }
}

fn enrichment(region: usize, s: f64, d_plus: f64) -> Enrichment {
    let distance = d_plus.hypot(s);
    Enrichment {
        region: crate::index32(region),
        s,
        d_plus,
        distance,
        phi: if distance > 0.0 {
            (s / distance).clamp(-1.0, 1.0)
        } else {
            1.0
        },
    }
}

/// Whether two triangles, both counter-clockwise, have inner points in common; both are drawn
/// together a little first, so that neighbours do not count.
fn triangles_overlap(a: [DVec2; 3], b: [DVec2; 3]) -> bool {
    let shrink = |t: [DVec2; 3]| {
        let middle = (t[0] + t[1] + t[2]) / 3.0;
        t.map(|p| p.lerp(middle, 1e-6))
    };
    let (a, b) = (shrink(a), shrink(b));
    // They are apart if all corners of one lie to the right of an edge of the other.
    let apart = |t: &[DVec2; 3], other: &[DVec2; 3]| {
        let right_of = |k: usize| other.iter().all(|&p| !left_of(t[k], t[(k + 1) % 3], p));
        (0..3).any(right_of)
    };
    !apart(&a, &b) && !apart(&b, &a)
}
