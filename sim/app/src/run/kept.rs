//! A run's state: when it is kept, and how a run resumes from it.

use serde::{Deserialize, Serialize};

use super::movie::{Movie, MoviePlace};
use super::records::Records;
use super::{Run, RunError};
use crate::output::write_checkpoint;
use crate::picture::Painter;
use phyxel::{World, WorldError, WorldState};

/// Name of the checkpoint in a run's folder.
pub const CHECKPOINT: &str = "state.checkpoint";

/// What a run needs to resume, besides its scene.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RunState {
    world: WorldState,
    records: Records,
    movie: Option<MoviePlace>,
    frames: usize,
    course: Course,
}

/// What a run remembers of its path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Course {
    pub(super) rested: bool,
    pub(super) settling_steps: u64,
    pub(super) smallest_step: f64,
    /// Time (s) from which the next checkpoint is due.
    next_checkpoint: f64,
    /// Time (s) of the newest checkpoint.
    kept: Option<f64>,
}

impl Course {
    pub(super) fn new(world: &World) -> Self {
        Self {
            rested: true,
            settling_steps: 0,
            smallest_step: world.step_size(),
            next_checkpoint: world.scene().observe.checkpoint.unwrap_or(f64::INFINITY),
            kept: None,
        }
    }
}

impl RunState {
    /// The state of a world whose run has recorded nothing.
    #[must_use]
    pub fn of(world: &World) -> Self {
        Self {
            world: world.state(),
            records: Records::new(world),
            movie: None,
            frames: 0,
            course: Course::new(world),
        }
    }

    /// Brings a new world and its painter into this state; the rest of the run's.
    pub(super) fn restore(
        self,
        world: &mut World,
        mut painter: Option<&mut Painter>,
    ) -> Result<(Records, Option<MoviePlace>, Course), RunError> {
        let mut grown = Ok(());
        world.restore(self.world, |world, pieces| {
            if let (Ok(()), Some(painter)) = (&grown, &mut painter) {
                grown = painter.grow(world, pieces).map(drop);
            }
        })?;
        grown?;
        if let Some(painter) = painter {
            painter.set_frames(self.frames);
        }
        let mut course = self.course;
        let period = world.scene().observe.checkpoint;
        course.next_checkpoint = period.map_or(f64::INFINITY, |period| world.time() + period);
        Ok((self.records, self.movie, course))
    }
}

impl Run {
    /// Whether a checkpoint's time has come.
    pub(super) fn is_keeping_due(&self) -> bool {
        self.world.time() >= self.course.next_checkpoint
    }

    /// Writes the checkpoint over the one before.
    pub(super) fn keep(&mut self) -> Result<(), RunError> {
        // Who resumes from it finds the frames before.
        self.movie.as_mut().map_or(Ok(()), Movie::wait)?;
        let (scene, time) = (self.world.scene(), self.world.time());
        if let Some(period) = scene.observe.checkpoint {
            self.course.next_checkpoint = time + period;
        }
        self.course.kept = Some(time);
        let state = RunState {
            world: self.world.state(),
            records: self.records.clone(),
            movie: self.movie.as_ref().map(Movie::place),
            frames: self.painter.as_ref().map_or(0, Painter::frames),
            course: self.course,
        };
        Ok(write_checkpoint(&self.folder, CHECKPOINT, scene, &state)?)
    }

    /// A failed step as the user sees it: with the state to resume from, if there is one.
    pub(super) fn failure(&self, source: WorldError) -> RunError {
        match self.course.kept {
            Some(time) => RunError::Diverged {
                source: Box::new(source),
                time,
                advice: {
                    let integration = &self.world.scene().integration;
                    match integration.scheme.step() {
                        Some(step) => format!("integration.scheme.step={}", 0.5 * step),
                        None => {
                            let factor = 0.5 * integration.step_factor;
                            format!("integration.step_factor={factor}")
                        }
                    }
                },
                checkpoint: self.folder.path().join(CHECKPOINT),
            },
            None => RunError::World(source),
        }
    }
}
