//! How a cut weakens the pairs that it crosses, as settings say it.

use std::ops::Range;

use glam::{DMat3, DVec3};

use crate::comparators::{EnrichmentGrid, GridFactors, GridSettings};
use crate::cuts::Cuts;
use crate::factors::{FactorSettings, PairFactors};
use crate::graph::{Graph, InfluenceRadius};
use crate::rule::Rule;

/// How a cut weakens the pairs that it crosses.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum CutRule {
    /// By the shortest path around the cut: the diffraction criterion.
    Diffraction {
        /// Influence radius of a node, in mean lengths of its pairs.
        #[cfg_attr(
            feature = "serde",
            serde(default = "CutRule::default_influence_radius")
        )]
        influence_radius: f64,
    },
    /// Nothing passes a cut; for comparison, the crack acts up to half a spacing too long.
    Visibility,
    /// The dissertation's enrichment grid, one for each cut, built again at each blade sample (Aras 2014,
    /// eqs. (39)-(48), (64)); for comparison. Of a blade's edge it takes the two ends in the body. Where
    /// a cut turns by more than 45 degrees, folds or comes back, another grid begins; `Diffraction()` decides the
    /// pairs that no grid does, as where the edge bends in the material, and the summary counts them.
    Grid {
        /// Distance (m) of its points; half the node spacing where not given.
        #[cfg_attr(feature = "serde", serde(default))]
        spacing: Option<f64>,
        /// Margin (m) around the cut; three node spacings where not given.
        #[cfg_attr(feature = "serde", serde(default))]
        inflate: Option<f64>,
        /// Numbers of its cells along x, y and z over the body's box with the margin, instead of
        /// `spacing` (the appendix's resX, resY, resZ).
        #[cfg_attr(feature = "serde", serde(default))]
        #[cfg_attr(feature = "schemars", schemars(with = "Option<[u32; 3]>"))]
        cells: Option<(u32, u32, u32)>,
    },
}

impl CutRule {
    /// Twice the mean length of a node's pairs was found best for edges of tetrahedra and of triangles (1.8 and 2.2 move
    /// the opening of an edge crack by about 1 %).
    pub(crate) const INFLUENCE_RADIUS: f64 = 2.0;

    #[cfg(feature = "serde")]
    const fn default_influence_radius() -> f64 {
        Self::INFLUENCE_RADIUS
    }
}

impl Default for CutRule {
    fn default() -> Self {
        Self::Diffraction {
            influence_radius: Self::INFLUENCE_RADIUS,
        }
    }
}

/// Parts of fewer nodes are debris, not a part that a cut parts from the rest: right at a front are nodes all of
/// whose pairs it bends. With 6 no figure of `prove matrix`, `griffith`, `invariance` and `cracks --quick` changes.
pub const SMALLEST_PART: usize = 12;

/// Factors of all pairs by a rule of choice.
#[derive(Debug, Clone)]
pub struct Factors {
    pairs: PairFactors,
    /// The dissertation's grids, for each stroke.
    grids: Option<Box<GridFactors>>,
}

impl Factors {
    /// All factors 1. `radii` are the support radii (m) of the nodes, which lie `spacing` (m) apart.
    ///
    /// # Panics
    /// If there is not one radius for each node.
    #[must_use]
    pub fn new(rule: CutRule, graph: &Graph<'_>, radii: Vec<f64>, spacing: f64) -> Self {
        assert_eq!(radii.len(), graph.positions.len(), "one radius per node");
        let mut settings = FactorSettings::default();
        let mut grids = None;
        match rule {
            CutRule::Diffraction { influence_radius } => {
                settings.influence_radius = InfluenceRadius::Neighbors(influence_radius);
            }
            CutRule::Visibility => settings.rule = Rule::Visibility,
            CutRule::Grid {
                spacing: points,
                inflate,
                cells,
            } => {
                let usual = GridSettings::for_spacing(spacing);
                let settings = GridSettings {
                    spacing: points.unwrap_or(usual.spacing),
                    inflate: inflate.unwrap_or(usual.inflate),
                    ..usual
                };
                let cells = cells.map(|cells| cells.into());
                grids = Some(Box::new(GridFactors::new(graph, radii, &settings, cells)));
            }
        }
        let pairs = PairFactors::new(graph, &settings);
        Self { pairs, grids }
    }

