//! Factors on pairs that cuts cross, by the rule that a body's scene asks for.

use std::ops::Range;

use glam::DVec3;
use phyxel_enrich::{
    Cuts, EnrichmentGrid, FactorSettings, Graph, GridForm, GridSettings, PairFactors, Reach, Rule,
    grid_pair_factors,
};

use super::error::BodyProblem;
use crate::scene::CutRule;

/// Factors of either kind.
#[derive(Debug)]
pub enum Factors {
    /// Pair by pair, where a cut crosses it.
    Pairs(PairFactors),
    /// From the dissertation's grids, one for each stroke.
    Grids(Grids),
}

/// The dissertation's enrichment grids and what they make of the pairs.
#[derive(Debug)]
pub struct Grids {
    settings: GridSettings,
    radii: Vec<f64>,
    strokes: Vec<Blades>,
    grids: Vec<EnrichmentGrid>,
    factors: Vec<f64>,
}

/// Where a stroke's blade was.
#[derive(Debug)]
struct Blades {
    stroke: usize,
    /// Ends of the edge at each capture, in material coordinates (m).
    ends: Vec<[DVec3; 2]>,
    /// Place of its grid; `None` before it has one.
    grid: Option<usize>,
}

impl Factors {
    /// All factors 1. `radii` are the support radii of the nodes (m).
    pub(super) fn new(rule: CutRule, graph: &Graph<'_>, radii: Vec<f64>, spacing: f64) -> Self {
        let usual = FactorSettings::default();
        let settings = match rule {
            CutRule::Detour { reach } => FactorSettings {
                reach: Reach::Neighbors(reach),
                rule: Rule::Detour,
            },
            CutRule::Visibility => FactorSettings {
                rule: Rule::Visibility,
                ..usual
            },
            CutRule::Transparency { depth, exponent } => FactorSettings {
                rule: Rule::Transparency {
                    kappa: depth,
                    exponent,
                },
                ..usual
            },
            CutRule::Grid {
                spacing: points,
                inflate,
            } => {
                let usual = GridSettings::for_spacing(spacing);
                return Self::Grids(Grids {
                    settings: GridSettings {
                        spacing: points.unwrap_or(usual.spacing),
                        inflate: inflate.unwrap_or(usual.inflate),
                        ..usual
                    },
                    radii,
                    strokes: Vec::new(),
                    grids: Vec::new(),
                    factors: vec![1.0; graph.indices().len()],
                });
            }
        };
        Self::Pairs(PairFactors::new(graph, &settings))
    }

    /// Factor of a directed pair.
    #[must_use]
    pub fn factor(&self, pair: usize) -> f64 {
        match self {
            Self::Pairs(factors) => factors.factor(pair),
            Self::Grids(grids) => grids.factors[pair],
        }
    }

    /// Number of undirected pairs whose factor is below 1.
    #[must_use]
    pub fn crossed_count(&self) -> usize {
        match self {
            Self::Pairs(factors) => factors.crossed_count(),
            Self::Grids(grids) => grids.factors.iter().filter(|f| **f < 1.0).count() / 2,
        }
    }

    /// Number of undirected pairs whose factor is 0.
    #[must_use]
    pub fn severed_count(&self) -> usize {
        match self {
            Self::Pairs(factors) => factors.severed_count(),
            Self::Grids(grids) => grids.factors.iter().filter(|f| **f == 0.0).count() / 2,
        }
    }

    /// Heap bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match self {
            Self::Pairs(factors) => factors.bytes(),
            Self::Grids(grids) => {
                let lattices = grids.grids.iter().map(EnrichmentGrid::bytes);
                lattices.sum::<usize>() + size_of_val(&*grids.factors) + size_of_val(&*grids.radii)
            }
        }
    }

    /// Notes where a stroke starts.
    pub(super) fn start(&mut self, stroke: usize, edge: &[DVec3]) {
        if let Self::Grids(grids) = self {
            grids.strokes.push(Blades {
                stroke,
                ends: vec![ends(edge)],
                grid: None,
            });
        }
    }

    /// Brings the factors up to date with the `new` triangles that the stroke's next edge made; the
    /// nodes of the pairs that changed, rising.
    pub(super) fn update(
        &mut self,
        graph: &Graph<'_>,
        cuts: &Cuts,
        new: Range<usize>,
        (stroke, edge): (usize, &[DVec3]),
        inside: &(dyn Fn(DVec3) -> bool + Sync),
    ) -> Result<Vec<u32>, BodyProblem> {
        match self {
            Self::Pairs(factors) => Ok(factors.update(graph, cuts, new, inside).nodes),
            Self::Grids(_) if new.is_empty() => Ok(Vec::new()),
            Self::Grids(grids) => grids.update(graph, stroke, edge),
        }
    }
}

impl Grids {
    fn update(
        &mut self,
        graph: &Graph<'_>,
        stroke: usize,
        edge: &[DVec3],
    ) -> Result<Vec<u32>, BodyProblem> {
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
        let rows = graph.offsets().windows(2).zip(0_u32..);
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
    [0, edge.len() - 1].map(|at| edge[at])
}
