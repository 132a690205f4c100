//! Points hashed by cell, to find those near a place.

use glam::DVec3;

/// Points hashed by cell: buckets of a fixed table, so no order of a map is ever seen.
pub(crate) struct Grid {
    cell: f64,
    buckets: Vec<Vec<u32>>,
}

impl Grid {
    pub(crate) fn new(cell: f64, expected: usize) -> Self {
        Self {
            cell,
            buckets: vec![Vec::new(); (expected / 2).next_power_of_two().max(64)],
        }
    }

    #[allow(
        clippy::cast_possible_truncation,
        reason = "cells wrap in the hash anyway"
    )]
    fn coordinates(&self, p: DVec3) -> [i64; 3] {
        (p / self.cell).floor().to_array().map(|x| x as i64)
    }

    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a hash"
    )]
    fn bucket(&self, [x, y, z]: [i64; 3]) -> usize {
        let mixed =
            x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663) ^ z.wrapping_mul(83_492_791);
        mixed as usize & (self.buckets.len() - 1)
    }

    pub(crate) fn insert(&mut self, p: DVec3, id: u32) {
        let bucket = self.bucket(self.coordinates(p));
        self.buckets[bucket].push(id);
    }

    /// Calls `visit` for every point in cells up to `rings` away (some of other cells too, some twice);
    /// whether those are all points there are.
    #[allow(
        clippy::cast_precision_loss,
        reason = "counts of cells and of buckets, compared"
    )]
    pub(crate) fn visit(&self, p: DVec3, rings: i64, mut visit: impl FnMut(u32)) -> bool {
        // More cells than buckets: each bucket once is less work, and it is bounded by the points.
        if (2 * rings + 1) as f64 > (self.buckets.len() as f64).cbrt() {
            self.buckets.iter().flatten().copied().for_each(visit);
            return true;
        }
        let [x, y, z] = self.coordinates(p);
        for dz in -rings..=rings {
            for dy in -rings..=rings {
                for dx in -rings..=rings {
                    for &id in &self.buckets[self.bucket([x + dx, y + dy, z + dz])] {
                        visit(id);
                    }
                }
            }
        }
        false
    }

    /// Ids of the points within a radius, ascending; `at` gives their places.
    pub(crate) fn within_into(
        &self,
        p: DVec3,
        radius: f64,
        at: impl Fn(u32) -> DVec3,
        out: &mut Vec<u32>,
    ) {
        out.clear();
        #[allow(clippy::cast_possible_truncation, reason = "a few rings")]
        let rings = (radius / self.cell).ceil() as i64;
        self.visit(p, rings, |id| {
            if at(id).distance_squared(p) <= radius * radius {
                out.push(id);
            }
        });
        out.sort_unstable();
        out.dedup();
    }

    /// The nearest point, the one of smaller id where two are equally near. At least one must have
    /// been inserted.
    pub(crate) fn nearest(&self, p: DVec3, at: impl Fn(u32) -> DVec3) -> u32 {
        let mut best = (f64::INFINITY, u32::MAX);
        let mut reach = 0.0;
        for rings in 1.. {
            let all = self.visit(p, rings, |id| {
                let candidate = (at(id).distance_squared(p), id);
                if candidate < best {
                    best = candidate;
                }
            });
            reach += self.cell;
            if all || best.0 <= reach * reach {
                break;
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Few points in a plane, and places from among them to a million cells away.
    #[test]
    fn a_grid_finds_what_looking_at_every_point_finds() {
        let noise = |k: u32| f64::from(k.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
        for count in [1, 7, 300] {
            let points: Vec<DVec3> = (0..count)
                .map(|k| DVec3::new(20.0 * noise(2 * k), 20.0 * noise(2 * k + 1), 0.0))
                .collect();
            let mut grid = Grid::new(1.0, points.len());
            for (k, p) in points.iter().enumerate() {
                grid.insert(*p, crate::mesh::index(k));
            }
            let at = |id: u32| points[id as usize];
            let mut near = Vec::new();
            for distance in [0.0, 3.0, 40.0, 1e6] {
                let place = DVec3::new(0.3, 0.2, 0.6) * distance;
                for radius in [0.5, 4.0, 1.05 * distance] {
                    grid.within_into(place, radius, at, &mut near);
                    let within = |id: &u32| at(*id).distance_squared(place) <= radius * radius;
                    let brute: Vec<u32> = (0..count).filter(within).collect();
                    assert_eq!(
                        near, brute,
                        "{count} points, {distance} away, within {radius}"
                    );
                }
                let nearest = (0..count).min_by(|a, b| {
                    let far = |id: &u32| at(*id).distance_squared(place);
                    far(a).total_cmp(&far(b)).then(a.cmp(b))
                });
                assert_eq!(Some(grid.nearest(place, at)), nearest);
            }
        }
    }
}
