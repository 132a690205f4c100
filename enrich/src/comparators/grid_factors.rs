//! Factors on pairs from the dissertation's grids, a chain of them a stroke; for comparison.

use std::ops::Range;

use glam::DVec3;

use super::grid::{EnrichmentGrid, GridForm, GridSettings, GridSheets};
use super::grid::{grid_pair_factors, piece_between};
use crate::bounds::Bounds;
use crate::cuts::Cuts;
use crate::face::nearest_on_triangle;
use crate::factors::PairFactors;
use crate::graph::Graph;

/// The dissertation's enrichment grids and what they make of the pairs (Aras 2014, eqs. (39)-(48),
/// (64)): a chain of grids for each stroke ([`GridSheets`]), its last one built again with each edge of the
/// blade. Takes the two ends of an edge alone.
///
/// [`PairFactors`] decides what no grid does: pairs that it severs and none of them, pairs that it
/// weakens where none of them has a say, and pairs that no cut crosses of a node that would be alone: a grid
/// knows the ends of the blade's edge alone, and a node between the cut and the straight line of these ends is on
/// the one side for the cut and on the other for the grid. Of the first kind are those that cross a piece which has
/// no grid, as it folds, or as the cut between two edges is not what their ends span; and those beside the
/// end of a grid whose last piece is tilted.
#[derive(Debug, Clone)]
pub(crate) struct GridFactors {
    settings: GridSettings,
    /// Box of the body (m) and cells along x, y and z, for lattices as in the appendix.
    cells: Option<(Bounds, [u32; 3])>,
    radii: Vec<f64>,
    /// Strokes and their lattices.
    strokes: Vec<(usize, GridSheets)>,
    /// Factors of the lattices alone, and with those of [`PairFactors`].
    by_lattice: Vec<f64>,
    pub(crate) factors: Vec<f64>,
}

impl GridFactors {
    /// All factors 1; `radii` are the support radii of the nodes (m), `cells` the numbers of lattice cells
    /// along x, y and z over the nodes' box with its margin, instead of a spacing.
    pub(crate) fn new(
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
            by_lattice: vec![1.0; graph.indices.len()],
            factors: vec![1.0; graph.indices.len()],
        }
    }

    /// The lattices, stroke by stroke.
    pub(crate) fn lattices(&self) -> impl Iterator<Item = &EnrichmentGrid> {
        self.strokes.iter().flat_map(|(_, sheets)| sheets.grids())
    }

    /// Gives nodes that have lost all of their pairs those back that a lattice severs and no cut crosses.
    fn join_single_nodes(graph: &Graph<'_>, pairs: &PairFactors, factors: &mut [f64]) {
        let nodes = 0..graph.positions.len();
        let severed = |node| graph.pairs(node).all(|pair| factors[pair] <= 0.0);
        let alone: Vec<bool> = nodes.clone().map(severed).collect();
        for node in nodes {
            for pair in graph.pairs(node) {
                let single = alone[node] || alone[graph.indices[pair] as usize];
                if single && pairs.factor(pair) >= 1.0 {
                    factors[pair] = 1.0;
                }
            }
        }
    }

    /// Number of undirected pairs that no lattice decides, and that [`PairFactors`] weakens or severs.
    pub(crate) fn count_without_lattice(&self) -> usize {
        let both = self.factors.iter().zip(&self.by_lattice);
        let others = both.filter(|(factor, lattice)| factor.to_bits() != lattice.to_bits());
        others.count() / 2
    }

    /// Bytes held on the heap, about.
    pub(crate) fn bytes(&self) -> usize {
        let lattices = self.strokes.iter().map(|(_, sheets)| sheets.bytes());
        lattices.sum::<usize>()
            + size_of_val(&*self.factors)
            + size_of_val(&*self.by_lattice)
            + size_of_val(&*self.radii)
    }

    /// Takes the path of the front of a stroke between two pairs of ends (m), with which `cuts` grew by the
    /// triangles `new`, and brings all factors up to date; the nodes of the pairs that changed, ascending.
    /// Without ends no lattice grows. `pairs` has been brought up to date.
    pub(crate) fn update(
        &mut self,
        graph: &Graph<'_>,
        cuts: &Cuts,
        new: Range<usize>,
        (stroke, ends): (usize, Option<[[DVec3; 2]; 2]>),
        pairs: &PairFactors,
    ) -> Vec<u32> {
        if let Some([before, now]) = ends {
            let known = self.strokes.iter().position(|(known, _)| *known == stroke);
            let at = known.unwrap_or_else(|| {
                let sheets = GridSheets::new(before, &self.settings, self.cells);
                self.strokes.push((stroke, sheets));
                self.strokes.len() - 1
            });
            let sheets = &mut self.strokes[at].1;
            if sheets.last_edge() != before {
                sheets.continue_from(before);
            }
            if spans(before, now, cuts, new, self.settings.spacing) {
                // A piece that no lattice takes leaves those that there are as they were.
                let _refused = sheets.append(now);
            } else {
                sheets.continue_from(now);
            }
        }
        self.by_lattice =
            grid_pair_factors(self.lattices(), graph, &self.radii, GridForm::default());
        let lattice = self.by_lattice.iter().enumerate();
        let mut factors: Vec<f64> = lattice
            .map(|(pair, &lattice)| match pairs.factor(pair) {
                rest if rest <= 0.0 || lattice >= 1.0 => rest,
                _ => lattice,
            })
            .collect();
        Self::join_single_nodes(graph, pairs, &mut factors);
        let changed = |&node: &u32| {
            let row = graph.pairs(node as usize);
            factors[row.clone()] != self.factors[row]
        };
        let nodes = 0..crate::index32(graph.positions.len());
        let touched = nodes.filter(changed).collect();
        self.factors = factors;
        touched
    }
}

