//! Neighbour search: on a bulk-loaded R*-tree for many queries of one cloud, by boxes around runs
//! of points for few.

use std::cmp::Ordering;
use std::ops::Range;

use glam::DVec3;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use crate::parallel::{ROWS_PER_TASK, map, map_with, to_u32};
use crate::{CloudError, Neighborhoods};

/// A point of the tree with its index.
type Entry = GeomWithData<[f64; 3], u32>;

/// Factor by which the guessed ball is larger than that of the query before: small enough to hold few
/// points too many, large enough that neighbouring queries seldom find too few.
const GUESS_MARGIN: f64 = 1.15;

/// Order by distance, then by index.
fn nearer(a: &(f64, u32), b: &(f64, u32)) -> Ordering {
    a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
}

/// Refuses points that are not finite or too many.
pub(crate) fn check(points: &[DVec3]) -> Result<(), CloudError> {
    let (count, limit) = (points.len(), u32::MAX as usize);
    if count > limit {
        return Err(CloudError::TooMany { count, limit });
    }
    match points.iter().position(|point| !point.is_finite()) {
        Some(point) => Err(CloudError::NotFinite { point }),
        None => Ok(()),
    }
}

/// Points of a cloud in an R*-tree; every answer is ordered by distance, then by index.
#[derive(Debug, Clone)]
pub(crate) struct PointTree {
    tree: RTree<Entry>,
}

impl PointTree {
    /// Loads the points.
    ///
    /// # Errors
    /// [`CloudError`] for a coordinate that is not finite and for too many points.
    pub(crate) fn new(points: &[DVec3]) -> Result<Self, CloudError> {
        check(points)?;
        let entries = points
            .iter()
            .enumerate()
            .map(|(index, point)| Entry::new(point.to_array(), to_u32(index)));
        Ok(Self {
            tree: RTree::bulk_load(entries.collect()),
        })
    }

    /// The `count` nearest points with squared distances, without the point `skip`.
    ///
    /// Equal distances are ordered by index, also across the limit.
    fn nearest_into(&self, at: DVec3, count: usize, skip: u32, out: &mut Vec<(f64, u32)>) {
        out.clear();
        let at = at.to_array();
        for (entry, squared) in self.tree.nearest_neighbor_iter_with_distance_2(at) {
            // Collected beyond the limit only while the distance ties with the last one kept.
            if out.len() >= count && squared > out[out.len() - 1].0 {
                break;
            }
            if entry.data != skip {
                out.push((squared, entry.data));
            }
        }
        out.sort_unstable_by(nearer);
        out.truncate(count);
    }

    /// [`PointTree::nearest_into`] with a guess of the distance of the last one, taken from the
    /// query before and replaced by what this one found.
    ///
    /// Points within a ball come faster out of the tree than points in order of distance; where the
    /// ball holds too few, the ordered search answers. The answer does not depend on the guess.
    fn nearest_guessed_into(
        &self,
        at: DVec3,
        count: usize,
        skip: u32,
        guess: &mut f64,
        out: &mut Vec<(f64, u32)>,
    ) {
        out.clear();
        let center = at.to_array();
        if *guess > 0.0 {
            let found = self.tree.locate_within_distance(center, *guess * *guess);
            out.extend(found.filter(|entry| entry.data != skip).map(|entry| {
                let squared = (DVec3::from_array(*entry.geom()) - at).length_squared();
                (squared, entry.data)
            }));
        }
        if out.len() < count {
            self.nearest_into(at, count, skip, out);
        } else {
            if out.len() > count {
                out.select_nth_unstable_by(count - 1, nearer);
                out.truncate(count);
            }
            out.sort_unstable_by(nearer);
        }
        if out.len() == count {
            *guess = GUESS_MARGIN * out[count - 1].0.sqrt();
        }
    }

    /// Indices of all points with `|x − at| ≤ radius` but one, ascending.
    fn row(&self, at: DVec3, radius: f64, skip: u32) -> Vec<u32> {
        let near = self
            .tree
            .locate_within_distance(at.to_array(), radius * radius);
        let near = near.map(|entry| entry.data).filter(|&index| index != skip);
        let mut row: Vec<u32> = near.collect();
        row.sort_unstable();
        row
    }
}

/// Boxes around runs of consecutive points: made in one pass, for a few queries of points that move.
///
/// A query looks at all boxes around groups of runs, at the runs of near groups and at the points of near runs. Where
/// consecutive points are far from each other it looks at every point; the answer is exact in any order.
#[derive(Debug, Clone)]
pub(crate) struct PointRuns {
    count: usize,
    boxes: Vec<[DVec3; 2]>,
    /// Around every [`GROUP`] of them.
    groups: Vec<[DVec3; 2]>,
}

/// Points in a run.
const RUN: usize = 64;
/// Runs in a group.
const GROUP: usize = 32;

