//! Splat radii: the default without holes, and the dissertation's rules.

use crate::cast::index;
use crate::error::{SurfelError, one_per_point};
use crate::render::Surfel;
use crate::tissue::{CAPSULE, NodeTree, line_of_plane, point_tree, symmetric_eigen};
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

/// Radii of the surfels on a surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum RadiusRule {
    /// As small as leaves no hole between neighbours: the circumradius of a surfel's Voronoi cell in its tangent
    /// plane.
    #[default]
    Covering,
    /// The same everywhere (m).
    Constant(f64),
    /// By what the neighbourhood says of detail, linearly from least to most (Aras 2014, section 4.5).
    Mapped {
        /// What is measured.
        measure: Measure,
        /// Nearest neighbours that are looked at.
        #[cfg_attr(feature = "serde", serde(default = "RadiusRule::default_neighbors"))]
        neighbors: u32,
        /// Smallest radius (m).
        least: f64,
        /// Largest radius (m).
        most: f64,
        /// Whether it is measured again where a cut touches the surface, and on the new skin inside it (Aras
        /// 2014, fig. 78), by the map of the uncut surface; if not, the surface keeps its radii and new skin
        /// gets those of `Covering`.
        #[cfg_attr(feature = "serde", serde(default))]
        at_cuts: bool,
    },
}

impl RadiusRule {
    #[cfg(feature = "serde")]
    const fn default_neighbors() -> u32 {
        12
    }
}

/// What a surfel's neighbourhood says of detail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Measure {
    /// Mean distance to the neighbours (m), eq. (52): dense means detailed.
    Density,
    /// Curvature from the height over a fitted plane (1/m), eqs. (53)-(56).
    Curvature,
    /// Fraction of the neighbours' spread across their plane, eq. (57): the smallest eigenvalue of their covariance
    /// over the sum; 0 for a plane, 1/3 for a ball of points.
    Variation,
}

impl Surfel {
    /// Surfels at points with normals of any length, with the radii that just cover the surface and the
    /// curvature that their neighbours tell. The areas are those of the disks; material 0.
    ///
    /// # Errors
    /// [`SurfelError::BadSurfel`] names the first point or normal that is not finite, or a zero normal;
    /// [`SurfelError::Counts`] if there is not one normal per point.
    ///
    /// # Numerics
    /// Disks cover where samples are closer together than the radius of curvature; a point without
    /// others gets the radius 0. See [`crate::covering_radii`].
    pub fn covering(positions: &[DVec3], normals: &[DVec3]) -> Result<Vec<Self>, SurfelError> {
        let areas = vec![1.0; positions.len()];
        let rule = RadiusRule::Covering;
        let (mut surfels, _) = Self::from_samples(positions, normals, &areas, rule)?;
        for surfel in &mut surfels {
            surfel.area = std::f64::consts::PI * surfel.radius * surfel.radius;
        }
        Ok(surfels)
    }

    /// Checks samples as a surface sampler gives them and makes their normals unit; material 0. Also a tree over them.
    ///
    /// # Errors
    /// [`SurfelError::BadSurfel`] names the first surfel with a value that is not finite, a zero
    /// normal or an area that is not positive; [`SurfelError::Counts`] if the slices differ in length.
    pub(crate) fn from_samples(
        positions: &[DVec3],
        normals: &[DVec3],
        areas: &[f64],
        rule: RadiusRule,
    ) -> Result<(Vec<Self>, NodeTree), SurfelError> {
        one_per_point("normals", normals.len(), positions.len())?;
        one_per_point("areas", areas.len(), positions.len())?;
        let samples = positions.iter().zip(normals).zip(areas).enumerate();
        let units = samples.map(|(surfel, ((x, normal), area))| {
            let fine = x.is_finite() && area.is_finite() && *area > 0.0;
            let unit = normal.try_normalize().filter(|_| fine);
            unit.ok_or(SurfelError::BadSurfel { surfel })
        });
        let normals = units.collect::<Result<Vec<_>, _>>()?;
        let tree = point_tree(positions);
        let radii = match rule {
            RadiusRule::Covering => Vec::new(),
            other => other.radii(positions, &normals),
        };
        let surfel = |guess: &mut f64, i: usize| {
            let near = around(&tree, positions, i, guess);
            Self {
                position: positions[i],
                normal: normals[i],
                area: areas[i],
                radius: match radii.get(i) {
                    Some(&radius) => radius,
                    None => cell_radius(&near, positions, &normals, i),
                },
                shape: shape_operator(near.iter().map(|p| p.1), positions, &normals, i),
                material: CAPSULE,
                place: None,
            }
        };
        let all = (0..positions.len()).into_par_iter();
        let surfels = all.map_init(|| 0.0, surfel).collect();
        Ok((surfels, tree))
    }
}