    /// Factor of a directed pair, by its position in the graph's indices.
    #[must_use]
    pub fn factor(&self, pair: usize) -> f64 {
        match &self.grids {
            Some(grids) => grids.factors[pair],
            None => self.pairs.factor(pair),
        }
    }

    /// How a cut ends beside a node, see [`PairFactors::front_matrix`]; zero with the dissertation's grids, which know no
    /// paths.
    ///
    /// # Panics
    /// If there is no such node, or the graph has other numbers of nodes and pairs than that of the start.
    #[must_use]
    pub fn front_matrix(&self, graph: &Graph<'_>, node: usize) -> DMat3 {
        match &self.grids {
            Some(_) => DMat3::ZERO,
            None => self.pairs.front_matrix(graph, node),
        }
    }

    /// Of each node whether a cut may have weakened one of its pairs; with the dissertation's grids true of all.
    ///
    /// # Panics
    /// If the graph has other numbers of nodes and pairs than that of the start.
    #[must_use]
    pub fn weakened_nodes(&self, graph: &Graph<'_>) -> Vec<bool> {
        let mut weakened = vec![self.grids.is_some(); graph.positions.len()];
        for (i, j, _) in self.pairs.crossed(graph) {
            weakened[i as usize] = true;
            weakened[j as usize] = true;
        }
        weakened
    }

    /// Number of undirected pairs whose factor is below 1.
    #[must_use]
    pub fn crossed_count(&self) -> usize {
        match &self.grids {
            Some(grids) => grids.factors.iter().filter(|f| **f < 1.0).count() / 2,
            None => self.pairs.crossed_count(),
        }
    }

    /// Number of undirected pairs whose factor is 0.
    #[must_use]
    pub fn severed_count(&self) -> usize {
        match &self.grids {
            Some(grids) => grids.factors.iter().filter(|f| **f == 0.0).count() / 2,
            None => self.pairs.severed_count(),
        }
    }

    /// Heap bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.pairs.bytes() + self.grids.as_ref().map_or(0, |grids| grids.bytes())
    }

    /// Lattices of the dissertation's grids, stroke by stroke; none where the rule is another.
    pub fn lattices(&self) -> impl Iterator<Item = &EnrichmentGrid> {
        self.grids.iter().flat_map(|grids| grids.lattices())
    }

    /// Number of lattices, and of undirected pairs that no lattice decides and [`PairFactors`] weakens or severs; `None`
    /// where the rule is another.
    #[must_use]
    pub fn grid_counts(&self) -> Option<(usize, usize)> {
        let grids = self.grids.as_ref()?;
        Some((grids.lattices().count(), grids.count_without_lattice()))
    }

    /// Brings the factors up to date with the `new` triangles, by which a cut grew as the front of a
    /// stroke went from ends to ends (m); the nodes of the pairs that changed, ascending.
    ///
    /// # Panics
    /// As [`PairFactors::update`].
    pub fn update(
        &mut self,
        graph: &Graph<'_>,
        cuts: &Cuts,
        new: Range<usize>,
        front: (usize, Option<[[DVec3; 2]; 2]>),
        inside: &(dyn Fn(DVec3) -> bool + Sync),
    ) -> Vec<u32> {
        let mut touched = self.pairs.update(graph, cuts, new.clone(), inside);
        if let Some(grids) = &mut self.grids {
            return grids.update(graph, cuts, new, front, &self.pairs);
        }
        self.pairs
            .sever_ligaments(graph, &mut touched, SMALLEST_PART);
        touched
    }
}
