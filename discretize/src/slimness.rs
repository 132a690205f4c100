//! How thin a body is, and how fine a lattice it needs.

use glam::DVec3;

use crate::counts::{MEAN_EDGE, nodes_at, solve_cell};
use crate::error::SampleError;
use crate::hierarchy::Hierarchy;
use crate::measures::Measures;
use crate::mesh::Mesh;
use crate::solid::Solid;
use crate::stuffing::Stuffed;
use crate::sums::tetrahedron_volume;

/// A filling that keeps less of the body's volume has lost it: a few lattice points fell into a body
/// that lies between them. A box of sides 1, 0.7 and 0.53 keeps 0.755 in 30 nodes, the fewest.
const LEAST_KEPT: f64 = 2.0 / 3.0;
/// Cells over the mean thickness in which nothing is lost, of plates at any angle: they keep 97 % of their
/// volume in cells of 1.08 thicknesses, and are lost in cells of 1.35.
const RESOLVED: f64 = 0.85;
/// Share of the largest lattice that any number of nodes may take, and the number of nodes for which as
/// much is granted again: 500 cells a node with the default of 1e7 cells, where livers take 2.
const FREE_SHARE: f64 = 0.1;
const NODES_GRANTED: f64 = 2000.0;
/// Cells of all rounds of a search over those of the largest lattice.
const MOST_ROUNDS: f64 = 6.0;
/// Places of a surface through which its body's thickness is looked at, and the share of the volume that
/// may be thinner than what is taken for its thickness: an L has 0.2 to 0.5 in its thinner arm.
const RAYS: usize = 400;
const THINNER: f64 = 0.05;
/// Cells at a body's surface take this much more than those of its volume alone: the rim of two cells
/// round the box.
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

/// Lengths of the chords that go inward from [`RAYS`] places evenly spread over a surface: half of each
/// times its place's area, summed, is the volume, whatever the shape.
#[allow(clippy::cast_precision_loss, reason = "counts")]
fn chords(mesh: &Mesh, hierarchy: &Hierarchy) -> Vec<f64> {
    let far = mesh.bounds().diagonal();
    let step = mesh.area() / RAYS as f64;
    let (mut chords, mut met) = (Vec::with_capacity(RAYS), Vec::new());
    let (mut passed, mut next) = (0.0, 0.5 * step);
    for t in 0..mesh.triangles.len() {
        let ([a, b, c], vector) = (mesh.corners(t), mesh.area_vector(t));
        passed += vector.length();
        while next < passed {
            next += step;
            // The R2 sequence (Roberts 2018), folded into the triangle.
            let k = chords.len() as f64;
            let (u, v) = ((0.754_877_666 * k).fract(), (0.569_840_291 * k).fract());
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            let place = a + u * (b - a) + v * (c - a);
            let inward = -vector.normalize_or_zero() * far;
            met.clear();
            hierarchy.crossings_into(place, place + inward, &mut met);
            let others = met
                .iter()
                .filter(|crossing| crossing.triangle as usize != t);
            let chord = others
                .map(|crossing| crossing.parameter * far)
                .min_by(f64::total_cmp);
            chords.push(chord.unwrap_or(0.0));
        }
    }
    chords
}

/// The error of a body that is lost at a cell size, with a spacing that does: half the mean thickness
/// leaves room for places that are thinner.
pub(crate) fn vanished(solid: &Solid, cell: f64, largest: usize) -> SampleError {
    let body = Slimness::new(solid, solid.measures(), largest, usize::MAX, |_, _, _| 0.0);
    let advised = 0.5 * cell.min(body.least_thickness());
    // A body whose volume no grid point sees has no thickness to go by; a mesh has, unless a spike or a stray
    // vertex is so far off that its volume is round-off.
    let lost = advised <= 0.0 && solid.mesh().is_some();
    let advised = if advised > 0.0 { advised } else { 0.5 * cell };
    if lost || body.cells(advised) > body.limit {
        return body.slender();
    }
    SampleError::Vanished {
        spacing: cell * MEAN_EDGE,
        advice: advised * MEAN_EDGE,
        nodes: nodes_at(advised * MEAN_EDGE, solid.measures()),
    }
}