/// Squared distance of a point from a box.
fn away([low, high]: &[DVec3; 2], at: DVec3) -> f64 {
    (*low - at)
        .max(at - *high)
        .max(DVec3::ZERO)
        .length_squared()
}

/// Which box is nearest, the first of equal ones.
fn nearest_box(boxes: &[[DVec3; 2]], at: DVec3) -> Option<usize> {
    let distances = boxes.iter().map(|b| away(b, at)).enumerate();
    let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.map(|(index, _)| index)
}

impl PointRuns {
    /// # Errors
    /// As [`PointTree::new`].
    pub(crate) fn new(points: &[DVec3]) -> Result<Self, CloudError> {
        check(points)?;
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let enclose = |run: &[DVec3]| {
            run.iter()
                .fold(none, |[low, high], &x| [low.min(x), high.max(x)])
        };
        let boxes: Vec<_> = points.chunks(RUN).map(enclose).collect();
        let join = |group: &[[DVec3; 2]]| {
            let boxes = group.iter();
            boxes.fold(none, |[low, high], [a, b]| [low.min(*a), high.max(*b)])
        };
        let groups = boxes.chunks(GROUP).map(join).collect();
        Ok(Self {
            count: points.len(),
            boxes,
            groups,
        })
    }

    /// Points of a run.
    fn points_of(&self, run: usize) -> Range<usize> {
        run * RUN..self.count.min((run + 1) * RUN)
    }

    /// Runs of a group.
    fn runs_of(&self, group: usize) -> Range<usize> {
        group * GROUP..self.boxes.len().min((group + 1) * GROUP)
    }

    /// Points of the runs whose boxes are no farther than `reach` from a point, ascending.
    pub(crate) fn near(&self, at: DVec3, reach: f64) -> impl Iterator<Item = Range<usize>> + '_ {
        let is_near = move |around: &[DVec3; 2]| away(around, at) <= reach * reach;
        let groups = (0..self.groups.len()).filter(move |&group| is_near(&self.groups[group]));
        let runs = groups.flat_map(|group| self.runs_of(group));
        let runs = runs.filter(move |&run| is_near(&self.boxes[run]));
        runs.map(|run| self.points_of(run))
    }

    /// The `count` nearest points no farther than `reach`, with squared distances; equal distances are ordered by
    /// index, also across the limit. `points` are those of the start.
    pub(crate) fn nearest_into(
        &self,
        points: &[DVec3],
        at: DVec3,
        reach: f64,
        count: usize,
        out: &mut Vec<(f64, u32)>,
    ) {
        out.clear();
        let Some(first_group) = nearest_box(&self.groups, at) else {
            return;
        };
        let runs = self.runs_of(first_group);
        let first = runs.start + nearest_box(&self.boxes[runs], at).unwrap_or_default();
        // The nearest box first: what it holds rules most others out.
        let mut farthest = reach * reach;
        let mut look = |run: usize, farthest: &mut f64| {
            for node in self.points_of(run) {
                let found = ((points[node] - at).length_squared(), to_u32(node));
                if found.0 > *farthest {
                    continue;
                }
                let place = out.partition_point(|other| nearer(other, &found).is_lt());
                out.insert(place, found);
                out.truncate(count);
                if out.len() == count {
                    *farthest = out[count - 1].0;
                }
            }
        };
        if away(&self.boxes[first], at) <= farthest {
            look(first, &mut farthest);
        }
        for (group, around) in self.groups.iter().enumerate() {
            if away(around, at) > farthest {
                continue;
            }
            for run in self.runs_of(group) {
                if run != first && away(&self.boxes[run], at) <= farthest {
                    look(run, &mut farthest);
                }
            }
        }
    }
}

/// Balls around points, found by the box they touch.
#[derive(Debug, Clone)]
pub(crate) struct BallTree {
    tree: RTree<GeomWithData<Rectangle<[f64; 3]>, u32>>,
}

impl BallTree {
    /// Loads balls whose centres have been checked to be finite, radii positive.
    pub(crate) fn new(centres: &[DVec3], radii: impl Iterator<Item = f64>) -> Self {
        let balls = (0_u32..)
            .zip(centres.iter().zip(radii))
            .map(|(index, (&x, r))| {
                let corners = [x - r, x + r].map(|corner| corner.to_array());
                GeomWithData::new(Rectangle::from_corners(corners[0], corners[1]), index)
            });
        Self {
            tree: RTree::bulk_load(balls.collect()),
        }
    }

    /// Balls whose boxes hold a point, in no particular order.
    pub(crate) fn around(&self, at: DVec3) -> impl Iterator<Item = u32> + '_ {
        let point = AABB::from_point(at.to_array());
        self.tree
            .locate_in_envelope_intersecting(point)
            .map(|ball| ball.data)
    }
}

