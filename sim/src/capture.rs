//! Edges of blades, captured as the clock passes them: when, in which bodies, all or none.

use std::sync::Arc;
use std::time::Instant;

use crate::scene;
use glam::DVec3;

use crate::cutting::{CapturedEdge, CutUpdate};
use crate::error::WorldError;
use crate::input::StrokePhase;
use crate::member::{Capture, Member};
use crate::phases::Phase;
use crate::{CutPiece, World};

impl World {
    /// Captures the edges of all blades that are due, each in all bodies or in none.
    pub(crate) fn capture_blades(&mut self, step: u64) -> Result<(), WorldError> {
        let time = self.scene_time();
        let mut first = true;
        while let Some((index, phase, edge)) = self.input.next_blade(&self.scene, step, time) {
            if std::mem::take(&mut first) {
                self.end_stretch()?;
            }
            let begun = Instant::now();
            let captures = self.capture(index, phase, &edge)?;
            self.input.end_blade(step, index, phase, edge);
            let mut changed = false;
            for (place, capture) in captures {
                let member = &mut self.members[place];
                let applied = member.apply(index, capture, phase);
                let (update, sweep) = applied.map_err(|problem| problem.of(&member.body))?;
                changed |= !update.touched.is_empty();
                self.captured.push(Arc::new(CapturedEdge {
                    steps: member.body.motion.steps(),
                    member: place,
                    cut: index,
                    phase,
                    sweep,
                }));
                take_note(
                    &mut self.cut_through,
                    &mut self.new_pieces,
                    (index, place),
                    update,
                );
            }
            self.phases.add(Phase::Cut, begun.elapsed());
            if changed {
                self.waiting.get_or_insert(begun);
                self.step = self.smallest_step_size();
                self.forget_kept();
            }
        }
        Ok(())
    }

    /// How many edges of a cut the scene's path captures.
    #[must_use]
    pub fn capture_count(&self, cut: &scene::Cut) -> usize {
        cut.capture_times(finest_spacing(cut, &self.members)).len()
    }

    /// Computes what a blade's edge does to each body that its cut is of. If that fails in one, all are as before.
    fn capture(
        &mut self,
        index: usize,
        phase: StrokePhase,
        edge: &[DVec3],
    ) -> Result<Vec<(usize, Capture)>, WorldError> {
        let cut = &self.scene.cuts[index];
        let mut captures = Vec::new();
        for place in 0..self.members.len() {
            let member = &mut self.members[place];
            let name = &member.body.name;
            if cut.body.as_ref().is_some_and(|body| body != name) {
                continue;
            }
            match member.capture(index, cut, edge, phase) {
                Ok(capture) => captures.push((place, capture)),
                Err(problem) => {
                    let error = problem.of(&member.body);
                    for (place, capture) in captures {
                        self.members[place].take_back(capture);
                    }
                    return Err(error);
                }
            }
        }
        Ok(captures)
    }
}

/// What drawing and counting need to know of an update, of a cut in a member.
pub(crate) fn take_note(
    cut_through: &mut [bool],
    pieces: &mut Vec<CutPiece>,
    (cut, member): (usize, usize),
    update: CutUpdate,
) {
    cut_through[cut] |= !update.touched.is_empty();
    if !update.triangles.is_empty() {
        pieces.push(CutPiece {
            member,
            triangles: update.triangles,
        });
    }
}

/// Smallest mean distance (m) of neighbouring nodes of the bodies that a cut is of.
fn finest_spacing(cut: &scene::Cut, members: &[Member]) -> f64 {
    let bodies = members.iter().map(|member| &member.body);
    let bodies = bodies.filter(|body| cut.body.as_ref().is_none_or(|name| *name == body.name));
    bodies
        .map(|body| body.spacing)
        .fold(f64::INFINITY, f64::min)
}

/// When a cut is captured (s).
pub(crate) fn capture_times(cut: &scene::Cut, members: &[Member]) -> Result<Vec<f64>, WorldError> {
    let spacing = finest_spacing(cut, members);
    if let scene::Capture::Spacing(share) = cut.capture {
        let distance = share * spacing;
        let count = cut.way() / distance;
        if count > scene::Capture::MOST {
            let cut = cut.name.clone();
            return Err(WorldError::TooManyCaptures {
                cut,
                share,
                distance,
                count,
            });
        }
    }
    Ok(cut.capture_times(spacing))
}