impl RadiusRule {
    /// Radii (m) of all surfels.
    ///
    /// # Panics
    /// If the slices differ in length.
    #[must_use]
    pub fn radii(&self, positions: &[DVec3], normals: &[DVec3]) -> Vec<f64> {
        match *self {
            Self::Covering => covering_radii(positions, normals),
            Self::Constant(radius) => vec![radius; positions.len()],
            Self::Mapped {
                measure,
                neighbors,
                least,
                most,
                at_cuts: _,
            } => {
                let values = measures(positions, measure, index(neighbors));
                let map = RadiusMap::of(&values, measure, [least, most]);
                values.iter().map(|&value| map.radius(value)).collect()
            }
        }
    }
}

/// Measures every point's neighbourhood, see [`Measure`].
#[must_use]
pub fn measures(positions: &[DVec3], measure: Measure, neighbors: usize) -> Vec<f64> {
    let tree = point_tree(positions);
    positions
        .par_iter()
        .enumerate()
        .map(|(i, &x)| {
            let near: Vec<DVec3> = tree
                .nearest_neighbor_iter(x.to_array())
                .map(|p| index(p.data))
                .filter(|&j| j != i)
                .take(neighbors)
                .map(|j| positions[j])
                .collect();
            measure_of(x, &near, measure)
        })
        .collect()
}

/// A measure of the point `x` among those `near` it.
pub(crate) fn measure_of(x: DVec3, near: &[DVec3], measure: Measure) -> f64 {
    if near.is_empty() {
        return 0.0;
    }
    let share = 1.0 / near.len() as f64;
    let mean = near.iter().map(|p| p.distance(x)).sum::<f64>() * share;
    if measure == Measure::Density {
        return mean;
    }
    let centroid = near.iter().sum::<DVec3>() * share;
    let covariance = near.iter().fold(DMat3::ZERO, |sum, &p| {
        let d = p - centroid;
        sum + DMat3::from_cols(d * d.x, d * d.y, d * d.z) * share
    });
    let (values, vectors) = symmetric_eigen(covariance);
    match measure {
        Measure::Density => mean,
        Measure::Curvature if mean > 0.0 => {
            2.0 * vectors.x_axis.dot(x - centroid).abs() / (mean * mean)
        }
        Measure::Variation if values.element_sum() > 0.0 => {
            values.x.max(0.0) / values.element_sum()
        }
        Measure::Curvature | Measure::Variation => 0.0,
    }
}

/// A linear map from a range of measures to a range of radii (Aras 2014, 4.5): the smallest density distance, or
/// the largest curvature or variation, gets the smallest radius. Equal measures all get the largest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RadiusMap {
    measure: Measure,
    /// The smallest and the largest measure.
    ends: [f64; 2],
    /// The smallest and the largest radius (m).
    pub(crate) radii: [f64; 2],
}

impl RadiusMap {
    /// The map whose ends are the ends of `values`.
    pub(crate) fn of(values: &[f64], measure: Measure, radii: [f64; 2]) -> Self {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Self {
            measure,
            ends: [low, high],
            radii,
        }
    }

    /// The radius (m) of a measure, that of an end for measures beyond it.
    pub(crate) fn radius(&self, value: f64) -> f64 {
        let ([low, high], [least, most]) = (self.ends, self.radii);
        let span = high - low;
        let rise = match self.measure {
            _ if span > 0.0 => ((value - low) / span).clamp(0.0, 1.0),
            // All are alike: only what is more curved than they are is distinguished.
            Measure::Curvature | Measure::Variation if value > high => 1.0,
            _ => 0.0,
        };
        match self.measure {
            Measure::Density if span > 0.0 => least + (most - least) * rise,
            _ => most - (most - least) * rise,
        }
    }
}

