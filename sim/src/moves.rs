//! One step of all bodies: each is moved, and those that touch get the forces of their contact once all are.

use std::time::Instant;

use glam::DVec3;
use phyxel_elastic::PARALLEL_NODES;
use phyxel_integrate::{Applied, StepView, awake};

use crate::deformable::DeformableBodies;
use crate::error::{WorldError, in_body};
use crate::phases::{Phase, Phases, StepTimes};
use crate::scene::Pose;
use crate::{Body, World};

impl World {
    /// Takes one step (s) with tools that move between two positions.
    pub(crate) fn advance(
        &mut self,
        step: f64,
        from: &[Pose],
        to: &[Pose],
    ) -> Result<(), WorldError> {
        self.load_gravity(step)?;
        let time = self.time();
        for body in &mut self.bodies {
            for contact in &mut body.contacts {
                let tool = contact.tool;
                contact.rigid.lead(&from[tool], &to[tool], time, step);
            }
            if let (Some(grip), [.., from], [.., to]) = (&mut body.grip, from, to) {
                grip.lead(from.position, to.position, step);
            }
        }
        let (bodies, phases) = (&mut self.bodies, &mut self.phases);
        // Passes over the nodes of a shared body are not taken here.
        let here = bodies.iter().filter(|body| !body.whole.is_shared());
        let largest = here.map(|body| body.rest.len()).max();
        let gravity = self.scene.gravity.map_or(DVec3::ZERO, |g| g.acceleration);
        let contact = self.deformable.as_mut();
        let work = || {
            let Some(contact) = contact else {
                let mut bodies = bodies.iter_mut();
                return bodies.try_for_each(|body| body.step(step, None, phases));
            };
            contact.begin_step(bodies, gravity.length());
            advance_together(bodies, 0, contact, step, phases)
        };
        if largest.unwrap_or(0) < PARALLEL_NODES {
            work()
        } else {
            awake(work)
        }
    }
}

/// Takes a step (s) with all bodies from `first` on that touch each other: each is moved, then the next, and when the
/// last is, their contact is computed and each gets its forces.
fn advance_together(
    bodies: &mut [Body],
    first: usize,
    contact: &mut DeformableBodies,
    step: f64,
    phases: &mut Phases,
) -> Result<(), WorldError> {
    let Some((body, others)) = bodies.split_first_mut() else {
        phases.time(Phase::Contact, || contact.press(step));
        return Ok(());
    };
    let (mut result, mut inner) = (Ok(()), Phases::default());
    let hook = &mut |view: &StepView<'_>, forces: &mut [DVec3]| {
        contact.take(first, view);
        result = advance_together(others, first + 1, contact, step, &mut inner);
        contact.give(first, forces);
    };
    let own = body.step(step, Some(hook), phases);
    phases.join(&inner);
    result.and(own)
}

impl Body {
    /// Takes a step (s) in which other bodies may act on this one.
    fn step(
        &mut self,
        step: f64,
        others: Option<&mut Applied<'_>>,
        phases: &mut Phases,
    ) -> Result<(), WorldError> {
        self.times = StepTimes::default();
        let start = Instant::now();
        let decay = in_body(self.decay(step), &self.name)?;
        let result = self.advance(step, others);
        if let Some(half) = decay {
            self.book_decay(half);
        }
        let times = self.times;
        let inner = times.forces + times.tools + times.others;
        phases.add(Phase::Forces, times.forces);
        phases.add(Phase::Integration, start.elapsed().saturating_sub(inner));
        if !self.contacts.is_empty() {
            phases.add(Phase::Contact, times.tools);
        }
        in_body(result, &self.name)
    }
}
