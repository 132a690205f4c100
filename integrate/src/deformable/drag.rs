//! Damping of what lies on something else.
//!
//! Damping leaves the rigid motions of free pieces alone ([`crate::Motion::set_pieces`]), so nothing would damp the bounce
//! of a piece that rests on another: surfaces that touch move together. Points that are pressed by `N` (N) therefore
//! drag with `−χ N v`, where `v` is the relative velocity of the pieces' rigid motions there: along the normal, and along
//! the surface as far as friction holds. A piece that lies by its weight `m g` is damped at the rate `χ g`. The forces
//! act on all nodes of a piece by their masses; their power is never positive, and momentum and angular momentum are kept.

use super::{DeformableContact, Moved};
use crate::pieces::{Inertia, RigidField, all};
use glam::DVec3;

/// Number of no free piece.
pub(super) const HELD: u32 = u32::MAX;
/// Largest part of a piece's momentum that drag takes in a step; more than 2 would swing, and a piece that turns about
/// an edge has up to some 4 times the part.
const MOST: f64 = 0.25;

/// Rigid motions (m) of the free pieces in a step.
#[derive(Default)]
pub(super) struct RigidMotions {
    pieces: Vec<(Vec<u32>, Inertia, RigidField)>,
}

/// Drag at a point between two pieces, or what is fixed.
pub(super) struct Drag {
    pub(super) pieces: [u32; 2],
    /// Slot of the point.
    pub(super) own: u32,
    pub(super) at: DVec3,
    /// Force (N) on the first.
    pub(super) force: DVec3,
    pub(super) normal: f64,
    /// Work (J) that it takes.
    pub(super) taken: f64,
    /// Slot of the disk opposite, and the foot there.
    pub(super) disk: (u32, [f64; 2]),
}

impl RigidMotions {
    pub(super) fn of(moved: &Moved<'_>) -> Self {
        let mut nodes: Vec<Vec<u32>> = Vec::new();
        for (node, &piece) in (0..).zip(moved.pieces) {
            if piece != HELD {
                let piece = piece as usize;
                nodes.resize_with(nodes.len().max(piece + 1), Vec::new);
                nodes[piece].push(node);
            }
        }
        let motion = |nodes: Vec<u32>| {
            let (masses, x) = (moved.masses, moved.positions);
            let momentum = |node: usize| moved.by[node] * masses[node];
            let inertia = Inertia::of(all(&nodes), masses, x);
            let field = inertia.motion(all(&nodes), masses, x, momentum);
            (nodes, inertia, field)
        };
        Self {
            pieces: nodes.into_iter().map(motion).collect(),
        }
    }

    pub(super) fn at(&self, piece: u32, x: DVec3) -> Option<DVec3> {
        let (_, _, field) = self.pieces.get(piece as usize)?;
        Some(field.at(x))
    }

    /// The part of all drag that a step bears.
    pub(super) fn share<'a>(&self, drags: impl Iterator<Item = &'a Drag>, most: f64) -> f64 {
        let mut normal = vec![0.0; self.pieces.len()];
        for drag in drags {
            for piece in drag.pieces {
                if let Some(sum) = normal.get_mut(piece as usize) {
                    *sum += drag.normal;
                }
            }
        }
        let bears = |((_, inertia, _), normal): (&(_, Inertia, _), &f64)| {
            MOST * inertia.mass / (most * normal).max(f64::MIN_POSITIVE)
        };
        self.pieces
            .iter()
            .zip(&normal)
            .map(bears)
            .fold(1.0, f64::min)
    }

    /// Adds forces of given sums and moments about the origin to the nodes of the pieces.
    pub(super) fn spread(
        &self,
        wrenches: &[(DVec3, DVec3)],
        moved: &Moved<'_>,
        forces: &mut [DVec3],
    ) {
        for ((nodes, inertia, _), &(force, moment)) in self.pieces.iter().zip(wrenches) {
            if force == DVec3::ZERO && moment == DVec3::ZERO {
                continue;
            }
            let field = inertia.field(force, moment - inertia.center.cross(force));
            for node in all(nodes) {
                forces[node] += field.at(moved.positions[node]) * moved.masses[node];
            }
        }
    }

    pub(super) fn len(&self) -> usize {
        self.pieces.len()
    }
}

impl DeformableContact {
    /// The free piece of a sample.
    pub(super) fn piece_of(&self, sample: u32, moved: &Moved<'_>) -> u32 {
        let first = self.disks.row(sample as usize).start;
        moved.pieces[self.disks.nodes[first] as usize]
    }
}
