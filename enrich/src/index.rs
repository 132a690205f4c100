//! Spatial index of boxes that come one by one and have any size.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::ops::ControlFlow;

use glam::DVec3;

/// Closed axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates (m).
    pub low: DVec3,
    /// Largest coordinates (m).
    pub high: DVec3,
}

impl Bounds {
    /// The box that contains nothing.
    pub const EMPTY: Self = Self {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
    };

    /// Smallest box round some points.
    #[must_use]
    pub fn of(points: &[DVec3]) -> Self {
        points.iter().fold(Self::EMPTY, |b, &p| Self {
            low: b.low.min(p),
            high: b.high.max(p),
        })
    }

    /// This box with every face moved outward by `margin`.
    #[must_use]
    pub fn grown(self, margin: f64) -> Self {
        Self {
            low: self.low - DVec3::splat(margin),
            high: self.high + DVec3::splat(margin),
        }
    }

    /// Smallest box round both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Whether the boxes have a point in common.
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }

    /// Distance of a point to the box, 0 inside.
    #[must_use]
    pub fn distance(&self, p: DVec3) -> f64 {
        (self.low - p).max(p - self.high).max(DVec3::ZERO).length()
    }
}

/// Multiply-and-rotate hash of small integers; the map is never iterated.
#[derive(Default, Clone)]
pub(crate) struct CellHasher(u64);

impl Hasher for CellHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }

    fn write_u32(&mut self, value: u32) {
        self.write_u64(u64::from(value));
    }

    fn write_i64(&mut self, value: i64) {
        self.write_u64(value.cast_unsigned());
    }

    fn write_u64(&mut self, value: u64) {
        self.0 = (self.0.rotate_left(26) ^ value).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}

pub(crate) type CellMap<K, V> = HashMap<K, V, BuildHasherDefault<CellHasher>>;

/// Hash grids of cell sizes `cell · 2^k`; a box lives in the level whose cells are not smaller than
/// it, so in at most eight cells.
#[derive(Debug, Clone)]
pub(crate) struct BoxIndex {
    cell: f64,
    levels: Vec<Level>,
    bounds: Bounds,
}

#[derive(Debug, Clone)]
struct Level {
    exponent: i32,
    items: usize,
    cells: CellMap<[i64; 3], Vec<u32>>,
}

#[allow(
    clippy::cast_possible_truncation,
    reason = "the cast saturates: boxes beyond 2^63 cells share the last cell and are still found"
)]
fn cell_of(p: DVec3, size: f64) -> [i64; 3] {
    (p / size).floor().to_array().map(|c| c as i64)
}

fn for_cells(
    low: [i64; 3],
    high: [i64; 3],
    mut f: impl FnMut([i64; 3]) -> ControlFlow<()>,
) -> ControlFlow<()> {
    for z in low[2]..=high[2] {
        for y in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                f([x, y, z])?;
            }
        }
    }
    ControlFlow::Continue(())
}

impl BoxIndex {
    /// An empty index whose smallest cells have the given size (m).
    pub(crate) fn new(cell: f64) -> Self {
        Self {
            cell,
            levels: Vec::new(),
            bounds: Bounds::EMPTY,
        }
    }

    /// An empty one with cells of the same sizes.
    pub(crate) fn emptied(&self) -> Self {
        Self::new(self.cell)
    }

    fn level_of(&self, bounds: &Bounds) -> i32 {
        let extent = (bounds.high - bounds.low).max_element();
        let mut exponent = 0;
        while exponent < 1000 && self.cell * f64::from(exponent).exp2() < extent {
            exponent += 1;
        }
        exponent
    }

    fn size(&self, exponent: i32) -> f64 {
        self.cell * f64::from(exponent).exp2()
    }

    /// Adds a box under a number of the caller's choice.
    pub(crate) fn insert(&mut self, id: u32, bounds: Bounds) {
        let exponent = self.level_of(&bounds);
        let size = self.size(exponent);
        let position = match self.levels.binary_search_by_key(&exponent, |l| l.exponent) {
            Ok(k) => k,
            Err(k) => {
                let level = Level {
                    exponent,
                    items: 0,
                    cells: CellMap::default(),
                };
                self.levels.insert(k, level);
                k
            }
        };
        let level = &mut self.levels[position];
        level.items += 1;
        let (low, high) = (cell_of(bounds.low, size), cell_of(bounds.high, size));
        let _ = for_cells(low, high, |key| {
            level.cells.entry(key).or_default().push(id);
            ControlFlow::Continue(())
        });
        self.bounds = self.bounds.union(bounds);
    }

    /// Calls `f` for every box that may meet `query`, some of them more than once, until it breaks.
    pub(crate) fn query(
        &self,
        query: &Bounds,
        mut f: impl FnMut(u32) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if !self.bounds.meets(query) {
            return ControlFlow::Continue(());
        }
        let clipped = Bounds {
            low: query.low.max(self.bounds.low),
            high: query.high.min(self.bounds.high),
        };
        for level in &self.levels {
            let size = self.size(level.exponent);
            let (low, high) = (cell_of(clipped.low, size), cell_of(clipped.high, size));
            let visited: i128 = (0..3)
                .map(|k| i128::from(high[k]) - i128::from(low[k]) + 1)
                .product();
            if visited > 4 * level.cells.len() as i128 {
                // A query far larger than this level's cells: all boxes of the level, in the order
                // of their cells, so that no answer depends on the map's order.
                let mut keys: Vec<_> = level.cells.keys().collect();
                keys.sort_unstable();
                for &id in keys.into_iter().flat_map(|key| &level.cells[key]) {
                    f(id)?;
                }
                continue;
            }
            for_cells(low, high, |key| {
                for &id in level.cells.get(&key).map_or(&[][..], Vec::as_slice) {
                    f(id)?;
                }
                ControlFlow::Continue(())
            })?;
        }
        ControlFlow::Continue(())
    }

    /// Numbers of all boxes that may meet `query`, sorted, each once.
    pub(crate) fn collect(&self, query: &Bounds, out: &mut Vec<u32>) {
        out.clear();
        let _ = self.query(query, |id| {
            out.push(id);
            ControlFlow::Continue(())
        });
        out.sort_unstable();
        out.dedup();
    }

    /// Bytes held on the heap, about.
    pub(crate) fn bytes(&self) -> usize {
        self.levels
            .iter()
            .map(|l| l.cells.capacity() * 56 + l.items * 16)
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::cloud::Random;

    #[test]
    fn finds_what_brute_force_finds() {
        let mut random = Random::new(5);
        let mut index = BoxIndex::new(0.1);
        let mut boxes = Vec::new();
        for id in 0..300_u32 {
            let at = random.vector(1.0);
            // Sizes over five decades, points and huge boxes among them.
            let size: f64 = [0.0, 1e-3, 0.05, 0.3, 40.0][id as usize % 5];
            let other = at + random.vector(size.max(1e-300));
            let bounds = Bounds::of(&[at, other]);
            index.insert(id, bounds);
            boxes.push(bounds);
        }
        let mut found = Vec::new();
        for k in 0..300 {
            let at = random.vector(2.0);
            let query = Bounds::of(&[at, at + random.vector([0.01, 0.3, 5.0][k % 3])]);
            index.collect(&query, &mut found);
            for (id, bounds) in (0..).zip(&boxes) {
                if bounds.meets(&query) {
                    assert!(found.contains(&id), "{id}");
                }
            }
        }
    }
}
