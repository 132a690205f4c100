//! Factors on pairs that cuts cross, by the rule that a body's scene asks for.

use std::ops::Range;

use glam::DVec3;
use phyxel_enrich::{
    Cuts, FactorSettings, Graph, GridFactors, GridSettings, PairFactors, Reach, Rule,
};

use crate::scene::CutRule;

/// Factors of either kind.
#[derive(Debug, Clone)]
pub enum Factors {
    /// Pair by pair, where a cut crosses it.
    Pairs(PairFactors),
    /// From the dissertation's grids, one for each stroke.
    Grids(Box<GridFactors>),
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
                cells,
            } => {
                let ours = GridSettings::for_spacing(spacing);
                let settings = GridSettings {
                    spacing: points.unwrap_or(ours.spacing),
                    inflate: inflate.unwrap_or(ours.inflate),
                    ..ours
                };
                let grids =
                    GridFactors::new(graph, radii, &settings, cells.map(|cells| cells.into()));
                return Self::Grids(Box::new(grids));
            }
        };
        Self::Pairs(PairFactors::new(graph, &settings))
    }

    /// Factor of a directed pair.
    #[must_use]
    pub fn factor(&self, pair: usize) -> f64 {
        match self {
            Self::Pairs(factors) => factors.factor(pair),
            Self::Grids(grids) => grids.factor(pair),
        }
    }

    /// Number of undirected pairs whose factor is below 1.
    #[must_use]
    pub fn crossed_count(&self) -> usize {
        match self {
            Self::Pairs(factors) => factors.crossed_count(),
            Self::Grids(grids) => grids.crossed_count(),
        }
    }

    /// Number of undirected pairs whose factor is 0.
    #[must_use]
    pub fn severed_count(&self) -> usize {
        match self {
            Self::Pairs(factors) => factors.severed_count(),
            Self::Grids(grids) => grids.severed_count(),
        }
    }

    /// Heap bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match self {
            Self::Pairs(factors) => factors.bytes(),
            Self::Grids(grids) => grids.bytes(),
        }
    }

    /// Lattices of the dissertation's grids and undirected pairs without one; `None` where the rule is
    /// another.
    #[must_use]
    pub fn grid_counts(&self) -> Option<(usize, usize)> {
        match self {
            Self::Pairs(_) => None,
            Self::Grids(grids) => Some((grids.lattice_count(), grids.count_without_lattice())),
        }
    }

    /// Notes where the front of a stroke starts to cut.
    pub(super) fn start(&mut self, stroke: usize, ends: [DVec3; 2]) {
        if let Self::Grids(grids) = self {
            grids.start(stroke, ends);
        }
    }

    /// Brings the factors up to date with the `new` triangles, by which a cut grew as the front of a
    /// stroke went from ends to ends; the nodes of the pairs that changed, rising.
    pub(super) fn update(
        &mut self,
        graph: &Graph<'_>,
        cuts: &Cuts,
        new: Range<usize>,
        front: (usize, Option<[[DVec3; 2]; 2]>),
        inside: &(dyn Fn(DVec3) -> bool + Sync),
    ) -> Vec<u32> {
        match self {
            Self::Pairs(factors) => factors.update(graph, cuts, new, inside).nodes,
            Self::Grids(grids) => grids.update(graph, cuts, new, front, inside),
        }
    }
}
