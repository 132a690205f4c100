//! Factors on pairs from the dissertation's grids, a chain of them a stroke; for comparison.

use std::ops::Range;

use glam::DVec3;

use super::grid::{GridForm, GridSettings, GridSheets, grid_pair_factors};
use crate::cuts::Cuts;
use crate::factors::{FactorSettings, PairFactors};
use crate::graph::Graph;
use crate::index::Bounds;

/// The dissertation's enrichment grids and what they make of the pairs (Aras 2014, eqs. (39)-(48),
/// (64)): a chain of grids for each stroke ([`GridSheets`]), its last one built anew with each edge of the
/// blade. For comparison with [`PairFactors`]; takes the two ends of an edge alone.
///
/// [`PairFactors`] decides what no grid does: pairs that it severs and none of them, and pairs that it
/// weakens where none of them has a say. Such are those that cross a piece which has no grid, as it folds, or
/// as the edge bends in the material, of which a grid knows the ends alone; and those beside the end of a grid
/// whose last piece is tilted. [`GridFactors::count_without_lattice`] counts them.
#[derive(Debug, Clone)]
pub struct GridFactors {
    settings: GridSettings,
    /// Box of the body (m) and cells along x, y and z, for lattices as in the appendix.
    cells: Option<(Bounds, [u32; 3])>,
    radii: Vec<f64>,
    strokes: Vec<Blade>,
    /// What decides where no lattice does.
    rest: PairFactors,
    /// Factors of the lattices alone, and of both.
    by_lattice: Vec<f64>,
    factors: Vec<f64>,
}

/// A stroke's last edge and its lattices.
#[derive(Debug, Clone)]
struct Blade {
    stroke: usize,
    /// Points of the last edge (m).
    edge: Vec<DVec3>,
    /// Places of the ends of its part in the body; none where it is in the air.
    part: Option<[usize; 2]>,
    /// Whether its ends stand for it.
    straight: bool,
    sheets: GridSheets,
}

impl GridFactors {
    /// All factors 1; `radii` are the support radii of the nodes (m), `cells` the numbers of lattice cells
    /// along x, y and z over the nodes' box with its margin, in place of a spacing.
    #[must_use]
    pub fn new(
        graph: &Graph<'_>,
        radii: Vec<f64>,
        settings: &GridSettings,
        cells: Option<[u32; 3]>,
    ) -> Self {
        let body = Bounds::of(graph.positions);
        Self {
            settings: *settings,
            cells: cells.map(|cells| (body, cells)),
            radii,
            strokes: Vec::new(),
            rest: PairFactors::new(graph, &FactorSettings::default()),
            by_lattice: vec![1.0; graph.indices.len()],
            factors: vec![1.0; graph.indices.len()],
        }
    }

    /// Factor of a directed pair, by its place in the graph's indices.
    #[must_use]
    pub fn factor(&self, pair: usize) -> f64 {
        self.factors[pair]
    }

    /// Number of undirected pairs whose factor is below 1.
    #[must_use]
    pub fn crossed_count(&self) -> usize {
        self.factors.iter().filter(|f| **f < 1.0).count() / 2
    }

    /// Number of undirected pairs whose factor is 0.
    #[must_use]
    pub fn severed_count(&self) -> usize {
        self.factors.iter().filter(|f| **f == 0.0).count() / 2
    }

    /// Number of lattices.
    #[must_use]
    pub fn lattice_count(&self) -> usize {
        let counts = self.strokes.iter().map(|blade| blade.sheets.grids().len());
        counts.sum()
    }

    /// Number of undirected pairs that no lattice decides, and that [`PairFactors`] weakens or severs.
    #[must_use]
    pub fn count_without_lattice(&self) -> usize {
        let both = self.factors.iter().zip(&self.by_lattice);
        both.filter(|(factor, lattice)| factor != lattice).count() / 2
    }

