//! An octree refined toward the surface and where a user wants smaller cells, balanced 2:1.

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::Bounds;
use crate::sampling::sides::first_error;
use crate::sampling::{Grading, SampleError, Solid, too_fine};

/// Most halvings between the largest and the smallest cell.
const MOST_LEVELS: u32 = 10;
/// Bits per axis of a cell's position in units of the smallest cell.
const BITS: u32 = 20;
/// Relative slack of comparisons between lengths that are equal but for round-off.
const SLACK: f64 = 1e-9;

/// A cell that is not divided.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Leaf {
    /// Lower corner.
    pub min: DVec3,
    /// Edge lengths; equal but for a box, whose cells are stretched to fit it.
    pub size: DVec3,
    /// The surface may pass through the cell: a triangle touches it, or the value of an implicit
    /// body's function at its centre is smaller than half its diagonal.
    pub at_surface: bool,
}

/// A position and edge length in units of the smallest cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Cell {
    pub at: [u32; 3],
    pub level: u32,
}

impl Cell {
    pub(crate) fn width(self) -> u32 {
        1 << self.level
    }

    fn children(self) -> impl Iterator<Item = Self> {
        let half = self.width() / 2;
        (0..8_u32).map(move |k| Self {
            at: [0, 1, 2].map(|axis| self.at[axis] + (k >> axis & 1) * half),
            level: self.level - 1,
        })
    }

    fn key(self) -> u64 {
        morton(self.at)
    }
}

/// Octree around a body: every cell is small enough for the size field, and no two cells that touch
/// in a face, edge or corner differ by more than a factor of two.
#[derive(Debug, Clone)]
pub struct Octree {
    origin: DVec3,
    unit: DVec3,
    /// Width of the block in units per axis.
    extent: [u32; 3],
    /// In the order of their keys.
    pub(crate) cells: Vec<Cell>,
    keys: Vec<u64>,
    pub(crate) at_surface: Vec<bool>,
}

impl Octree {
    /// Builds the octree with cells of edge `cell` (m) at the surface, graded as `grading` says;
    /// `largest` limits the number of leaves.
    ///
    /// # Errors
    /// [`SampleError`]: cell or grading out of range, more leaves than `largest`, a function that
    /// is not a number.
    pub fn new(
        solid: &Solid,
        cell: f64,
        grading: &Grading,
        largest: usize,
    ) -> Result<Self, SampleError> {
        grading.check()?;
        if !(cell.is_finite() && cell > 0.0) {
            return Err(SampleError::Spacing { spacing: cell });
        }
        let start = solid.bounds().min;
        Self::build(solid, DVec3::splat(cell), start, grading, largest)
    }

    /// The same with cells stretched along the axes and planes of surface cells at `start`.
    pub(crate) fn build(
        solid: &Solid,
        cell: DVec3,
        start: DVec3,
        grading: &Grading,
        largest: usize,
    ) -> Result<Self, SampleError> {
        let root = grading.finest_level() + grading.coarsest_level();
        debug_assert!(root <= MOST_LEVELS, "checked with the grading");
        let unit = cell / f64::from(1_u32 << grading.finest_level());
        let root_size = unit * f64::from(1_u32 << root);
        let origin = start - root_size;
        let count = ((solid.bounds().max - origin) / root_size).ceil() + 1.0;
        let cell = cell.element_sum() / 3.0;
        let fits = count.max_element() * f64::from(1_u32 << root) < f64::from(1_u32 << BITS);
        if !fits || count.element_product() > largest as f64 {
            return Err(too_fine(cell, count.element_product(), largest as f64));
        }
        #[allow(clippy::cast_possible_truncation, reason = "below 2^20")]
        let roots = count.to_array().map(|n| n as u32);
        let mut tree = Self {
            origin,
            unit,
            extent: roots.map(|n| n << root),
            cells: Vec::new(),
            keys: Vec::new(),
            at_surface: Vec::new(),
        };
        let mut open = Vec::new();
        for k in 0..roots[2] {
            for j in 0..roots[1] {
                for i in 0..roots[0] {
                    let at = [i, j, k].map(|n| n << root);
                    open.push(Cell { at, level: root });
                }
            }
        }
        let check = |cells: usize| {
            if cells > largest {
                return Err(too_fine(cell, cells as f64, largest as f64));
            }
            Ok(())
        };
        let wants_split = |c: &Cell| tree.wants_split(*c, solid, cell, grading);
        let leaves = refine(open, wants_split, check)?;
        tree.set_cells(leaves);
        for level in 0..root {
            tree.balance(level);
            check(tree.cells.len())?;
        }
        let at_surface = |c: &Cell| {
            let (center, size) = tree.place(*c);
            at_surface(solid, center, size)
        };
        tree.at_surface = tree.cells.par_iter().map(at_surface).collect();
        Ok(tree)
    }

    /// The undivided cells along a space-filling curve.
    #[must_use]
    pub fn leaves(&self) -> Vec<Leaf> {
        self.cells
            .iter()
            .zip(&self.at_surface)
            .map(|(c, at_surface)| {
                let (center, size) = self.place(*c);
                Leaf {
                    min: center - 0.5 * size,
                    size,
                    at_surface: *at_surface,
                }
            })
            .collect()
    }

    /// Position of a point given in halves of the smallest cell.
    pub(crate) fn point(&self, halves: [u32; 3]) -> DVec3 {
        self.origin + 0.5 * self.unit * DVec3::from_array(halves.map(f64::from))
    }

