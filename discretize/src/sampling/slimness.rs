//! How thin a body is, and how fine a lattice it needs.

use glam::DVec3;

use crate::mesh::tetrahedron_volume;
use crate::sampling::{
    MEAN_EDGE, Measures, SampleError, Solid, Stuffed, nodes_at, solve_cell, too_fine,
};

/// Fewest nodes that can be asked for.
const LEAST_NODES: usize = 30;
/// A filling that keeps less of the body's volume has lost it: a few lattice points fell into a body
/// that lies between them. A box of sides 1, 0.7 and 0.53 keeps 0.755 in 30 nodes, the fewest.
const LEAST_KEPT: f64 = 2.0 / 3.0;
/// Fraction of the largest lattice that any number of nodes may take, and the number of nodes for which as
/// much is granted again: 500 cells a node with the default of 1e7 cells, where livers take 2.
const FREE_SHARE: f64 = 0.1;
const NODES_GRANTED: f64 = 2000.0;
/// Cells of all rounds of a search over those of the largest lattice.
const MOST_ROUNDS: f64 = 6.0;
/// Cells at a body's surface take this much more than those of its volume alone: the rim of two cells
/// around the box.
const RIM: f64 = 3.0;

/// Whether most of a body's volume is not in its filling.
pub(crate) fn is_mostly_lost(solid: &Solid, stuffed: &Stuffed) -> bool {
    let corners = |t: &[u32; 4]| t.map(|v| stuffed.positions[v as usize]);
    let kept: f64 = stuffed
        .tetrahedra
        .iter()
        .map(|t| tetrahedron_volume(corners(t)))
        .sum();
    // Parts of a surface that overlap count twice in its sum, so what seems lost is looked at again.
    kept < LEAST_KEPT * solid.measures().volume && kept < LEAST_KEPT * solid.grid_measures().volume
}

/// What the number of nodes and the size of the lattice are checked against before any work.
pub(crate) struct Slimness<'a> {
    solid: &'a Solid,
    volume: f64,
    area: f64,
    limit: f64,
    largest: f64,
    model: CountModel,
}

/// Nodes at a cell size, by volume and area.
type CountModel = fn(f64, f64, f64) -> f64;

impl<'a> Slimness<'a> {
    /// The body with its lattice limited by `largest` cells, and by so many for each node wanted: where
    /// more of them are empty, it is a spike or a stray vertex that makes the box.
    pub(crate) fn new(solid: &'a Solid, largest: usize, wanted: usize, model: CountModel) -> Self {
        let Measures { volume, area } = solid.measures();
        let largest = largest as f64;
        let granted = FREE_SHARE * largest;
        Self {
            solid,
            volume,
            area,
            limit: largest.min(granted + granted * wanted as f64 / NODES_GRANTED),
            largest,
            model,
        }
    }

    /// Whether rounds of a search have taken more cells than they may.
    pub(crate) fn is_spent(&self, spent: &mut f64, cell: f64) -> bool {
        *spent += self.cells(cell);
        *spent > MOST_ROUNDS * self.limit
    }

    /// Mean thickness: the distance of a plate's sides, the radius of a rod, 2/3 of that of a ball.
    fn thickness(&self) -> f64 {
        if self.area > 0.0 {
            2.0 * self.volume / self.area
        } else {
            0.0
        }
    }

    /// Whether a body that was lost in cells of this size is too thin for them, and it was no accident.
    pub(crate) fn is_thin_for(&self, cell: f64) -> bool {
        cell > 2.0 * self.thickness()
    }

    /// Cells of the lattice around the body.
    fn cells(&self, cell: f64) -> f64 {
        (self.solid.bounds().size() / cell + RIM).element_product()
    }

    /// Refuses a number of nodes that makes no tetrahedra, and one whose lattice is larger than the limit.
    pub(crate) fn check_count(&self, wanted: usize) -> Result<(), SampleError> {
        if wanted < LEAST_NODES {
            let (nodes, least) = (wanted, LEAST_NODES);
            return Err(SampleError::TooFewNodes { nodes, least });
        }
        let cell = self.cell_of(wanted as f64);
        let cells = self.cells(cell);
        if cells <= self.limit {
            return Ok(());
        }
        // Volume 0 stands for one that the grid does not see.
        if self.volume <= 0.0 || self.cells(self.thickness()) > self.limit {
            return Err(self.slender());
        }
        Err(too_fine(cell * MEAN_EDGE, cells, self.limit))
    }

    /// The error of a search that ends without the number of nodes: `reached` is the nearest, `first` the cell that
    /// it began with.
    pub(crate) fn missed(
        &self,
        wanted: usize,
        reached: usize,
        vanished: bool,
        first: f64,
    ) -> SampleError {
        if vanished || reached == 0 {
            return self.vanished(first);
        }
        SampleError::NodeCount { wanted, reached }
    }

    /// The error of a body that is lost at a cell size, with a finer spacing: half the mean thickness leaves room for
    /// parts that are thinner.
    pub(crate) fn vanished(&self, cell: f64) -> SampleError {
        let advised = 0.5 * cell.min(self.thickness());
        // A body whose volume no grid point sees has no thickness to go by; a mesh has, unless a spike or a stray
        // vertex is so far off that its volume is round-off.
        let lost = advised <= 0.0 && self.solid.mesh().is_some();
        let advised = if advised > 0.0 { advised } else { 0.5 * cell };
        if lost || self.cells(advised) > self.largest {
            return self.slender();
        }
        SampleError::Vanished {
            spacing: cell * MEAN_EDGE,
            advice: advised * MEAN_EDGE,
            nodes: nodes_at(advised * MEAN_EDGE, self.solid.measures()),
        }
    }

    pub(crate) fn slender(&self) -> SampleError {
        let bounds = self.solid.bounds();
        let thickness = self.thickness();
        let middle = bounds.center();
        let far = self.solid.mesh().map_or(bounds.max, |mesh| {
            let mean = mesh.vertices.iter().sum::<DVec3>() / mesh.vertices.len() as f64;
            let from = |p: &DVec3| p.distance_squared(mean);
            let far = mesh
                .vertices
                .iter()
                .max_by(|a, b| from(a).total_cmp(&from(b)));
            far.copied().unwrap_or(middle)
        });
        SampleError::Slender {
            share: self.volume / bounds.size().element_product(),
            size: bounds.size(),
            thickness,
            cells: self.cells(thickness),
            limit: self.limit,
            far,
        }
    }

    /// The cell at which the model has that many nodes.
    pub(crate) fn cell_of(&self, nodes: f64) -> f64 {
        let largest = self.solid.bounds().size().max_element();
        solve_cell(nodes, |a| (self.model)(a, self.volume, self.area), largest)
    }
}