/// How [`k_nearest`] chooses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestSettings {
    /// Number of nearest nodes k whose mean distance sets the support radius.
    pub nearest: usize,
    /// Support radius = `scale` × mean distance to the k nearest.
    pub scale: f64,
    /// Most neighbours a node keeps, nearest first; `None` keeps all within the support radius.
    pub limit: Option<usize>,
}

impl Default for NearestSettings {
    /// 16 nearest, support radius 1.5 × their mean distance, at most 16 neighbours.
    fn default() -> Self {
        Self {
            nearest: 16,
            scale: 1.5,
            limit: Some(16),
        }
    }
}

/// Neighbourhoods from the k nearest nodes, with what the search measured on the way.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct KNearest {
    /// Neighbours within the support radius, at most the limit. Not symmetric in general.
    pub neighborhoods: Neighborhoods,
    /// Support radius h of every node (m), shape `(n)`.
    pub support_radii: Vec<f64>,
    /// Mean distance r̄ of every node to its k nearest (m), shape `(n)`.
    pub mean_distances: Vec<f64>,
}

/// Neighbourhoods of the dissertation: `h_i` = scale × mean distance to the k nearest nodes, and the
/// neighbours are the nodes within `h_i`, nearest first up to an optional limit (Aras 2014, 2.3).
///
/// Equal distances are ordered by index, so lattices and coincident nodes give the same answer on
/// every machine. A cloud with fewer than k other nodes uses those there are; a node whose k nearest
/// all coincide with it gets the radius 0.
///
/// # Errors
/// [`CloudError`] for points that are not finite, too many points, `nearest` or `limit` 0, or a
/// scale that is not positive.
pub fn k_nearest(points: &[DVec3], settings: &NearestSettings) -> Result<KNearest, CloudError> {
    if settings.nearest == 0 || settings.limit == Some(0) {
        return Err(CloudError::NoNeighbors);
    }
    positive("the support scale", settings.scale)?;
    let tree = PointTree::new(points)?;
    let found: Vec<(Vec<u32>, (f64, f64))> = map_with(
        points.len(),
        ROWS_PER_TASK,
        |(buffer, guess): &mut (Vec<_>, f64), node| {
            let at = points[node];
            let wanted = settings.nearest.max(settings.limit.unwrap_or(0));
            tree.nearest_guessed_into(at, wanted, to_u32(node), guess, buffer);
            let nearest = &buffer[..settings.nearest.min(buffer.len())];
            let sum: f64 = nearest.iter().map(|&(squared, _)| squared.sqrt()).sum();
            let mean = if nearest.is_empty() {
                0.0
            } else {
                sum / nearest.len() as f64
            };
            let radius = settings.scale * mean;
            let row = match settings.limit {
                None => tree.row(at, radius, to_u32(node)),
                Some(limit) => {
                    let near = buffer.iter().take(limit);
                    let near = near.filter(|&&(squared, _)| squared <= radius * radius);
                    let mut row: Vec<u32> = near.map(|&(_, index)| index).collect();
                    row.sort_unstable();
                    row
                }
            };
            (row, (radius, mean))
        },
    );
    let (rows, (support_radii, mean_distances)) = found.into_iter().unzip();
    Ok(KNearest {
        neighborhoods: join(rows)?,
        support_radii,
        mean_distances,
    })
}

/// Neighbourhoods of all nodes with `|X_j − X_i| ≤ radius`; symmetric.
///
/// # Examples
/// ```
/// use phyxel_mls::{glam::DVec3, within_radius};
///
/// let line: Vec<DVec3> = (0..5).map(|k| DVec3::X * f64::from(k)).collect();
/// let near = within_radius(&line, 1.5)?;
/// assert_eq!((near.row(0), near.row(2)), (&[1][..], &[1, 3][..]));
/// # Ok::<(), phyxel_mls::CloudError>(())
/// ```
///
/// # Errors
/// [`CloudError`] for points that are not finite, too many points or pairs, or a radius that is not
/// positive.
pub fn within_radius(points: &[DVec3], radius: f64) -> Result<Neighborhoods, CloudError> {
    positive("the radius", radius)?;
    let tree = PointTree::new(points)?;
    join(map(points.len(), ROWS_PER_TASK, |node| {
        tree.row(points[node], radius, to_u32(node))
    }))
}

/// Rows of a search to CSR.
fn join(rows: Vec<Vec<u32>>) -> Result<Neighborhoods, CloudError> {
    let count = rows.iter().map(Vec::len).sum();
    Neighborhoods::from_rows(rows).map_err(|_| CloudError::TooMany {
        count,
        limit: u32::MAX as usize,
    })
}

/// Refuses a quantity that is not positive and finite.
pub(crate) fn positive(name: &'static str, value: f64) -> Result<(), CloudError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(CloudError::NotPositive { name, value })
    }
}

#[cfg(test)]
mod tests;
