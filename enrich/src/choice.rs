//! How a cut weakens the pairs that it crosses, as settings say it.

use std::ops::Range;

use glam::{DMat3, DVec3};

use crate::checks::{BadSetting, Checks};
use crate::comparators::{GridFactors, GridSettings};
use crate::cuts::Cuts;
use crate::factors::{FactorSettings, PairFactors};
use crate::graph::{Graph, InfluenceRadius};
use crate::rule::Rule;

/// How a cut weakens the pairs that it crosses.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum CutRule {
    /// By the shortest way round the cut: the diffraction criterion.
    #[cfg_attr(feature = "schemars", schemars(extend("x-former" = "Detour")))]
    Diffraction {
        /// Influence radius of a node, in mean lengths of its pairs.
        #[cfg_attr(
            feature = "serde",
            serde(default = "CutRule::default_influence_radius")
        )]
        #[cfg_attr(feature = "schemars", schemars(extend("x-former" = "reach")))]
        influence_radius: f64,
    },
    /// Nothing passes a cut; for comparison, the crack acts up to half a spacing too long.
    Visibility,
    /// By the distance of the crossing from the cut's nearest edge; for comparison, made for straight
    /// cuts.
    Transparency {
        /// Depth from which nothing passes, as a share of the influence radius.
        #[cfg_attr(feature = "serde", serde(default = "CutRule::default_depth"))]
        depth: f64,
        /// Exponent, 2 or more.
        #[cfg_attr(feature = "serde", serde(default = "CutRule::default_exponent"))]
        exponent: f64,
    },
    /// The dissertation's enrichment grid, one for each cut, built anew at each capture (Aras 2014,
    /// eqs. (39)-(48), (64)); for comparison. Of a blade's edge it takes the two ends in the body. Where
    /// a cut turns by more than 45 degrees, folds or comes back, another grid begins; `Diffraction()` decides the
    /// pairs that no grid does, as where the edge bends in the material, and the summary counts them.
    Grid {
        /// Distance (m) of its points; half the distance of nodes where not given.
        #[cfg_attr(feature = "serde", serde(default))]
        spacing: Option<f64>,
        /// Margin (m) round the cut; three distances of nodes where not given.
        #[cfg_attr(feature = "serde", serde(default))]
        inflate: Option<f64>,
        /// Numbers of its cells along x, y and z over the body's box with the margin, in place of
        /// `spacing` (the appendix's resX, resY, resZ).
        #[cfg_attr(feature = "serde", serde(default))]
        #[cfg_attr(feature = "schemars", schemars(with = "Option<[u32; 3]>"))]
        cells: Option<(u32, u32, u32)>,
    },
}

impl CutRule {
    /// The fields that are out of their bounds; none in sound settings.
    #[must_use]
    pub fn check(&self) -> Vec<BadSetting> {
        let mut checks = Checks::default();
        match *self {
            Self::Diffraction { influence_radius } => {
                let hint = ", in mean lengths of pairs, such as 2";
                checks.positive("influence_radius", influence_radius, hint);
            }
            Self::Visibility => {}
            Self::Transparency { depth, exponent } => {
                checks.positive("depth", depth, "");
                let holds = exponent.is_finite() && exponent >= 2.0;
                let must = "it must be finite and 2 or more";
                checks.require("exponent", exponent, holds, must, &[]);
            }
            Self::Grid {
                spacing,
                inflate,
                cells,
            } => {
                if let Some(cells) = cells {
                    let fits = <[u32; 3]>::from(cells).iter().all(|count| *count > 0);
                    checks.require(
                        "cells",
                        format_args!("{cells:?}"),
                        fits && spacing.is_none(),
                        "give one cell or more along each axis, and no spacing beside them",
                        &["spacing"],
                    );
                }
                for (name, length) in [("spacing", spacing), ("inflate", inflate)] {
                    if let Some(length) = length {
                        checks.positive(name, length, " (m)");
                    }
                }
            }
        }
        checks.0
    }

    const fn default_influence_radius() -> f64 {
        2.0
    }

    #[cfg(feature = "serde")]
    const fn default_depth() -> f64 {
        1.0
    }

    #[cfg(feature = "serde")]
    const fn default_exponent() -> f64 {
        2.0
    }
}

impl Default for CutRule {
    fn default() -> Self {
        Self::Diffraction {
            influence_radius: Self::default_influence_radius(),
        }
    }
}

/// Parts of fewer nodes are debris. They are not taken for a part that a cut parts from the rest: right at a front are nodes all
/// of whose pairs it bends. Other bounds were not tried.
pub const SMALLEST_PART: usize = 12;

/// Factors of either kind.
#[derive(Debug, Clone)]
pub enum Factors {
    /// Pair by pair, where a cut crosses it.
    Pairs(PairFactors),
    /// From the dissertation's grids, one for each stroke.
    Grids(Box<GridFactors>),
}

impl Factors {
    /// All factors 1. `radii` are the support radii (m) of the nodes, which lie `spacing` (m) apart.
    ///
    /// # Panics
    /// If there is not one radius for each node.
    #[must_use]
    pub fn new(rule: CutRule, graph: &Graph<'_>, radii: Vec<f64>, spacing: f64) -> Self {
        let usual = FactorSettings::default();
        let settings = match rule {
            CutRule::Diffraction { influence_radius } => FactorSettings {
                influence_radius: InfluenceRadius::Neighbors(influence_radius),
                rule: Rule::Diffraction,
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

    /// How a cut ends beside a node, see [`PairFactors::front_matrix`]; zero with the dissertation's grids, which know no
    /// ways.
    ///
    /// # Panics
    /// If there is no such node, or the graph has other numbers of nodes and pairs than that of the start.
    #[must_use]
    pub fn front_matrix(&self, graph: &Graph<'_>, node: usize) -> DMat3 {
        match self {
            Self::Pairs(factors) => factors.front_matrix(graph, node),
            Self::Grids(_) => DMat3::ZERO,
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
    pub fn start(&mut self, stroke: usize, ends: [DVec3; 2]) {
        if let Self::Grids(grids) = self {
            grids.start(stroke, ends);
        }
    }

    /// Brings the factors up to date with the `new` triangles, by which a cut grew as the front of a
    /// stroke went from ends to ends; the nodes of the pairs that changed, rising.
    pub fn update(
        &mut self,
        graph: &Graph<'_>,
        cuts: &Cuts,
        new: Range<usize>,
        front: (usize, Option<[[DVec3; 2]; 2]>),
        inside: &(dyn Fn(DVec3) -> bool + Sync),
    ) -> Vec<u32> {
        match self {
            Self::Pairs(factors) => {
                let mut touched = factors.update(graph, cuts, new, inside);
                factors.sever_ligaments(graph, &mut touched, SMALLEST_PART);
                touched.nodes
            }
            Self::Grids(grids) => grids.update(graph, cuts, new, front, inside),
        }
    }
}
