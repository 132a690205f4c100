//! What goes between rank 0 and the others besides steps, counted.

use std::time::{Duration, Instant};

/// What went to or from other ranks.
#[derive(Debug, Default, Clone, Copy)]
pub(crate) struct Traffic {
    /// How often, in how much time, and bytes in all.
    pub(crate) times: u32,
    pub(crate) spent: Duration,
    pub(crate) bytes: usize,
}

/// Places in a list of all kinds: models, changes of them and states that were given, states that came.
pub(crate) const MODELS: usize = 0;
pub(crate) const CHANGES: usize = 1;
pub(crate) const STATES: usize = 2;
pub(crate) const FETCHED: usize = 3;

impl Traffic {
    pub(crate) const KINDS: usize = 4;

    /// Counts what began then.
    pub(crate) fn add(&mut self, begun: Instant) {
        self.times += 1;
        self.spent += begun.elapsed();
    }
}
