//! Places to go back to.

use std::collections::VecDeque;

use super::hands::PoseLead;
use crate::picture::Surfaces;
use crate::world::{CutPiece, World};

/// Strokes that can be undone, and what they may take together: a copy of a liver of 6,000 nodes and 30,000
/// surfels has some 20 MB. The newest is kept whatever it takes.
const MOST: usize = 16;
const MOST_BYTES: usize = 256 << 20;

/// A session between two steps: copies, so that going back takes as long after a hundred strokes as after
/// one, and gives the same bits.
#[derive(Debug, Clone)]
pub(super) struct Checkpoint {
    pub(super) world: World,
    pub(super) surfaces: Surfaces,
    /// Pieces of cuts that surfaces lag behind by.
    pub(super) lagging: VecDeque<CutPiece>,
    /// Inputs recorded before.
    pub(super) recorded: usize,
    pub(super) leads: Vec<PoseLead>,
    pub(super) strokes: usize,
}

impl Checkpoint {
    fn bytes(&self) -> usize {
        let parts = self.world.parts();
        let model: usize = parts.iter().map(|part| part.bytes).sum();
        model + self.surfaces.bytes()
    }
}

/// The start, and the state before each of the last strokes.
#[derive(Debug, Default)]
pub(super) struct Ring {
    start: Option<Checkpoint>,
    strokes: VecDeque<Checkpoint>,
}

impl Ring {
    /// Sets the state that a reset brings back.
    pub(super) fn set_start(&mut self, checkpoint: Checkpoint) {
        self.start = Some(checkpoint);
    }

    /// Adds the state before a stroke; the oldest give way.
    pub(super) fn push(&mut self, checkpoint: Checkpoint) {
        self.strokes.push_back(checkpoint);
        let sizes = self.strokes.iter().map(Checkpoint::bytes);
        let mut bytes: usize = sizes.sum();
        while self.strokes.len() > MOST || (self.strokes.len() > 1 && bytes > MOST_BYTES) {
            let oldest = self.strokes.pop_front();
            bytes -= oldest.map_or(0, |oldest| oldest.bytes());
        }
    }

    /// How many strokes can be undone.
    pub(super) fn len(&self) -> usize {
        self.strokes.len()
    }

    /// Takes the newest state before a stroke.
    pub(super) fn pop(&mut self) -> Option<Checkpoint> {
        self.strokes.pop_back()
    }

    /// The start; no stroke can be undone from there.
    pub(super) fn reset(&mut self) -> Option<Checkpoint> {
        self.strokes.clear();
        self.start.clone()
    }

    /// The newest state that was good: before the last stroke, or the start.
    pub(super) fn last_good(&mut self) -> Option<Checkpoint> {
        self.pop().or_else(|| self.start.clone())
    }
}
