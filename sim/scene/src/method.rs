//! How a body's nodes are coupled.

use serde::{Deserialize, Serialize};

/// How nodes are coupled.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub enum Method {
    /// Neighbours along the edges of tetrahedra, gradients that keep momentum and pass the patch test,
    /// volumes that sum to the body's.
    #[default]
    Conservative,
    /// The dissertation's, for comparison: nearest nodes (each looks for its own), plain moving least squares
    /// (Aras 2014, eqs. (15), (16), (25)-(27)), masses and volumes of eqs. (17) and (18), which exceed
    /// the body's. It has no hourglass stabilization, so `material.stabilization` must be 0.
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

    const fn default_neighbor_limit() -> Option<u32> {
        Some(16)
    }
}
