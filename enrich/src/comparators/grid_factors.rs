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
/// A piece of a cut that no grid takes is left to [`PairFactors`], and the smaller factor counts.
#[derive(Debug, Clone)]
pub struct GridFactors {
    settings: GridSettings,
    /// Box of the body (m) and cells along x, y and z, for lattices as in the appendix.
    cells: Option<(Bounds, [u32; 3])>,
    /// Where an edge counts: the nodes' box with the margin of the lattices (m).
    reach: Bounds,
    radii: Vec<f64>,
    strokes: Vec<(usize, GridSheets)>,
    /// Pairs that cross pieces of which there is no lattice.
    rest: PairFactors,
    factors: Vec<f64>,
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
            reach: body.grown(settings.inflate),
            radii,
            strokes: Vec::new(),
            rest: PairFactors::new(graph, &FactorSettings::default()),
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
        let counts = self.strokes.iter().map(|(_, sheets)| sheets.grids().len());
        counts.sum()
    }

    /// Number of undirected pairs that no lattice decides, and that [`PairFactors`] weakens or severs.
    #[must_use]
    pub fn count_without_lattice(&self) -> usize {
        let factors = self.factors.iter().enumerate();
        let theirs = |&(pair, factor): &(usize, &f64)| {
            let rest = self.rest.factor(pair);
            rest < 1.0 && rest <= *factor
        };
        factors.filter(theirs).count() / 2
    }

    /// Bytes held on the heap, about.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let lattices = self.strokes.iter().map(|(_, sheets)| sheets.bytes());
        lattices.sum::<usize>()
            + size_of_val(&*self.factors)
            + size_of_val(&*self.radii)
            + self.rest.bytes()
    }

    /// Notes the edge (m) with which a stroke starts.
    ///
    /// # Panics
    /// If the edge has no points.
    pub fn start(&mut self, stroke: usize, edge: &[DVec3]) {
        let sheets = GridSheets::new(self.ends(edge), &self.settings, self.cells);
        self.strokes.push((stroke, sheets));
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
        let ends = self.ends(edge);
        let mut strokes = self.strokes.iter_mut();
        let Some((_, sheets)) = strokes.find(|(known, _)| *known == stroke) else {
            return Vec::new();
        };
        if sheets.append(ends).is_err() {
            self.rest.update(graph, cuts, new, inside);
        }
        let grids = self.strokes.iter().flat_map(|(_, sheets)| sheets.grids());
        let mut factors = grid_pair_factors(grids, graph, &self.radii, GridForm::default());
        for (pair, factor) in factors.iter_mut().enumerate() {
            *factor = factor.min(self.rest.factor(pair));
        }
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

    /// The ends of a blade's edge in the body, or of all of it where that is not there: an edge that was
    /// mapped from the world into the material means little far from the body.
    fn ends(&self, edge: &[DVec3]) -> [DVec3; 2] {
        let near = |point: &&DVec3| self.reach.distance(**point) <= 0.0;
        let mut inside = edge.iter().filter(near);
        match (inside.next(), inside.next_back()) {
            (Some(first), Some(last)) => [*first, *last],
            _ => [edge[0], edge[edge.len() - 1]],
        }
    }
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
            factors.start(stroke, &edge(-3.0));
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