/// Surfels whose cells the tangent-plane Voronoi construction looks at.
const CELL_NEIGHBORS: usize = 16;
/// How much larger than the last ball with as many the next is guessed.
const GUESS: f64 = 1.15;
/// Overlap of neighbouring disks: at exactly the circumradius the blend weight at the cell's
/// corner would be zero.
const OVERLAP: f64 = 1.15;
/// Neighbours whose normals are farther apart than this lie on another face (cosine).
pub(crate) const FACE_COSINE: f64 = 0.5;
/// Neighbours within 40° belong to the same smooth face (cosine).
const SAME_FACE: f64 = 0.766;

/// The smallest radii for which disks leave no hole on a plane: the circumradius of each surfel's
/// Voronoi cell among its 16 nearest neighbours, in its tangent plane, times 1.15 so that the
/// blend weight is positive everywhere.
///
/// Every point of a plane lies in the cell of its nearest surfel, hence in that surfel's disk.
/// Denser sampling (as curvature-adapted samplers give it) makes cells and disks smaller by
/// itself. Neighbours whose normal turns away by more than 60° are on another face, across an
/// edge; they bound the cell by their tangent plane. A cell open to one side (the border of an
/// open surface) is closed at twice the mean distance to the six nearest neighbours.
///
/// # Panics
/// If the slices differ in length.
#[must_use]
pub fn covering_radii(positions: &[DVec3], normals: &[DVec3]) -> Vec<f64> {
    assert_eq!(positions.len(), normals.len(), "one normal per position");
    let tree = point_tree(positions);
    let radius = |guess: &mut f64, i: usize| {
        cell_radius(&around(&tree, positions, i, guess), positions, normals, i)
    };
    let all = (0..positions.len()).into_par_iter();
    all.map_init(|| 0.0, radius).collect()
}

/// Squared distances (m²) and numbers of the points around one, in order: all up to the 16th that lies elsewhere, and more.
/// Sought in a ball of a `radius` (m), whose points come faster out of the tree than points in order.
fn around(tree: &NodeTree, positions: &[DVec3], i: usize, radius: &mut f64) -> Vec<(f64, usize)> {
    let x = positions[i];
    let entry = |j: u32| (positions[index(j)].distance_squared(x), index(j));
    let elsewhere = |p: &&(f64, usize)| p.0 > 0.0;
    loop {
        let ball = tree.locate_within_distance(x.to_array(), *radius * *radius);
        let mut found: Vec<(f64, usize)> = ball.map(|p| entry(p.data)).collect();
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let last = found.iter().filter(elsewhere).nth(CELL_NEIGHBORS - 1);
        if last.is_some() || radius.is_infinite() {
            *radius = last.map_or(*radius, |last| GUESS * last.0.sqrt());
            return found;
        }
        let mut ascending = tree.nearest_neighbor_iter(x.to_array());
        let farther = ascending.nth(CELL_NEIGHBORS.max(2 * found.len()));
        *radius = farther.map_or(f64::INFINITY, |p| GUESS * entry(p.data).0.sqrt());
    }
}

fn cell_radius(near: &[(f64, usize)], positions: &[DVec3], normals: &[DVec3], i: usize) -> f64 {
    let elsewhere = near.iter().filter(|p| p.0 > 0.0).take(CELL_NEIGHBORS);
    let six = elsewhere.clone().take(6).map(|p| p.0.sqrt());
    let count = six.clone().count();
    if count == 0 {
        return 0.0;
    }
    let mean = six.sum::<f64>() / count as f64;
    let planes = elsewhere.map(|&(_, j)| (positions[j], normals[j]));
    circumradius((positions[i], normals[i]), planes, 2.0 * mean) * OVERLAP
}

/// Radius (m) of a disk of skin by the rule of [`covering_radii`] among the samples `beside` it,
/// nearest first, of which those that face the same way count; at most `most`.
pub(crate) fn sheet_radius<'a>(
    surfel: &Surfel,
    beside: impl Iterator<Item = &'a Surfel>,
    most: f64,
) -> f64 {
    let alike = beside.filter(|other| other.normal.dot(surfel.normal) > FACE_COSINE);
    let planes = alike.take(CELL_NEIGHBORS).map(Surfel::plane);
    let radius = circumradius(surfel.plane(), planes, most);
    (radius * OVERLAP).min(most)
}

