//! Binary messages from clients: read with care, as anyone may have written them.

use glam::{DQuat, DVec3};

use crate::wire::Reader;

mod kind {
    pub(super) const ACK: u16 = 16;
    pub(super) const POSE: u16 = 17;
    pub(super) const EDGE: u16 = 18;
    pub(super) const GRIP: u16 = 19;
    pub(super) const MESH: u16 = 20;
}

/// Most points of a blade's edge.
pub const MAX_EDGE: usize = 64;
/// Largest mesh file (bytes) that a client may send.
pub const MAX_MESH: usize = 64 << 20;
/// Farthest position (m) that a pointer may be at.
const FARTHEST: f64 = 100.0;

/// When in a stroke or a grip a message belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HandPhase {
    /// It starts.
    Begin,
    /// It continues.
    Move,
    /// It ends.
    End,
}

impl Hand {
    /// When in a stroke or a grip it is.
    #[must_use]
    pub const fn phase(&self) -> HandPhase {
        match self {
            Self::Pose { phase, .. } | Self::Edge { phase, .. } | Self::Grip { phase, .. } => {
                *phase
            }
        }
    }
}

/// What a user does, in the world's frame and in SI units.
#[derive(Debug, Clone, PartialEq)]
pub enum Hand {
    /// Moves a tool; with [`HandPhase::Begin`] it is put there, with [`HandPhase::End`] it is taken away.
    Pose {
        /// Index of the tool.
        tool: usize,
        /// When.
        phase: HandPhase,
        /// Place (m).
        position: DVec3,
        /// Rotation, of unit length.
        rotation: DQuat,
    },
    /// Moves a blade.
    Edge {
        /// When in the stroke.
        phase: HandPhase,
        /// Points of its edge (m); may be empty at the end.
        points: Vec<DVec3>,
    },
    /// Grips a patch of a body's surface and pulls it.
    Grip {
        /// When.
        phase: HandPhase,
        /// Where the hand is (m).
        position: DVec3,
        /// Radius (m) of the patch; counts at the beginning.
        radius: f64,
    },
}

/// A message from a client.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Incoming {
    /// The state of this number was drawn; another may be sent.
    Ack(u32),
    /// A hand's doing, and the client's number for it.
    Hand(u32, Hand),
    /// A piece of a mesh file.
    Mesh {
        /// Bytes of the whole.
        total: usize,
        /// Where the piece begins.
        offset: usize,
        /// File name extension: letters only.
        extension: String,
        /// The piece.
        piece: Vec<u8>,
    },
}

/// Understands a message; `None` for one that is malformed or of a kind that is not known.
pub(crate) fn decode(bytes: &[u8]) -> Option<Incoming> {
    let mut head = Reader::new(bytes);
    let kind = head.u16()?;
    let start = usize::from(head.u16()?);
    head.u32()?;
    let tail = Reader::new(bytes.get(start..)?);
    // A head that claims to be shorter than its own beginning is malformed.
    if start < crate::wire::HEADER {
        return None;
    }
    Some(match kind {
        kind::ACK => Incoming::Ack(head.u32()?),
        kind::POSE | kind::EDGE | kind::GRIP => {
            let (sequence, phase) = (head.u32()?, phase(head.u32()?)?);
            Incoming::Hand(sequence, hand(kind, phase, head, tail)?)
        }
        kind::MESH => piece(head, &tail)?,
        _ => return None,
    })
}

fn hand(kind: u16, phase: HandPhase, mut head: Reader<'_>, mut tail: Reader<'_>) -> Option<Hand> {
    if kind == kind::GRIP {
        let position = place(head.finite()?)?;
        let [radius] = head.finite()?;
        return (0.0..=1.0).contains(&radius).then_some(Hand::Grip {
            phase,
            position,
            radius,
        });
    }
    let count = usize::try_from(head.u32()?).ok()?;
    if kind == kind::POSE {
        head.u32()?;
        return Some(Hand::Pose {
            tool: count,
            phase,
            position: place(head.finite()?)?,
            rotation: unit(head.finite()?)?,
        });
    }
    let none = phase == HandPhase::End && count == 0;
    if !none && !(2..=MAX_EDGE).contains(&count) {
        return None;
    }
    let points = (0..count).map(|_| place(tail.finite()?));
    let points = points.collect::<Option<Vec<_>>>()?;
    Some(Hand::Edge { phase, points })
}

/// A piece of a mesh file.
fn piece(mut head: Reader<'_>, tail: &Reader<'_>) -> Option<Incoming> {
    let total = usize::try_from(head.u32()?).ok()?;
    let offset = usize::try_from(head.u32()?).ok()?;
    let extension = head.u32()?.to_le_bytes().into_iter();
    let extension: Vec<u8> = extension.take_while(|&b| b != 0).collect();
    let plain = extension.iter().all(u8::is_ascii_lowercase) && !extension.is_empty();
    let piece = tail.rest().to_vec();
    let fits = total <= MAX_MESH && !piece.is_empty();
    let end = offset.checked_add(piece.len())?;
    (plain && fits && end <= total).then_some(Incoming::Mesh {
        total,
        offset,
        extension: String::from_utf8(extension).ok()?,
        piece,
    })
}

const fn phase(number: u32) -> Option<HandPhase> {
    match number {
        0 => Some(HandPhase::Begin),
        1 => Some(HandPhase::Move),
        2 => Some(HandPhase::End),
        _ => None,
    }
}

fn place(point: [f64; 3]) -> Option<DVec3> {
    let point = DVec3::from_array(point);
    (point.abs().max_element() <= FARTHEST).then_some(point)
}

/// The rotation made unit; `None` if it is none.
fn unit(q: [f64; 4]) -> Option<DQuat> {
    let rotation = DQuat::from_array(q);
    let length = rotation.length();
    ((length - 1.0).abs() < 1e-3).then(|| rotation / length)
}