/// Whether the piece between two edges is what a cut grew by: no corner and no middle of a triangle of either
/// is farther than `cell` (m) from the other. No lattice separates two nodes between its points.
fn spans(from: [DVec3; 2], to: [DVec3; 2], cuts: &Cuts, new: Range<usize>, cell: f64) -> bool {
    let piece = piece_between(from, to);
    let grown: Vec<[DVec3; 3]> = new.map(|triangle| cuts.triangle(triangle)).collect();
    let lies_on = |of: &[[DVec3; 3]], other: &[[DVec3; 3]]| {
        of.iter().all(|corners| {
            let middle = corners.iter().sum::<DVec3>() / 3.0;
            let points = corners.iter().chain([&middle]);
            let near = |point: DVec3| {
                let mut others = other.iter();
                others.any(|&other| nearest_on_triangle(other, point).distance(point) <= cell)
            };
            points.copied().all(near)
        })
    };
    !grown.is_empty() && lies_on(&grown, &piece) && lies_on(&piece, &grown)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cut_rule::{CutRule, Factors};
    use crate::cuts::CutSettings;

    fn grid(inflate: Option<f64>) -> CutRule {
        CutRule::Grid {
            spacing: None,
            inflate,
            cells: None,
        }
    }

    /// Two nodes beside a cut: severed once the blade is past them, and both reported; by the lattice, or by
    /// the other rule where the piece has none.
    #[test]
    fn a_stroke_severs_the_pair_it_passes_with_a_lattice_or_without() {
        let positions = [DVec3::new(-0.2, 0.0, 0.0), DVec3::new(0.2, 0.0, 0.0)];
        let graph = Graph::new(&positions, &[0, 1, 2], &[1, 0]).expect("a pair");
        let edge = |y: f64| [DVec3::new(0.0, y, -2.0), DVec3::new(0.0, y, 2.0)];
        // A margin of a billion lattice points is refused.
        for (inflate, lattices, without) in [(None, 1, 0), (Some(100.0), 0, 1)] {
            let mut cuts = Cuts::new(&CutSettings::for_spacing(0.2));
            let mut factors = Factors::new(grid(inflate), &graph, vec![0.6; 2], 0.2);
            let stroke = cuts.start(&edge(-3.0)).expect("an edge");
            let new = cuts.append(stroke, &edge(3.0)).expect("an edge");
            let ends = Some([edge(-3.0), edge(3.0)]);
            let touched = factors.update(&graph, &cuts, new, (stroke, ends), &|_| true);
            assert_eq!(touched, [0, 1], "both rows changed");
            let counts = (factors.severed_count(), factors.crossed_count());
            assert_eq!(counts, (1, 1), "{factors:?}");
            let counts = factors.grid_counts();
            assert_eq!(counts, Some((lattices, without)), "{factors:?}");
        }
    }

    /// A blade whose edge is bent leaves a node between the cut and the straight edge of the lattice: it stays with
    /// those on its side of the cut, and is parted from the others.
    #[test]
    fn a_node_between_the_cut_and_its_lattice_keeps_its_side() {
        let x = [-0.2, 0.05, 0.25];
        let positions = x.map(|x| DVec3::new(x, 0.0, 0.0));
        let rows = [1, 2, 0, 2, 0, 1];
        let graph = Graph::new(&positions, &[0, 2, 4, 6], &rows).expect("three pairs");
        let edge = |y: f64| {
            let at = |x: f64, z: f64| DVec3::new(x, y, z);
            [at(0.0, -2.0), at(0.12, 0.0), at(0.0, 2.0)]
        };
        let ends = |y: f64| [edge(y)[0], edge(y)[2]];
        let mut cuts = Cuts::new(&CutSettings::for_spacing(0.2));
        let mut factors = Factors::new(grid(None), &graph, vec![0.6; 3], 0.3);
        let stroke = cuts.start(&edge(-3.0)).expect("an edge");
        let new = cuts.append(stroke, &edge(3.0)).expect("an edge");
        let way = (stroke, Some([ends(-3.0), ends(3.0)]));
        factors.update(&graph, &cuts, new, way, &|_| true);
        let lattices = factors.grid_counts().map(|(lattices, _)| lattices);
        assert_eq!(lattices, Some(1), "the lattice takes the piece");
        // From the left one to the middle, to the right one; from the middle to the right one.
        let found = [factors.factor(0), factors.factor(1), factors.factor(3)];
        let bits = [1.0_f64, 0.0, 0.0].map(f64::to_bits);
        assert_eq!(found.map(f64::to_bits), bits, "{found:?}");
    }
}
