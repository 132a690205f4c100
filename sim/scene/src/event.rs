//! What acts on the bodies: supports, gravity and cuts.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::path::{Key, pose_at};
use super::region::Region;

/// Nodes that are held or moved as a scripted path says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Support {
    /// Name of the body; every body where not given.
    #[serde(default)]
    pub body: Option<String>,
    /// Part of space, in rest coordinates, whose nodes are supported.
    pub region: Region,
    /// How the supported nodes move.
    #[serde(default)]
    pub motion: SupportMotion,
}

impl Support {
    /// Whether it holds a body of this name.
    #[must_use]
    pub fn acts_on(&self, body: &str) -> bool {
        self.body.as_ref().is_none_or(|name| name == body)
    }

    /// Holds the nodes of a region of every body where they rest.
    #[must_use]
    pub fn fixed(region: Region) -> Self {
        Self {
            body: None,
            region,
            motion: SupportMotion::Fixed,
        }
    }

    /// Moves the nodes of a region of every body rigidly along a path.
    #[must_use]
    pub fn driven(region: Region, path: Vec<Key>) -> Self {
        Self {
            body: None,
            region,
            motion: SupportMotion::Driven { path },
        }
    }
}

/// How supported nodes move.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, rename = "Motion")]
pub enum SupportMotion {
    /// They stay where they rest.
    #[default]
    Fixed,
    /// They move rigidly: the position at rest, rotated and translated by the path.
    Driven {
        /// Keys of the motion.
        path: Vec<Key>,
    },
}

/// Uniform gravity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Gravity {
    /// Acceleration (m/s^2).
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub acceleration: DVec3,
    /// Time (s) over which gravity grows from nothing to its full size at the start of the run.
    pub ramp: f64,
}

impl Default for Gravity {
    fn default() -> Self {
        Self {
            acceleration: DVec3::new(0.0, 0.0, -9.81),
            ramp: 0.3,
        }
    }
}

/// A stroke of a blade: the surface that its edge sweeps through the world is cut open.
///
/// The stroke starts at the path's first key and ends at its last. Where cuts leave less between two parts of a body than a
/// node spacing, it is severed, too.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Cut {
    /// Name in reports; unique among the cuts.
    #[serde(default = "Cut::default_name")]
    pub name: String,
    /// Name of the body that is cut; every body where not given.
    #[serde(default)]
    pub body: Option<String>,
    /// Points (m) of the blade's edge in the blade's own frame, at least two.
    #[cfg_attr(feature = "schemars", schemars(with = "Vec<[f64; 3]>"))]
    pub edge: Vec<DVec3>,
    /// How the blade moves through the world, at least two keys.
    pub path: Vec<Key>,
    /// When the edge is taken up along the path; START and END are always taken up.
    #[serde(default)]
    pub capture: Capture,
    /// Distance (m) below which the cut joins an earlier cut; chosen from the spacing where not given.
    #[serde(default)]
    pub weld_tolerance: Option<f64>,
}

impl Cut {
    /// A blade's edge (m, in its own frame) driven along a path through every body.
    #[must_use]
    pub fn new(edge: Vec<DVec3>, path: Vec<Key>) -> Self {
        Self {
            name: Self::default_name(),
            body: None,
            edge,
            path,
            capture: Capture::default(),
            weld_tolerance: None,
        }
    }

    fn default_name() -> String {
        "cut".to_owned()
    }

    /// Time (s) of the first key.
    ///
    /// # Panics
    /// If the path has no key; a validated scene has two at least.
    #[must_use]
    pub fn start(&self) -> f64 {
        self.path.first().expect("a validated cut has keys").time
    }

    /// Time (s) of the last key.
    ///
    /// # Panics
    /// If the path has no key; a validated scene has two at least.
    #[must_use]
    pub fn end(&self) -> f64 {
        self.path.last().expect("a validated cut has keys").time
    }

    /// World points (m) of the blade's edge at `time` (s).
    #[must_use]
    pub fn edge_at(&self, time: f64) -> Vec<DVec3> {
        let pose = pose_at(&self.path, time);
        self.edge.iter().map(|&point| pose.apply(point)).collect()
    }

    /// Times (s) at which the edge is taken up, in increasing order, first and last key included.
    ///
    /// Between two keys the intervals are equal; a distance takes as few of them as let the
    /// farthest edge point, whose path is measured by chords, move that far in each. `spacing` (m) is that of
    /// [`Capture::Spacing`].
    #[must_use]
    pub fn capture_times(&self, spacing: f64) -> Vec<f64> {
        /// So that 0.07 m in pieces of 0.01 m are 7 pieces, whatever the last bit says.
        const ROUNDING: f64 = 1e-9;
        let mut times = Vec::new();
        for pair in self.path.windows(2) {
            let (from, to) = (pair[0].time, pair[1].time);
            let intervals = match self.capture {
                Capture::Rate(rate) => (to - from) * rate,
                Capture::Distance(distance) => self.travel(from, to) / distance,
                Capture::Spacing(share) => self.travel(from, to) / (share * spacing),
            };
            let intervals = (intervals * (1.0 - ROUNDING)).ceil().max(1.0);
            let mut index = 0.0;
            while index < intervals {
                times.push(from + (to - from) * (index / intervals));
                index += 1.0;
            }
        }
        times.extend(self.path.last().map(|key| key.time));
        times
    }

    /// Longest path (m) of an edge point over the whole stroke, by chords.
    pub(crate) fn way(&self) -> f64 {
        let pairs = self.path.windows(2);
        pairs
            .map(|pair| self.travel(pair[0].time, pair[1].time))
            .sum()
    }

    /// Longest path (m) of an edge point between two times (s), by 16 chords.
    fn travel(&self, from: f64, to: f64) -> f64 {
        const CHORDS: u32 = 16;
        let mut way = vec![0.0; self.edge.len()];
        let mut before = self.edge_at(from);
        for index in 1..=CHORDS {
            let now = self.edge_at(from + (to - from) * f64::from(index) / f64::from(CHORDS));
            for ((way, a), b) in way.iter_mut().zip(&before).zip(&now) {
                *way += a.distance(*b);
            }
            before = now;
        }
        way.into_iter().fold(0.0, f64::max)
    }
}

/// When the edge of a moving blade is taken up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Capture {
    /// Times per second (1/s).
    Rate(f64),
    /// Every time the fastest point of the edge has moved this far (m).
    Distance(f64),
    /// Every time the fastest point of the edge has moved this fraction of the mean distance of neighbouring nodes, of the
    /// body that is cut whose nodes are nearest together.
    Spacing(f64),
}

impl Default for Capture {
    /// What a cut releases goes into the decay of the retained gradients and into motion, shared by how far the
    /// edge comes from one capture to the next, in node spacings: with a fixed number a second a body of 500 nodes was
    /// cut more gently than one of 5,000. On blocks of 500 to 5,000 nodes (`benches -- matrix --filter block`) shares of 0.05, 0.1, 0.15,
    /// 0.2 and 0.3 let the energy released by the decay spread by -33 to +4, -28 to +10, -9 to +7, -8 to +8 and -28 to +13 % round
    /// its median, which is 0.090, 0.086, 0.086, 0.070 and 0.048 J cut through.
    fn default() -> Self {
        Self::Spacing(0.15)
    }
}
