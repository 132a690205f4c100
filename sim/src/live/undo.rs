//! Places to go back to.

use std::collections::VecDeque;

use crate::world::WorldState;

use super::hands::PoseLead;

/// Strokes that can be undone. One is about 1 MB for a liver of 6,000 nodes.
const MOST: usize = 16;

/// A session between two steps.
#[derive(Debug, Clone)]
pub(super) struct Checkpoint {
    pub(super) world: WorldState,
    /// Inputs recorded before.
    pub(super) recorded: usize,
    pub(super) leads: Vec<PoseLead>,
    pub(super) strokes: usize,
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

    /// Adds the state before a stroke; the oldest gives way.
    pub(super) fn push(&mut self, checkpoint: Checkpoint) {
        if self.strokes.len() == MOST {
            self.strokes.pop_front();
        }
        self.strokes.push_back(checkpoint);
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
