//! Factors on pairs from the dissertation's grids, one grid a stroke; for comparison.

use glam::DVec3;

use super::grid::{EnrichmentGrid, GridError, GridForm, GridSettings, grid_pair_factors};
use crate::graph::Graph;

/// The dissertation's enrichment grids and what they make of the pairs (Aras 2014, eqs. (39)-(48),
/// (64)): a grid for each stroke, built anew with each edge of its blade. For comparison with
/// [`crate::PairFactors`]; takes the two ends of an edge alone.
#[derive(Debug, Clone)]
pub struct GridFactors {
    settings: GridSettings,
    radii: Vec<f64>,
    strokes: Vec<Blades>,
    grids: Vec<EnrichmentGrid>,
    factors: Vec<f64>,
}

/// Where a stroke's blade was.
#[derive(Debug, Clone)]
struct Blades {
    stroke: usize,
    /// Ends of the edge at each capture (m).
    ends: Vec<[DVec3; 2]>,
    /// Place of its grid; `None` before it has one.
    grid: Option<usize>,
}

impl GridFactors {
    /// All factors of `pairs` directed pairs 1; `radii` are the support radii of the nodes (m).
    #[must_use]
    pub fn new(pairs: usize, radii: Vec<f64>, settings: &GridSettings) -> Self {
        Self {
            settings: *settings,
            radii,
            strokes: Vec::new(),
            grids: Vec::new(),
            factors: vec![1.0; pairs],
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

    /// Bytes held on the heap.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let grids = self.grids.iter().map(EnrichmentGrid::bytes);
        grids.sum::<usize>() + size_of_val(&*self.factors) + size_of_val(&*self.radii)
    }

    /// Notes the edge (m) with which a stroke starts.
    ///
    /// # Panics
    /// If the edge has no points.
    pub fn start(&mut self, stroke: usize, edge: &[DVec3]) {
        self.strokes.push(Blades {
            stroke,
            ends: vec![ends(edge)],
            grid: None,
        });
    }

    /// Takes the stroke's next edge (m) and brings all factors up to date; the nodes of the pairs that
    /// changed, rising. A stroke that was not started changes nothing.
    ///
    /// # Errors
    /// [`GridError`] if the stroke's cut has no grid: it is closed or folded.
    ///
    /// # Panics
    /// If the edge has no points, or the graph is not of as many pairs and nodes as at the start.
    pub fn update(
        &mut self,
        graph: &Graph<'_>,
        stroke: usize,
        edge: &[DVec3],
    ) -> Result<Vec<u32>, GridError> {
        let known = |blades: &&mut Blades| blades.stroke == stroke;
        let Some(blades) = self.strokes.iter_mut().find(known) else {
            return Ok(Vec::new());
        };
        blades.ends.push(ends(edge));
        let grid = EnrichmentGrid::from_blades(&blades.ends, &self.settings)?;
        match blades.grid {
            Some(place) => self.grids[place] = grid,
            None => {
                blades.grid = Some(self.grids.len());
                self.grids.push(grid);
            }
        }
        let factors = grid_pair_factors(&self.grids, graph, &self.radii, GridForm::default());
        let rows = graph.offsets.windows(2).zip(0_u32..);
        let touched = rows
            .filter(|(row, _)| {
                let row = row[0] as usize..row[1] as usize;
                factors[row.clone()] != self.factors[row]
            })
            .map(|(_, node)| node)
            .collect();
        self.factors = factors;
        Ok(touched)
    }
}

/// The two ends of a blade's edge.
fn ends(edge: &[DVec3]) -> [DVec3; 2] {
    [edge[0], edge[edge.len() - 1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two nodes beside a cut: severed once the blade is past them, and both told of.
    #[test]
    fn a_stroke_severs_the_pair_it_passes() {
        let positions = [DVec3::new(-0.2, 0.0, 0.0), DVec3::new(0.2, 0.0, 0.0)];
        let graph = Graph::new(&positions, &[0, 1, 2], &[1, 0]).expect("a pair");
        let settings = GridSettings::for_spacing(0.2);
        let mut factors = GridFactors::new(2, vec![0.6; 2], &settings);
        let edge = |y: f64| [DVec3::new(0.0, y, -2.0), DVec3::new(0.0, y, 2.0)];
        factors.start(3, &edge(-3.0));
        assert_eq!(
            factors.update(&graph, 7, &edge(3.0)),
            Ok(Vec::new()),
            "another stroke"
        );
        let touched = factors
            .update(&graph, 3, &edge(3.0))
            .expect("a plane cut has a grid");
        assert_eq!(touched, [0, 1], "both rows changed");
        assert!(
            factors.factor(0) < 1.0 && factors.factor(1) < 1.0,
            "{factors:?}"
        );
        assert_eq!(factors.crossed_count(), 1, "one pair");
        assert!(factors.bytes() > 0, "a grid is held");
    }
}
