//! The box that is cut.

use glam::DVec3;
use phyxel_enrich::{CutSettings, Cuts, Graph};

use crate::StudyError;
use crate::problems::block::{Block, lattice};
use testkit::cloud::Random;

/// A box of tetrahedra that is to be cut.
#[derive(Debug, Clone)]
pub struct Plate {
    /// Nodes and stencils.
    pub block: Block,
    /// Size of a cell (m).
    pub spacing: f64,
    /// Lowest corner (m).
    pub low: DVec3,
    /// Highest corner (m).
    pub high: DVec3,
}

impl Plate {
    /// `cells` cells from `low` to `high` (m); nodes moved by up to `jitter` of a cell, those on the
    /// sides not at all, those on top and bottom within them.
    pub fn new(cells: [u32; 3], low: DVec3, high: DVec3, jitter: f64) -> Result<Self, StudyError> {
        let size = (high - low) / DVec3::from_array(cells.map(f64::from));
        let (mut nodes, tetrahedra) = lattice(cells, |s| low + (high - low) * s);
        let n = cells.map(|c| c + 1);
        let mut random = Random::new(0);
        for (index, x) in (0_u32..).zip(&mut nodes) {
            let at = [index % n[0], index / n[0] % n[1], index / (n[0] * n[1])];
            if index % (n[0] * n[1]) == 0 {
                random = Random::new(5 + u64::from(at[2]));
            }
            let inside = |axis: usize| at[axis] > 0 && at[axis] < cells[axis];
            let mut shift = random.vector(jitter);
            shift.z *= f64::from(u8::from(inside(2)));
            if inside(0) && inside(1) {
                *x += shift * size;
            }
        }
        Ok(Self {
            block: Block::new(nodes, tetrahedra)?,
            spacing: size.max_element(),
            low,
            high,
        })
    }

    /// Whether a point is in the box, asked as scenes ask: paths bend in its faces, where the last bit would decide.
    pub fn inside(&self, p: DVec3) -> bool {
        let round_off = DVec3::splat(1e-9 * (self.high - self.low).max_element());
        p.cmpge(self.low - round_off).all() && p.cmple(self.high + round_off).all()
    }

    /// Its nodes and pairs, as factors read them.
    pub(super) fn coupled(&self) -> Graph<'_> {
        let (rest, graph) = (&self.block.rest, &self.block.graph);
        Graph::new_unchecked(rest, graph.offsets(), graph.indices())
    }

    /// No cut yet, for cuts of this box.
    pub fn cuts(&self) -> Cuts {
        Cuts::new(&CutSettings::for_spacing(self.spacing))
    }

    /// Nodal forces (N) of a tension of 1 Pa on the two sides of the box across an axis.
    pub fn tension(&self, axis: DVec3) -> Vec<DVec3> {
        let edge = 1e-9 * self.spacing;
        let (top, bottom) = (self.high.dot(axis) - edge, self.low.dot(axis) + edge);
        let mut forces = self.block.traction(|p| p.dot(axis) > top, axis);
        let below = self.block.traction(|p| p.dot(axis) < bottom, -axis);
        for (f, g) in forces.iter_mut().zip(below) {
            *f += g;
        }
        forces
    }
}
