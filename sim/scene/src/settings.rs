//! How a scene is integrated, watched and drawn.

use phyxel_splat::{DrawMode, View};
use serde::{Deserialize, Serialize};

use super::rigid::RigidMesh;
use super::scheme::Scheme;

/// Time stepping.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Integration {
    /// Simulated time (s) after settling.
    pub duration: f64,
    /// Scheme of the steps.
    pub scheme: Scheme,
    /// Explicit step as a fraction of the largest stable one, above 0 and at most 1. Velocity Verlet with forces that are
    /// not linear resonates at 0.866 (`ω dt = √3`, Schlick 1998), and estimates of the largest eigenvalue come
    /// from below: at 0.85 a liver gained energy at a few nodes beside its cut, at 0.8 and less it did not.
    pub step_factor: f64,
    /// How the bodies come to rest before scene time starts; `None` starts at once.
    pub settle: Option<Settle>,
}

impl Default for Integration {
    fn default() -> Self {
        Self {
            duration: 4.0,
            scheme: Scheme::default(),
            // Of 60 scenes of `benches -- random --seed 6464` all end with an energy-balance error of at most 2.2e-3 (the limit is
            // 0.02); with 0.7 one of 61 of `--seed 1010` had 0.26.
            step_factor: 0.6,
            settle: Some(Settle::default()),
        }
    }
}

/// Coming to rest before scene time 0, so that the first cut meets tissue that hangs still.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Settle {
    /// How rest is reached.
    pub rest: Rest,
    /// Rest is reached when the root of the mean squared speed of the mass stays below this (m/s).
    pub speed: f64,
    /// Longest time (s) to wait for rest.
    pub limit: f64,
    /// Mass-proportional damping (1/s) while settling, instead of the bodies' own.
    pub damping: f64,
}

impl Default for Settle {
    fn default() -> Self {
        Self {
            rest: Rest::default(),
            speed: 2.0e-3,
            limit: 2.0,
            damping: 15.0,
        }
    }
}

/// How bodies come to rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Rest {
    /// By damped motion, while gravity grows.
    #[default]
    Motion,
    /// By a static solution under full gravity, at scene time 0. Not with tools. Where none is found, by motion, with a warning; the
    /// other keys of settling have a meaning only then.
    Equilibrium,
}

/// What is written down while the scene runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Observe {
    /// Rows of `history.csv` per simulated second (1/s).
    pub history_rate: f64,
    /// Rows of `tools.csv` and `contacts.csv` per simulated second (1/s): forces on the tools, as a haptic device would
    /// be sent them; with the key `contact`, of bodies on each other, a row for two that are near.
    pub force_rate: f64,
    /// States per simulated second (1/s) after settling in the folder `states`: nodes with stress and contact pressure as
    /// VTK with a list of times (`.vtk.series`), surfels as PLY where the scene has pictures. The last state is
    /// always written.
    pub state_rate: Option<f64>,
    /// Whether what tools and blades did is written down step by step, in `input.csv`; a run with
    /// `--replay` does it again.
    pub input: bool,
    /// Simulated time (s) between two checkpoints; `None` keeps one at the end only.
    pub checkpoint: Option<f64>,
}

impl Default for Observe {
    fn default() -> Self {
        Self {
            history_rate: 100.0,
            force_rate: 1000.0,
            state_rate: None,
            input: false,
            checkpoint: Some(0.25),
        }
    }
}

/// Frames drawn while the scene runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Pictures {
    /// Width of a frame (pixels).
    pub width: u32,
    /// Height of a frame (pixels).
    pub height: u32,
    /// Samples per pixel along each axis against jagged edges: 1, 2 or 4.
    pub samples: u32,
    /// Colours behind the bodies; that of a surgical drape where not given.
    pub background: Option<Backdrop>,
    /// How surfels are drawn.
    pub mode: DrawMode,
    /// Fraction of their radius at which surfels are drawn, to 1; with less they are seen one by one.
    pub splat_scale: f64,
    /// What is drawn: surfaces, or what lies behind them.
    pub show: Show,
    /// Frames per simulated second (1/s); also the speed of the animation.
    pub rate: f64,
    /// Where the camera stands.
    pub view: View,
    /// Rigid surfaces that stand in the scene to be seen, such as bones.
    pub meshes: Vec<RigidMesh>,
    /// What colours the surfaces.
    pub color: Coloring,
    /// Whether the frames are also written as one animated file.
    pub animation: bool,
    /// Whether settling is drawn too.
    pub settling: bool,
}

impl Default for Pictures {
    fn default() -> Self {
        Self {
            width: 960,
            height: 540,
            samples: 2,
            background: None,
            mode: DrawMode::default(),
            splat_scale: 1.0,
            show: Show::default(),
            rate: 25.0,
            view: View::default(),
            meshes: Vec::new(),
            color: Coloring::default(),
            animation: true,
            settling: true,
        }
    }
}

/// Colours (sRGB, 0 to 1) behind the bodies, even from one to the other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Backdrop {
    /// At the upper border.
    pub top: [f64; 3],
    /// At the lower border.
    pub bottom: [f64; 3],
}

/// What colours the surfaces; a quantity gets a legend.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub enum Coloring {
    /// The colours and images of the bodies' surfels.
    #[default]
    Tissue,
    /// How far each position has moved from where it is at rest.
    Displacement {
        /// Value of the last colour (m); the first is 0.
        most: f64,
    },
    /// Equivalent (von Mises) stress.
    Stress {
        /// Value of the last colour (Pa); the first is 0.
        most: f64,
    },
    /// Mean curvature of the deformed surface, positive where it bulges.
    Curvature {
        /// Value of the last colour (1/m); the first is its negative.
        most: f64,
    },
}

/// What pictures show, to look into a model (the displays of Aras 2014, appendix).
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub enum Show {
    /// Surfaces, tools and blades.
    #[default]
    Surface,
    /// Nodes and, as lines, the pairs that they see.
    Neighbors {
        /// The node whose pairs are shown; all where not given.
        #[serde(default)]
        node: Option<u32>,
    },
    /// Points of the lattices of `cut_rule: Grid`, where they lie in the body at rest, coloured by the
    /// enrichment from -1 to 1.
    Lattice,
    /// Surfaces with the normals of their surfels.
    Normals {
        /// Length of a normal (m).
        length: f64,
    },
    /// Nodes, a surfel and, as lines as thick as their weights, the nodes that carry it.
    Binding {
        /// Number of the surfel.
        surfel: u32,
    },
    /// Surfaces, and where the edges of blades have passed in the world.
    BladePath,
}
