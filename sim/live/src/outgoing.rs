//! Binary messages to clients. What they hold is written down in PROTOCOL.md.

use glam::{DMat3, DQuat, DVec2, DVec3, Vec3};

use crate::wire::{Writer, single};

/// Kinds of binary messages to clients.
pub(crate) mod kind {
    pub(crate) const NODES: u16 = 1;
    pub(crate) const SKIN: u16 = 2;
    pub(crate) const CLIPS: u16 = 3;
    pub(crate) const STATE: u16 = 4;
    pub(crate) const FORCE: u16 = 5;
}

/// Most clients at a time; a state says for each of them what it has seen of it.
pub const MAX_CLIENTS: usize = 8;

/// Nodes of a body at rest: positions (m).
#[must_use]
pub fn encode_nodes(epoch: u32, body: usize, rest: &[DVec3]) -> Vec<u8> {
    let mut out = Writer::new(kind::NODES, epoch, 8 + 12 * rest.len());
    out.count(body);
    out.count(rest.len());
    out.end_head();
    out.points(rest);
    out.finish()
}

/// One surfel at rest, as a client carries and draws it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surfel<'a> {
    /// Centre (m).
    pub position: DVec3,
    /// Radius (m).
    pub radius: f64,
    /// Unit normal.
    pub normal: DVec3,
    /// Index of the surface's properties.
    pub material: u8,
    /// Shape operator (xx, xy, yy) in the tangents (1/m).
    pub shape: DVec3,
    /// Linear colour.
    pub color: Vec3,
    /// Nodes that carry it.
    pub nodes: &'a [u32],
    /// Their weights; they sum to 1.
    pub weights: &'a [f64],
    /// Change of the weights along the two tangents (1/m).
    pub slopes: &'a [[f64; 2]],
}

/// Numbers of single precision that a surfel takes before those of its nodes.
const OWN_NUMBERS: usize = 16;

/// Numbers of a surfel whose row has `stride` nodes.
#[must_use]
pub const fn surfel_numbers(stride: usize) -> usize {
    OWN_NUMBERS + 4 * stride
}

/// Appends the numbers of a surfel as [`encode_skin`] takes them.
pub fn put_surfel(numbers: &mut Vec<f32>, surfel: &Surfel<'_>) {
    let four = |v: Vec3, last: f32| v.extend(last).to_array();
    numbers.extend(four(surfel.position.as_vec3(), single(surfel.radius)));
    numbers.extend(four(surfel.normal.as_vec3(), surfel.material.into()));
    numbers.extend(four(surfel.shape.as_vec3(), 0.0));
    numbers.extend(four(surfel.color, 0.0));
    let rows = surfel.nodes.iter().zip(surfel.weights).zip(surfel.slopes);
    for ((&node, &weight), slope) in rows {
        numbers.extend([
            single(f64::from(node)),
            single(weight),
            single(slope[0]),
            single(slope[1]),
        ]);
    }
}

/// A run of surfels from index `first` on: new ones, or others instead of those that a cut changed.
/// `numbers` has [`surfel_numbers`] entries for each.
///
/// # Panics
/// If `numbers` does not divide into surfels.
#[must_use]
pub fn encode_skin(
    epoch: u32,
    body: usize,
    first: usize,
    stride: usize,
    numbers: &[f32],
) -> Vec<u8> {
    let each = surfel_numbers(stride);
    assert_eq!(numbers.len() % each, 0, "whole surfels");
    let mut out = Writer::new(kind::SKIN, epoch, 16 + 4 * numbers.len());
    out.count(body);
    out.count(first);
    out.count(numbers.len() / each);
    out.count(stride);
    out.end_head();
    out.f32s(numbers.iter().copied());
    out.finish()
}

/// What bounds one disk, in its tangent plane (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClipOf<'a> {
    /// Index of the surfel.
    pub surfel: usize,
    /// The point that sees.
    pub anchor: DVec2,
    /// Direction and offset of lines beyond which there is no body.
    pub edges: &'a [(DVec2, f64)],
    /// Segments that block the view.
    pub walls: &'a [[DVec2; 2]],
}

