//! How a body's nodes are coupled, and how cuts weaken that.

use serde::{Deserialize, Serialize};

/// How nodes are coupled.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub enum Method {
    /// Neighbours along the edges of tetrahedra, gradients that keep momentum and pass the patch test,
    /// volumes that sum to the body's.
    #[default]
    Conservative,
    /// The dissertation's, for comparison: nearest nodes (each looks for its own), plain moving least squares
    /// (Aras 2014, eqs. (15), (16), (25)-(27)), masses and volumes of eqs. (17) and (18), which exceed
    /// the body's. It has no control of zero-energy modes, so `material.stabilization` must be 0.
    Dissertation {
        /// Nearest nodes whose mean distance sets the support radius.
        #[serde(default = "Method::default_nearest")]
        nearest: u32,
        /// Support radius over that mean distance.
        #[serde(default = "Method::default_support_scale")]
        support_scale: f64,
        /// Most neighbours that a node looks for; `None` takes all within the support radius.
        #[serde(default = "Method::default_neighbor_limit")]
        neighbor_limit: Option<u32>,
    },
}

impl Method {
    const fn default_nearest() -> u32 {
        16
    }

    const fn default_support_scale() -> f64 {
        1.5
    }

    #[allow(
        clippy::unnecessary_wraps,
        reason = "serde asks for a value of the field's type"
    )]
    const fn default_neighbor_limit() -> Option<u32> {
        Some(16)
    }
}

/// How a cut weakens the pairs that it crosses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub enum CutRule {
    /// By the shortest way round the cut.
    Detour {
        /// Distance over which nodes are coupled, in mean lengths of a node's pairs.
        #[serde(default = "CutRule::default_reach")]
        reach: f64,
    },
    /// Nothing passes a cut; for comparison, the crack acts up to half a spacing too long.
    Visibility,
    /// By the distance of the crossing from the cut's nearest edge; for comparison, made for straight
    /// cuts.
    Transparency {
        /// Depth from which nothing passes, as a share of the coupling distance.
        #[serde(default = "CutRule::default_depth")]
        depth: f64,
        /// Exponent, 2 or more.
        #[serde(default = "CutRule::default_exponent")]
        exponent: f64,
    },
    /// The dissertation's enrichment grid, one for each cut, built anew at each capture (Aras 2014,
    /// eqs. (39)-(48), (64)); for comparison. Of a blade's edge it takes the two ends in the body. Where
    /// a cut turns by more than 45 degrees, folds or comes back, another grid begins; `Detour()` decides the
    /// pairs that no grid does, as where the edge bends in the material, and the summary counts them.
    Grid {
        /// Distance (m) of its points; half the distance of nodes where not given.
        #[serde(default)]
        spacing: Option<f64>,
        /// Margin (m) round the cut; three distances of nodes where not given.
        #[serde(default)]
        inflate: Option<f64>,
        /// Numbers of its cells along x, y and z over the body's box with the margin, in place of
        /// `spacing` (the appendix's resX, resY, resZ).
        #[serde(default)]
        #[cfg_attr(feature = "cli", schemars(with = "Option<[u32; 3]>"))]
        cells: Option<(u32, u32, u32)>,
    },
}

impl CutRule {
    const fn default_reach() -> f64 {
        2.0
    }

    const fn default_depth() -> f64 {
        1.0
    }

    const fn default_exponent() -> f64 {
        2.0
    }
}

impl Default for CutRule {
    fn default() -> Self {
        Self::Detour {
            reach: Self::default_reach(),
        }
    }
}