/// What the number of nodes and the size of the lattice are checked against before any work.
pub(crate) struct Slimness<'a> {
    solid: &'a Solid,
    volume: f64,
    area: f64,
    limit: f64,
    /// Cells that any number of nodes may take.
    granted: f64,
    model: Model,
}

/// Nodes at a cell size, by volume and area.
type Model = fn(f64, f64, f64) -> f64;

impl<'a> Slimness<'a> {
    /// The body with its lattice limited by `largest` cells, and by so many for each node wanted: where
    /// more of them are empty, it is a spike or a stray vertex that makes the box.
    #[allow(clippy::cast_precision_loss, reason = "counts")]
    pub(crate) fn new(
        solid: &'a Solid,
        Measures { volume, area }: Measures,
        largest: usize,
        wanted: usize,
        model: Model,
    ) -> Self {
        let largest = largest as f64;
        let granted = FREE_SHARE * largest;
        Self {
            solid,
            volume,
            area,
            limit: largest.min(granted + granted * wanted as f64 / NODES_GRANTED),
            granted,
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

    /// Thickness that all but a small share of the volume has; the mean where that is less, or where there
    /// is no surface to look through.
    fn least_thickness(&self) -> f64 {
        let mean = self.thickness();
        let Some((mesh, hierarchy)) = self.solid.mesh().zip(self.solid.hierarchy()) else {
            return mean;
        };
        let mut through = chords(mesh, hierarchy);
        through.sort_by(f64::total_cmp);
        let volume: f64 = through.iter().sum();
        let mut thinner = 0.0;
        let least = through.iter().find(|chord| {
            thinner += **chord;
            thinner > THINNER * volume
        });
        least.map_or(mean, |least| least.min(mean))
    }

    /// Whether a body that was lost in cells of this size is too thin for them, and it was no accident.
    pub(crate) fn is_thin_for(&self, cell: f64) -> bool {
        cell > 2.0 * self.thickness()
    }

    /// Cells of the lattice round the body.
    fn cells(&self, cell: f64) -> f64 {
        (self.solid.bounds().size() / cell + RIM).element_product()
    }

    /// Refuses a number of nodes whose lattice is larger than the limit.
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "counts"
    )]
    pub(crate) fn check_count(&self, wanted: usize) -> Result<(), SampleError> {
        let cell = self.cell_of(wanted as f64);
        let cells = self.cells(cell);
        if cells <= self.limit {
            return Ok(());
        }
        let largest = self.solid.bounds().size().max_element();
        // Volume 0 stands for one that the grid does not see.
        let coarsest = solve_cell(self.granted, |a| self.cells(a), largest);
        let advice = (self.model)(coarsest, self.volume, self.area);
        if coarsest > RESOLVED * self.thickness() || self.volume <= 0.0 || advice < 100.0 {
            return Err(self.slender());
        }
        Err(SampleError::TooManyNodes {
            wanted,
            cells,
            limit: self.limit,
            advice: (0.9 * advice) as usize,
        })
    }

    /// The error of a body that is lost at the cells that the wanted nodes ask for.
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "counts"
    )]
    pub(crate) fn thin(&self, wanted: usize, cell: f64) -> SampleError {
        let thickness = self.thickness();
        let resolved = RESOLVED * self.least_thickness();
        if self.cells(resolved) > self.limit {
            return self.slender();
        }
        // Four times the nodes halve the cells where most of the nodes are at the surface.
        let needed = (self.model)(resolved, self.volume, self.area).max(4.0 * wanted as f64);
        let digit = 10_f64.powf(needed.log10().floor() - 1.0);
        SampleError::Thin {
            wanted,
            spacing: cell * MEAN_EDGE,
            thickness,
            advice: ((needed / digit).ceil() * digit) as usize,
        }
    }

    pub(crate) fn slender(&self) -> SampleError {
        let bounds = self.solid.bounds();
        let thickness = self.thickness();
        let middle = bounds.center();
        let far = self.solid.mesh().map_or(bounds.max, |mesh| {
            #[allow(clippy::cast_precision_loss, reason = "a count")]
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
