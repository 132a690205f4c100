//! Control in JSON: requests of clients and messages to them.

use serde::{Deserialize, Serialize};

/// What a client asks for.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub enum Control {
    /// Let time run.
    Play,
    /// Let it stand.
    Pause,
    /// Take so many steps and stand again.
    Step {
        /// How many.
        #[serde(default = "one")]
        steps: u32,
    },
    /// Back to the beginning.
    Reset,
    /// Back to before the last stroke.
    Undo,
    /// Write recording, checkpoint and score sheet.
    Save {
        /// Name of the folder; empty for `save`.
        #[serde(default)]
        name: String,
    },
    /// Write a picture as seen by a camera.
    Picture(Picture),
    /// Another scene of those listed.
    Scene {
        /// Its name.
        name: String,
    },
    /// Change what the model is made of, or what acts on it.
    Set {
        /// Gravity (m/s²), downwards.
        #[serde(default)]
        gravity: Option<f64>,
        /// Mass-proportional damping (1/s).
        #[serde(default)]
        damping: Option<f64>,
        /// Young's modulus (Pa) of all bodies; builds the model again.
        #[serde(default)]
        stiffness: Option<f64>,
    },
    /// Build the scene of a mesh file again, its numbers in another unit.
    Unit {
        /// Metres per unit of the file.
        metres: f64,
    },
    /// Look on or look away: time stands while there are clients and none of them looks on. Who says nothing looks on.
    Watch {
        /// Whether it looks on.
        watching: bool,
    },
    /// A code with which another client may come in.
    Invite,
    /// Send with states what this client colours nodes by.
    Color {
        /// Which quantity.
        by: Quantity,
    },
    /// Play a recording that was saved here.
    Open {
        /// Name of its folder.
        name: String,
    },
    /// Something that this version does not know.
    #[serde(other)]
    Unknown,
}

/// What nodes may be coloured by.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Von Mises stress.
    Stress,
    /// Pressure of contact with tools and bodies.
    Contact,
    /// Nothing that is sent.
    #[default]
    #[serde(other)]
    None,
}

impl Quantity {
    /// Its bit in [`crate::StateMessage::values`].
    #[must_use]
    pub const fn bit(self) -> u32 {
        match self {
            Self::Stress => 1,
            Self::Contact => 2,
            Self::None => 0,
        }
    }
}

/// A picture as seen by a camera.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Picture {
    /// Eye (m).
    pub eye: [f64; 3],
    /// Point looked at (m).
    pub target: [f64; 3],
    /// Direction that is up in the picture.
    pub up: [f64; 3],
    /// Vertical field of view (degrees).
    pub field_of_view: f64,
    /// Size (pixels).
    pub width: u32,
    /// Size (pixels).
    pub height: u32,
}

const fn one() -> u32 {
    1
}

/// Messages to clients; every one has a `type`.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Told {
    /// First message to a client.
    Hello {
        /// The protocol's version.
        protocol: &'static str,
        /// Program and its version.
        server: String,
        /// The client's own position in a state's table of what was seen.
        client: usize,
    },
    /// The scene: first message of an epoch; all messages of an earlier epoch are out of date.
    Scene(Box<Scene>),
    /// Figures, a few times a second.
    Stats(Box<Stats>),
    /// Something that a person should read.
    Note {
        /// Whether it is a failure.
        bad: bool,
        /// The words.
        text: String,
    },
    /// Files were written.
    Saved {
        /// Folder.
        folder: String,
        /// Names in it.
        files: Vec<String>,
    },
    /// A code for another client.
    Invite {
        /// Where to go with it.
        url: String,
    },
}

/// A scene as clients see it.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Scene {
    /// Epoch that begins.
    pub epoch: u32,
    /// Name.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// Scenes that may be asked for: name and one line.
    pub scenes: Vec<[String; 2]>,
    /// Folders of recordings that may be asked for.
    pub recordings: Vec<String>,
    /// Simulated time (s) at which a recording ends that is played; 0 without one.
    pub length: f64,
    /// Corners (m) of the box around all bodies at rest.
    pub low: [f64; 3],
    /// The other corner.
    pub high: [f64; 3],
    /// Where the camera stands at first: azimuth, elevation (degrees), zoom.
    pub view: [f64; 3],
    /// Bodies.
    pub bodies: Vec<BodyInfo>,
    /// Tools.
    pub tools: Vec<ToolInfo>,
    /// Gravity (m/s²), damping (1/s), Young's modulus (Pa) as they are.
    pub values: [f64; 3],
    /// Distance (m) of a blade's path between two captures.
    pub capture: f64,
    /// Distance (m) between nodes.
    pub spacing: f64,
    /// Colours (linear) of the background at its top and bottom.
    pub background: [[f32; 3]; 2],
    /// Splats blend with those at most this much nearer, in radii.
    pub tolerance: f64,
    /// Largest stretch that a disk follows.
    pub max_stretch: f64,
    /// Whether the bodies still come to rest.
    pub settling: bool,
    /// What a user does at first: `cut`, or `press` where the scene has tools and no cuts.
    pub hand: &'static str,
    /// Metres per unit of the mesh file that the scene was made for; nothing of other scenes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<f64>,
}

/// A body as clients see it.
#[derive(Debug, Clone, Default, Serialize)]
pub struct BodyInfo {
    /// Name.
    pub name: String,
    /// Nodes.
    pub nodes: usize,
    /// Surfels of the uncut surface.
    pub outer: usize,
    /// For each material: strength and exponent of the highlight, amplitude of relief, its cells per
    /// metre.
    pub surfaces: Vec<[f32; 4]>,
    /// Linear colour of the inside seen through gaps.
    pub inside: [f32; 3],
}

/// A tool as clients see it.
#[derive(Debug, Clone, Default, Serialize)]
pub struct ToolInfo {
    /// Name.
    pub name: String,
    /// `sphere`, `capsule`, `box` or `plane`.
    pub shape: &'static str,
    /// Ends of a capsule's axis, size of a box and zero, normal of a plane and zero (m).
    pub points: [[f64; 3]; 2],
    /// Radius (m) of a sphere or capsule.
    pub radius: f64,
}

/// Figures that a person wants to read.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Stats {
    /// Whether time runs.
    pub playing: bool,
    /// Steps taken; the state after the last of them may still be on its way.
    pub step: u64,
    /// Whether a recording is played.
    pub replaying: bool,
    /// Whether bodies still come to rest.
    pub settling: bool,
    /// Simulated over wall time.
    pub real_time: f64,
    /// Wall time (s) by which the simulation has slipped so far.
    pub slipped: f64,
    /// Milliseconds of one step.
    pub step_ms: f64,
    /// Nodes, surfels, pairs severed.
    pub nodes: usize,
    /// Surfels, those of cuts included.
    pub surfels: usize,
    /// Pairs that cuts severed.
    pub severed: usize,
    /// Strokes so far.
    pub strokes: usize,
    /// How many strokes can be undone.
    pub undo: usize,
    /// Ways (m) of the blade, the tools and the grip in contact.
    pub path: [f64; 3],
    /// Largest force (N) on a tool and on the grip.
    pub peak: [f64; 2],
    /// Sum (N) of the normal forces of bodies on each other and of their flanks, where the scene has their contact.
    pub contact: Option<f64>,
    /// Energy balance over its scale: 0 for an exact solution.
    pub balance: f64,
    /// Gravity (m/s²), damping (1/s), Young's modulus (Pa).
    pub values: [f64; 3],
}

impl Told {
    /// The message as text.
    #[must_use]
    pub fn text(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }
}
