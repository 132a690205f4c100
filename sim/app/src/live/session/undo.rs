//! Going back: what a session was before each of the last strokes.

use std::collections::VecDeque;

use phyxel::{Action, CutPiece, World, WorldState};
use phyxel_splat::{DrawnTissue, SurfaceChange};

use super::lead::PoseLead;
use super::record::Recording;
use super::{Session, SessionError};
use crate::picture::Painter;

/// Strokes that can be undone, and what is kept of them together. The newest is kept whatever it takes.
const MOST: usize = 24;
const MOST_BYTES: usize = 512 << 20;
/// Bytes of a state for each node: checkpoints have 300 (99,413 nodes) to 770 (the liver with contact).
const NODE_BYTES: usize = 800;

/// Surfaces of a state to go back to.
#[derive(Debug, Clone)]
enum Surfaces {
    Whole(Vec<DrawnTissue>),
    /// What was other than in the next newer state.
    Changed(Vec<SurfaceChange>),
}

/// What a session was, but for its world as it was built: going back makes the cuts of then again, bit for bit.
/// Surfaces, which take longer to grow, are kept: those of the newest, of others what is not so in the next newer.
#[derive(Debug, Clone)]
pub(super) struct Before {
    pub(super) world: WorldState,
    nodes: usize,
    surfaces: Surfaces,
    /// Pieces of cuts that surfaces lag behind by.
    lagging: VecDeque<CutPiece>,
    /// Inputs recorded before.
    recorded: usize,
    leads: Vec<PoseLead>,
    strokes: usize,
}

impl Before {
    /// Of a session that begins.
    pub(super) fn start(world: &World, painter: &Painter, leads: &[PoseLead]) -> Self {
        Self {
            world: world.state(),
            nodes: world.bodies().iter().map(|body| body.rest.len()).sum(),
            surfaces: Surfaces::Whole(painter.surfaces()),
            lagging: VecDeque::new(),
            recorded: 0,
            leads: leads.to_vec(),
            strokes: 0,
        }
    }

    fn bytes(&self) -> usize {
        NODE_BYTES * self.nodes
            + match &self.surfaces {
                Surfaces::Whole(all) => all.iter().map(DrawnTissue::bytes).sum::<usize>(),
                Surfaces::Changed(all) => all.iter().map(SurfaceChange::bytes).sum(),
            }
    }

    /// Keeps of its surfaces what is other than in a newer state.
    fn shrink(&mut self, newer: &Self) {
        if let (Surfaces::Whole(own), Surfaces::Whole(newer)) =
            (&mut self.surfaces, &newer.surfaces)
        {
            let pairs = std::mem::take(own).into_iter().zip(newer);
            let changes = pairs.map(|(own, newer)| SurfaceChange::new(own, newer));
            self.surfaces = Surfaces::Changed(changes.collect());
        }
    }

    /// Makes its surfaces whole, of those of the newer state that it shrank by.
    fn complete(&mut self, newer: &[DrawnTissue]) {
        if let Surfaces::Changed(own) = &mut self.surfaces {
            let pairs = std::mem::take(own).into_iter().zip(newer);
            let whole = pairs.map(|(own, newer)| own.undone(newer));
            self.surfaces = Surfaces::Whole(whole.collect());
        }
    }
}

/// How many states are kept, of their bytes from the newest on.
fn fitting(newest_first: impl Iterator<Item = usize>) -> usize {
    let sums = newest_first.scan(0, |sum, bytes| {
        *sum += bytes;
        Some(*sum)
    });
    let fitting = sums.take(MOST).take_while(|sum| *sum <= MOST_BYTES);
    fitting.count().max(1)
}

impl Session {
    /// What is kept of a session between two steps.
    pub(super) fn before(&mut self) -> Before {
        self.lagging.extend(self.world.take_new_pieces());
        Before {
            world: self.world.state(),
            surfaces: Surfaces::Whole(self.painter.surfaces()),
            lagging: self.lagging.clone(),
            recorded: self.record.len(),
            leads: self.leads.clone(),
            strokes: self.strokes,
            ..self.start
        }
    }

    /// Keeps what was before a stroke; the oldest give way.
    pub(super) fn remember(&mut self, before: Before) {
        if let Some(older) = self.befores.back_mut() {
            older.shrink(&before);
        }
        self.befores.push_back(before);
        let kept = fitting(self.befores.iter().rev().map(Before::bytes));
        self.befores.drain(..self.befores.len() - kept);
    }

    /// Takes the newest state before a stroke.
    fn last(&mut self) -> Option<Before> {
        let last = self.befores.pop_back()?;
        if let (Surfaces::Whole(surfaces), Some(older)) = (&last.surfaces, self.befores.back_mut())
        {
            older.complete(surfaces);
        }
        Some(last)
    }

    /// Goes back to before the last stroke; `false` if there is none, or it is too long ago. It takes as long as all cuts
    /// before took to be made.
    ///
    /// # Errors
    /// [`SessionError`] if these cannot be made again, which only a bug does; the session is then as it was.
    pub fn undo(&mut self) -> Result<bool, SessionError> {
        // Who undoes goes another way than the recording.
        self.replay = Recording::default();
        let Some(before) = self.last() else {
            return Ok(false);
        };
        let world = self.made_again(&before)?;
        self.take_up(world, before);
        Ok(true)
    }

    /// Goes back to the start: after settling, or to its beginning while it lasts or where users did something in it.
    pub fn reset(&mut self) {
        self.befores.clear();
        let start = self.start.clone();
        let world = self.made_again(&start);
        self.take_up(world.unwrap_or_else(|_| self.built.clone()), start);
    }

    /// Goes back to the newest good state, after a step was lost.
    pub fn recover(&mut self) {
        while let Some(before) = self.last() {
            if let Ok(world) = self.made_again(&before) {
                return self.take_up(world, before);
            }
        }
        self.reset();
    }

    /// The world of then.
    fn made_again(&self, before: &Before) -> Result<World, SessionError> {
        let mut world = self.built.clone();
        world.restore(before.world.clone(), |_, _| ())?;
        Ok(world)
    }

    /// Goes on from there.
    fn take_up(&mut self, world: World, before: Before) {
        self.world = world;
        if let Surfaces::Whole(surfaces) = before.surfaces {
            self.painter.set_surfaces(surfaces);
        }
        self.lagging = before.lagging;
        self.record.truncate(before.recorded);
        self.leads = before.leads;
        self.strokes = before.strokes;
        self.stroke.clear();
        self.pending.clear();
        // Who gripped then holds no more.
        self.hand = None;
        if self.world.grip_force().is_some() {
            self.pending.push(Action::LetGo);
        }
        self.forces.restart(self.world.time());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_states_stay() {
        let mib = |sizes: &[usize]| fitting(sizes.iter().map(|size| size << 20));
        assert_eq!(mib(&[1; 30]), MOST);
        assert_eq!([mib(&[511, 1, 1]), mib(&[100; 24])], [2, 5]);
        assert_eq!(mib(&[600, 1]), 1, "whatever it takes");
    }
}