    /// Bytes held on the heap, about.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let lattices = self.strokes.iter().map(|blade| blade.sheets.bytes());
        lattices.sum::<usize>()
            + size_of_val(&*self.factors)
            + size_of_val(&*self.by_lattice)
            + size_of_val(&*self.radii)
            + self.rest.bytes()
    }

    /// Notes the edge (m) with which a stroke starts.
    ///
    /// # Panics
    /// If the edge has no points.
    pub fn start(&mut self, graph: &Graph<'_>, stroke: usize, edge: &[DVec3]) {
        let part = self.part(graph, edge);
        let [first, last] = part.unwrap_or([0, edge.len() - 1]);
        let ends = [edge[first], edge[last]];
        self.strokes.push(Blade {
            stroke,
            edge: edge.to_vec(),
            part,
            straight: is_straight(&edge[first..=last], self.settings.spacing),
            sheets: GridSheets::new(ends, &self.settings, self.cells),
        });
    }

    /// Takes the stroke's next edge (m), with which `cuts` grew by the pieces `new`, and brings all factors up
    /// to date; the nodes of the pairs that changed, rising. A stroke that was not started changes
    /// nothing. `inside` as in [`PairFactors::update`].
    ///
    /// # Panics
    /// If the edge has no points, or the graph is not of as many pairs and nodes as at the start.
    pub fn update(
        &mut self,
        graph: &Graph<'_>,
        cuts: &Cuts,
        new: Range<usize>,
        (stroke, edge): (usize, &[DVec3]),
        inside: &(dyn Fn(DVec3) -> bool + Sync),
    ) -> Vec<u32> {
        let part = self.part(graph, edge);
        let tolerance = self.settings.spacing;
        let mut strokes = self.strokes.iter_mut();
        let Some(blade) = strokes.find(|blade| blade.stroke == stroke) else {
            return Vec::new();
        };
        // Of an edge in the air counts what is nearest to the ends in the body of the other edge of its piece.
        if let (None, Some([first, last])) = (blade.part, part) {
            let [from, to] = nearest(&blade.edge, [edge[first], edge[last]]);
            blade.straight = is_straight(&blade.edge[from..=to], tolerance);
            blade.sheets.go_on_from([blade.edge[from], blade.edge[to]]);
        }
        let beside = blade
            .part
            .map(|last| nearest(edge, last.map(|end| blade.edge[end])));
        let [first, last] = part.or(beside).unwrap_or([0, edge.len() - 1]);
        let ends = [edge[first], edge[last]];
        let straight = is_straight(&edge[first..=last], tolerance);
        if blade.straight && straight {
            // A piece that no lattice takes leaves those that there are as they were.
            let _refused = blade.sheets.append(ends);
        } else {
            blade.sheets.go_on_from(ends);
        }
        (blade.edge, blade.part, blade.straight) = (edge.to_vec(), part, straight);
        self.rest.update(graph, cuts, new, inside);
        let grids = self.strokes.iter().flat_map(|blade| blade.sheets.grids());
        self.by_lattice = grid_pair_factors(grids, graph, &self.radii, GridForm::default());
        let both = self.by_lattice.iter().enumerate();
        let factors: Vec<f64> = both
            .map(|(pair, &lattice)| match self.rest.factor(pair) {
                rest if rest == 0.0 || lattice == 1.0 => rest,
                _ => lattice,
            })
            .collect();
        let rows = graph.offsets.windows(2).zip(0_u32..);
        let touched = rows
            .filter(|(row, _)| {
                let row = row[0] as usize..row[1] as usize;
                factors[row.clone()] != self.factors[row]
            })
            .map(|(_, node)| node)
            .collect();
        self.factors = factors;
        touched
    }

    /// The first and the last point of an edge (m) that lies in the support of a node. Farther out a point
    /// that was mapped from the world into the material means little.
    fn part(&self, graph: &Graph<'_>, edge: &[DVec3]) -> Option<[usize; 2]> {
        let near = |point: &DVec3| {
            let mut nodes = graph.positions.iter().zip(&self.radii);
            nodes.any(|(node, radius)| node.distance_squared(*point) < radius * radius)
        };
        Some([edge.iter().position(near)?, edge.iter().rposition(near)?])
    }
}

/// Places, rising, of the points of an edge that are nearest to others.
fn nearest(edge: &[DVec3], to: [DVec3; 2]) -> [usize; 2] {
    let [a, b] = to.map(|end| {
        let far = |&k: &usize| edge[k].distance_squared(end);
        let places = 0..edge.len();
        places.min_by(|p, q| far(p).total_cmp(&far(q))).unwrap_or(0)
    });
    [a.min(b), a.max(b)]
}

/// Whether no point of a line is farther than `tolerance` (m) from the straight way between its ends.
fn is_straight(line: &[DVec3], tolerance: f64) -> bool {
    let (from, to) = (line[0], line[line.len() - 1]);
    let way = to - from;
    let off = |point: &DVec3| {
        let at = way.dot(*point - from) / way.length_squared().max(f64::MIN_POSITIVE);
        point.distance(from + way * at.clamp(0.0, 1.0))
    };
    line.iter().all(|point| off(point) <= tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cuts::CutSettings;

    /// Two nodes beside a cut: severed once the blade is past them, and both told of; by the lattice, or by
    /// the other rule where the piece has none.
    #[test]
    fn a_stroke_severs_the_pair_it_passes_with_a_lattice_or_without() {
        let positions = [DVec3::new(-0.2, 0.0, 0.0), DVec3::new(0.2, 0.0, 0.0)];
        let graph = Graph::new(&positions, &[0, 1, 2], &[1, 0]).expect("a pair");
        let edge = |y: f64| [DVec3::new(0.0, y, -2.0), DVec3::new(0.0, y, 2.0)];
        for (most_points, lattices, without) in [(1 << 20, 1, 0), (1, 0, 1)] {
            let settings = GridSettings {
                most_points,
                ..GridSettings::for_spacing(0.2)
            };
            let mut cuts = Cuts::new(&CutSettings::for_spacing(0.2));
            let mut factors = GridFactors::new(&graph, vec![0.6; 2], &settings, None);
            let stroke = cuts.start(&edge(-3.0)).expect("an edge");
            factors.start(&graph, stroke, &edge(-3.0));
            let new = cuts.append(stroke, &edge(3.0)).expect("an edge");
            let mut update = |stroke| {
                let edge = edge(3.0);
                factors.update(&graph, &cuts, new.clone(), (stroke, &edge), &|_| true)
            };
            assert_eq!(update(stroke + 1), [0; 0], "another stroke");
            assert_eq!(update(stroke), [0, 1], "both rows changed");
            let counts = (factors.severed_count(), factors.crossed_count());
            assert_eq!(counts, (1, 1), "{factors:?}");
            let counts = (factors.lattice_count(), factors.count_without_lattice());
            assert_eq!(counts, (lattices, without), "{factors:?}");
        }
    }
}
