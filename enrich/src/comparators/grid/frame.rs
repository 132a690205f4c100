//! Common frame of a cut and the formulas in it.

use glam::{DVec2, DVec3};

use super::Enrichment;
use crate::face::nearest_on_triangle;
use crate::index::Bounds;
use crate::predicate::{left_of, segments_cross};

/// Why the enrichment grid of a cut would be wrong.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// A coordinate is NaN or infinite.
    #[error("point {point} of the cut is not finite")]
    NotFinite {
        /// Place of the point (its capture).
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
pub(super) enum Frame {
    Planar(Planar),
    Spatial(Spatial),
}

#[derive(Debug, Clone)]
pub(super) struct Planar {
    points: Vec<DVec2>,
    /// `p0` and the unit direction of `θ0`, eqs. (39) and (40).
    pub(super) origin: DVec2,
    pub(super) along: DVec2,
    /// t-coordinates of the points, eq. (42), increasing.
    t: Vec<f64>,
}

#[derive(Debug, Clone)]
pub(super) struct Spatial {
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

/// [`Spatial::beside`] over the size of the cut: far above rounding, far below any lattice.
const BESIDE: f64 = 1e-12;

impl Frame {
    pub(super) fn planar(points: &[DVec2]) -> Result<Self, GridError> {
        if points.len() < 2 {
            return Err(GridError::TooFewPoints {
                found: points.len(),
            });
        }
        if let Some(point) = points.iter().position(|p| !p.is_finite()) {
            return Err(GridError::NotFinite { point });
        }
        let (mut total, mut origin, mut mean) = (0.0, DVec2::ZERO, DVec2::ZERO);
        for (piece, w) in points.windows(2).enumerate() {
            let length = w[0].distance(w[1]);
            if length <= 0.0 {
                return Err(GridError::DegeneratePiece { piece });
            }
            total += length;
            origin += length * w[0].midpoint(w[1]);
            // Directions are averaged as vectors: eq. (40) averages angles, which wraps at ±π.
            mean += w[1] - w[0];
        }
        let (origin, mean) = (origin / total, mean / total);
        if mean.length() < SMALLEST_MEAN {
            return Err(GridError::NoCommonFrame {
                length: mean.length(),
            });
        }
        let along = mean.normalize();
        let t: Vec<f64> = points.iter().map(|&p| along.dot(p - origin)).collect();
        if let Some(piece) = t.windows(2).position(|w| w[1] <= w[0]) {
            return Err(GridError::OverlappingProjection {
                first: piece.saturating_sub(1),
                second: piece,
            });
        }
        Ok(Self::Planar(Planar {
            points: points.to_vec(),
            origin,
            along,
            t,
        }))
    }

    pub(super) fn spatial(blades: &[[DVec3; 2]]) -> Result<Self, GridError> {
        if blades.len() < 2 {
            return Err(GridError::TooFewPoints {
                found: blades.len(),
            });
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
        if mean.length() < SMALLEST_MEAN {
            return Err(GridError::NoCommonFrame {
                length: mean.length(),
            });
        }
        let normal = mean.normalize();
        let project = |p: DVec3| p - normal.dot(p - origin) * normal;
        let triangles: Vec<_> = corners
            .iter()
            .zip(&normals)
            .map(|(&c, &n)| (c, c.map(project), n))
            .collect();
        let separators = blades
            .iter()
            .map(|&[p, q]| (project(p), normal.cross(project(q) - project(p))))
            .collect();
        let bounds = Bounds::of(blades.as_flattened());
        let frame = Spatial {
            blades: blades.to_vec(),
            origin,
            normal,
            separators,
            triangles,
            beside: BESIDE * bounds.low.distance(bounds.high),
        };
        frame.check()?;
        Ok(Self::Spatial(frame))
    }

    pub(super) fn is_planar(&self) -> bool {
        matches!(self, Self::Planar(_))
    }

    pub(super) fn bounds(&self) -> Bounds {
        match self {
            Self::Planar(frame) => {
                let points: Vec<DVec3> = frame.points.iter().map(|p| p.extend(0.0)).collect();
                Bounds::of(&points)
            }
            Self::Spatial(frame) => Bounds::of(frame.blades.as_flattened()),
        }
    }

    /// Cosine of the largest angle between a triangle and the common plane; 1 in the plane.
    pub(super) fn least_cosine(&self) -> f64 {
        let Self::Spatial(frame) = self else {
            return 1.0;
        };
        let cosines = frame.triangles.iter().map(|(.., n)| n.dot(frame.normal));
        cosines.fold(1.0, f64::min)
    }

    pub(super) fn evaluate(&self, point: DVec3) -> Enrichment {
        match self {
            Self::Planar(frame) => frame.evaluate(point.truncate()),
            Self::Spatial(frame) => frame.evaluate(point),
        }
    }
}

fn enrichment(region: usize, s: f64, d_plus: f64) -> Enrichment {
    let distance = d_plus.hypot(s);
    Enrichment {
        region: crate::obstacle::index32(region),
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

impl Planar {
    fn evaluate(&self, point: DVec2) -> Enrichment {
        let last = self.t.len() - 1;
        let t = self.along.dot(point - self.origin); // eq. (41)
        let region = self.t[1..last].partition_point(|&end| end < t);
        let (a, b) = (self.points[region], self.points[region + 1]);
        let s = (b - a).normalize().perp_dot(point - a); // eq. (44)
        let d_plus = (self.t[0] - t).max(0.0) + (t - self.t[last]).max(0.0); // eq. (43)
        enrichment(region, s, d_plus)
    }
}

impl Spatial {
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

    fn evaluate(&self, point: DVec3) -> Enrichment {
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
        let size = self.bounds_diagonal();
        for (k, &[p, q, r]) in triangles.iter().enumerate() {
            if (q - p).perp_dot(r - p) <= 1e-12 * size * size {
                // Seen from behind or on edge: it covers its neighbour.
                return Err(GridError::OverlappingProjection {
                    first: (k / 2).saturating_sub(1),
                    second: k / 2,
                });
            }
            for (m, other) in triangles.iter().enumerate().take(k) {
                if triangles_overlap([p, q, r], *other) {
                    return Err(GridError::OverlappingProjection {
                        first: m / 2,
                        second: k / 2,
                    });
                }
            }
        }
        for piece in 0..self.blades.len() - 1 {
            let corners = &self.triangles[2 * piece..2 * piece + 2];
            let middle = corners.iter().flat_map(|(_, t, _)| *t).sum::<DVec3>() / 6.0;
            let region = self.region(middle);
            if region != piece {
                return Err(GridError::AmbiguousRegion {
                    piece,
                    region: crate::obstacle::index32(region),
                });
            }
        }
        Ok(())
    }

    fn bounds_diagonal(&self) -> f64 {
        let bounds = Bounds::of(self.blades.as_flattened());
        bounds.low.distance(bounds.high)
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
    let inside = |t: &[DVec2; 3], p: DVec2| (0..3).all(|k| left_of(t[k], t[(k + 1) % 3], p));
    inside(&a, b[0])
        || inside(&b, a[0])
        || (0..3)
            .any(|i| (0..3).any(|j| segments_cross(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3])))
}