    /// Mean edge of the leaf that holds a point, of the smallest cell outside the block.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "places in the block are below 2^20 units"
    )]
    pub(crate) fn size_at(&self, p: DVec3) -> f64 {
        let at = ((p - self.origin) / self.unit).floor().to_array();
        let leaf = self.leaf_at(at.map(|x| x as i64));
        self.edge(leaf.map_or(1, |leaf| self.cells[leaf].width()))
    }

    /// Mean edge of a cell of a width in units.
    pub(crate) fn edge(&self, width: u32) -> f64 {
        self.unit.element_sum() / 3.0 * f64::from(width)
    }

    /// The leaf that holds the cell at a position in units; `None` outside the block.
    pub(crate) fn leaf_at(&self, at: [i64; 3]) -> Option<usize> {
        let mut inside = [0_u32; 3];
        for axis in 0..3 {
            inside[axis] = u32::try_from(at[axis])
                .ok()
                .filter(|x| *x < self.extent[axis])?;
        }
        let key = morton(inside);
        Some(self.keys.partition_point(|k| *k <= key) - 1)
    }

    /// Middle and edge lengths of a cell.
    fn place(&self, c: Cell) -> (DVec3, DVec3) {
        let w = c.width();
        (
            self.point(c.at.map(|x| 2 * x + w)),
            self.unit * f64::from(w),
        )
    }

    fn set_cells(&mut self, mut cells: Vec<Cell>) {
        cells.par_sort_unstable_by_key(|c| c.key());
        self.keys = cells.iter().map(|c| c.key()).collect();
        self.cells = cells;
    }

    fn wants_split(
        &self,
        c: Cell,
        solid: &Solid,
        cell: f64,
        grading: &Grading,
    ) -> Result<bool, SampleError> {
        if c.level == 0 {
            return Ok(false);
        }
        let (center, size) = self.place(c);
        let reach = 0.5 * size.length();
        let size = size.element_sum() / 3.0;
        // Nothing asks for less than what is asked for at the surface.
        if size <= grading.size_at(center, reach, cell, 0.0) * (1.0 + SLACK) {
            return Ok(false);
        }
        let value = solid.signed_distance(center);
        if value.is_nan() {
            return Err(SampleError::NotANumber { at: center });
        }
        // Cells up to one cell off the surface are as small as those on it, so that the surface
        // passes through equal cells where no refinement is wanted.
        let outward = value - reach * (1.0 + SLACK);
        if outward > cell {
            return Ok(false);
        }
        let inward = -value - reach * (1.0 + SLACK);
        let depth = if inward > cell { inward } else { 0.0 };
        let wanted = grading.size_at(center, reach, cell, depth);
        Ok(size > wanted * (1.0 + SLACK))
    }

    /// Divides cells until none that touches a cell of `level` is more than twice as wide.
    fn balance(&mut self, level: u32) {
        loop {
            let width = 1_i64 << level;
            let tree = &*self;
            let mut split: Vec<usize> = tree
                .cells
                .par_iter()
                .filter(|c| c.level == level)
                .flat_map_iter(|c| {
                    let at = c.at.map(i64::from);
                    (0..27).filter_map(move |k| {
                        let step = [k % 3, k / 3 % 3, k / 9].map(|d| i64::from(d) - 1);
                        let other =
                            tree.leaf_at([0, 1, 2].map(|axis| at[axis] + step[axis] * width))?;
                        (tree.cells[other].level > level + 1).then_some(other)
                    })
                })
                .collect();
            if split.is_empty() {
                return;
            }
            split.sort_unstable();
            split.dedup();
            let mut cells = std::mem::take(&mut self.cells);
            let mut at = 0;
            let mut children = Vec::with_capacity(8 * split.len());
            let mut next = split.iter().copied().peekable();
            cells.retain(|c| {
                let gone = next.next_if_eq(&at).is_some();
                at += 1;
                if gone {
                    children.extend(c.children());
                }
                !gone
            });
            cells.append(&mut children);
            self.set_cells(cells);
        }
    }
}

/// Divides cells, and their parts, until none wants it; `check` sees the number of all so far.
fn refine(
    mut open: Vec<Cell>,
    wants_split: impl Fn(&Cell) -> Result<bool, SampleError> + Sync,
    check: impl Fn(usize) -> Result<(), SampleError>,
) -> Result<Vec<Cell>, SampleError> {
    let mut leaves = Vec::new();
    while !open.is_empty() {
        let split = first_error(open.par_iter().map(&wants_split))?;
        let mut next = Vec::new();
        for (c, split) in open.into_iter().zip(split) {
            if split {
                next.extend(c.children());
            } else {
                leaves.push(c);
            }
        }
        check(leaves.len() + next.len())?;
        open = next;
    }
    Ok(leaves)
}

fn at_surface(solid: &Solid, center: DVec3, size: DVec3) -> bool {
    let Some((mesh, hierarchy)) = solid.mesh().zip(solid.hierarchy()) else {
        return solid.signed_distance(center).abs() <= 0.5 * size.length() * (1.0 + SLACK);
    };
    let half = 0.5 * size * (1.0 + SLACK);
    let mut touching = Vec::new();
    let bounds = Bounds::new(center - half, center + half);
    hierarchy.touching_into(&bounds, &mut touching);
    touching.iter().any(|t| {
        let normal = mesh.area_vector(*t as usize).normalize_or_zero();
        let off = (center - mesh.corners(*t as usize)[0]).dot(normal).abs();
        off <= half.dot(normal.abs()) * (1.0 + SLACK)
    })
}

/// Interleaves the bits of three coordinates below 2^21.
fn morton([x, y, z]: [u32; 3]) -> u64 {
    let spread = |v: u32| {
        let mut v = u64::from(v);
        v = (v | v << 32) & 0x001f_0000_0000_ffff;
        v = (v | v << 16) & 0x001f_0000_ff00_00ff;
        v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
        v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
        (v | v << 2) & 0x1249_2492_4924_9249
    };
    spread(x) | spread(y) << 1 | spread(z) << 2
}