/// Circumradius (m) of the cell of a point on its plane among those `near`, cut off at `most`.
fn circumradius(
    (x, n): (DVec3, DVec3),
    near: impl Iterator<Item = (DVec3, DVec3)>,
    most: f64,
) -> f64 {
    let (t0, t1) = Surfel::tangents(n);
    let corners = [[-most, -most], [most, -most], [most, most], [-most, most]];
    let mut cell = corners.map(DVec2::from).to_vec();
    let mut spare = Vec::with_capacity(12);
    for (y, m) in near {
        let d = y - x;
        let (direction, offset) = if m.dot(n) > FACE_COSINE {
            // Bisector; the true distance is kept, the direction is the projected one.
            let flat = DVec2::new(d.dot(t0), d.dot(t1));
            let Some(direction) = flat.try_normalize() else {
                continue;
            };
            (direction, 0.5 * d.length())
        } else {
            // The other face's plane, where it lies in front of the surfel.
            match line_of_plane(x, (t0, t1), y, m) {
                Some((direction, offset, _)) if offset > 0.0 => (direction, offset),
                _ => continue,
            }
        };
        cut_cell(&cell, direction, offset, &mut spare);
        std::mem::swap(&mut cell, &mut spare);
    }
    let squared = cell.iter().map(|p| p.length_squared()).fold(0.0, f64::max);
    squared.sqrt().min(most)
}

/// Shape operators by least squares: the symmetric 2×2 matrix that best maps the tangent offsets of
/// the eight nearest neighbours on the same face to the change of their normals; one entry per
/// surfel, as [`Surfel::shape`]. Zero where neighbours do not span the plane.
///
/// # Panics
/// If the slices differ in length.
pub(crate) fn shape_operators(positions: &[DVec3], normals: &[DVec3]) -> Vec<DVec3> {
    assert_eq!(positions.len(), normals.len(), "one normal per position");
    let tree = point_tree(positions);
    let operator = |i: usize| {
        let near = tree.nearest_neighbor_iter(positions[i].to_array());
        shape_operator(near.map(|p| index(p.data)), positions, normals, i)
    };
    let all = (0..positions.len()).into_par_iter();
    all.map(operator).collect()
}

/// The same of one surfel, by those `near` it in order, itself among them.
fn shape_operator(
    near: impl Iterator<Item = usize>,
    positions: &[DVec3],
    normals: &[DVec3],
    i: usize,
) -> DVec3 {
    let (x, n) = (positions[i], normals[i]);
    let (t0, t1) = Surfel::tangents(n);
    // Normal equations of xx, xy, yy.
    let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
    let mut right = DVec3::ZERO;
    for j in near.take(9) {
        if normals[j].dot(n) <= SAME_FACE {
            continue;
        }
        let (d, e) = (positions[j] - x, normals[j] - n);
        let (u, v) = (d.dot(t0), d.dot(t1));
        let (a, b) = (e.dot(t0), e.dot(t1));
        uu += u * u;
        uv += u * v;
        vv += v * v;
        right += DVec3::new(u * a, v * a + u * b, v * b);
    }
    let matrix = DMat3::from_cols(
        DVec3::new(uu, uv, 0.0),
        DVec3::new(uv, uu + vv, uv),
        DVec3::new(0.0, uv, vv),
    );
    let scale = uu + vv;
    if matrix.determinant() <= 1e-6 * scale * scale * scale {
        return DVec3::ZERO;
    }
    matrix.inverse() * right
}

/// Keeps the part of a convex polygon with `p · direction <= offset`.
fn cut_cell(cell: &[DVec2], direction: DVec2, offset: f64, out: &mut Vec<DVec2>) {
    out.clear();
    for (k, &p) in cell.iter().enumerate() {
        let q = cell[(k + 1) % cell.len()];
        let (fp, fq) = (p.dot(direction) - offset, q.dot(direction) - offset);
        if fp <= 0.0 {
            out.push(p);
        }
        if (fp < 0.0 && fq > 0.0) || (fp > 0.0 && fq < 0.0) {
            out.push(p + (q - p) * (fp / (fp - fq)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn detail_gets_the_small_radius_and_equal_measures_the_large() {
        let found = |values: [f64; 3], measure, radii: [f64; 3]| {
            let map = RadiusMap::of(&values, measure, [0.5, 1.5]);
            let bits = |x: f64| x.to_bits();
            assert_eq!(values.map(|v| map.radius(v)).map(bits), radii.map(bits));
        };
        let rising = [1.0, 2.0, 3.0];
        found(rising, Measure::Density, [0.5, 1.0, 1.5]);
        found(rising, Measure::Curvature, [1.5, 1.0, 0.5]);
        found([2.0; 3], Measure::Variation, [1.5; 3]);
    }
}