/// Clips of surfels that got one, or another.
#[must_use]
pub fn encode_clips(epoch: u32, body: usize, clips: &[ClipOf<'_>]) -> Vec<u8> {
    let mut out = Writer::new(kind::CLIPS, epoch, 8 + 96 * clips.len());
    out.count(body);
    out.count(clips.len());
    out.end_head();
    for clip in clips {
        out.count(clip.surfel);
        out.count(clip.edges.len());
        out.count(clip.walls.len());
        out.singles(clip.anchor.to_array());
        for (direction, offset) in clip.edges {
            out.singles(direction.extend(*offset).to_array());
        }
        out.singles(clip.walls.iter().flatten().flat_map(DVec2::to_array));
    }
    out.finish()
}

/// A tool in a state.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ToolState {
    /// Where it is (m).
    pub position: DVec3,
    /// Rotation, a unit quaternion (x, y, z, w).
    pub rotation: DQuat,
    /// Force on it (N).
    pub force: DVec3,
    /// Torque on it about its origin (N m).
    pub torque: DVec3,
    /// Deepest penetration (m).
    pub penetration: f64,
}

/// A body in a state.
#[derive(Debug, Clone, Copy)]
pub struct BodyState<'a> {
    /// Positions of the nodes (m).
    pub positions: &'a [DVec3],
    /// Deformation gradients.
    pub gradients: &'a [DMat3],
    /// For each quantity of [`StateMessage::values`], in order, a number (Pa) a node.
    pub values: &'a [f32],
}

/// Everything that moves, between two steps.
#[derive(Debug, Clone, Default)]
pub struct StateMessage<'a> {
    /// Counts states; acknowledged by it.
    pub number: u32,
    /// Steps taken.
    pub step: u64,
    /// Simulated time (s).
    pub time: f64,
    /// Length of a step (s).
    pub step_size: f64,
    /// Last sequence number of each client's hands that is in this state.
    pub seen: [u32; MAX_CLIENTS],
    /// Kinetic energy (J), elastic energy (J), balance of the audit over its scale.
    pub energies: [f64; 3],
    /// Force on the grip (N).
    pub grip: DVec3,
    /// The tools.
    pub tools: &'a [ToolState],
    /// Edge of the blade as it is driven (m); empty where there is none.
    pub blade: &'a [DVec3],
    /// Quantities that the bodies have values of, bits: 1 stress, 2 pressure of contact. None unless a client asks.
    pub values: u32,
    /// The bodies.
    pub bodies: &'a [BodyState<'a>],
}

/// A state as it is sent. Of gradients what differs from rest is sent, in half precision: where a
/// surfel is carried to stays exact to 1e-6 of a body.
#[must_use]
pub fn encode_state(epoch: u32, state: &StateMessage<'_>) -> Vec<u8> {
    let nodes: usize = state.bodies.iter().map(|body| body.positions.len()).sum();
    let mut out = Writer::new(
        kind::STATE,
        epoch,
        256 + 64 * state.tools.len() + 30 * nodes,
    );
    out.u32(state.number);
    out.count(state.bodies.len());
    out.u64(state.step);
    out.f64(state.time);
    out.f64(state.step_size);
    for seen in state.seen {
        out.u32(seen);
    }
    out.singles(state.energies);
    out.points(&[state.grip]);
    out.count(state.tools.len());
    out.count(state.blade.len());
    if state.values != 0 {
        out.u32(state.values);
    }
    out.end_head();
    for tool in state.tools {
        out.points(&[tool.position]);
        out.singles(tool.rotation.to_array());
        out.points(&[tool.force, tool.torque]);
        out.singles([tool.penetration]);
    }
    out.points(state.blade);
    for body in state.bodies {
        out.count(body.positions.len());
        out.points(body.positions);
        let apart = body.gradients.iter().map(|now| *now - DMat3::IDENTITY);
        out.halves(apart.flat_map(|apart| apart.to_cols_array()));
        out.align();
        out.f32s(body.values.iter().copied());
    }
    out.finish()
}

/// A sample of what a hand feels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceSample {
    /// Simulated time (s).
    pub time: f64,
    /// Force (N).
    pub force: DVec3,
    /// Deepest penetration (m).
    pub penetration: f64,
}

/// Samples of the force on a hand, in order of time. `hand` is the index of a tool, or
/// [`GRIP`] for the grip.
#[must_use]
pub fn encode_force(epoch: u32, hand: u32, samples: &[ForceSample]) -> Vec<u8> {
    let mut out = Writer::new(kind::FORCE, epoch, 8 + 24 * samples.len());
    out.u32(hand);
    out.count(samples.len());
    out.end_head();
    for sample in samples {
        out.f64(sample.time);
        out.points(&[sample.force]);
        out.singles([sample.penetration]);
    }
    out.finish()
}

/// The grip, instead of a tool's index.
pub const GRIP: u32 = u32::MAX;
