//! One step of all bodies: each is moved, and those that touch get the forces of their contact once all are.

use std::time::{Duration, Instant};

use glam::DVec3;
use phyxel_integrate::{Applied, StepView};

use crate::deformable::DeformableBodies;
use crate::error::{WorldError, in_body};
use crate::phases::{Phase, Phases};
use crate::scene::Pose;
use crate::{Member, World};

/// Time in parts of a body's step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepTimes {
    pub(crate) forces: Duration,
    /// Contact with tools.
    pub(crate) tools: Duration,
    /// The steps of the bodies that it touches, and their contact.
    pub(crate) others: Duration,
}

/// Does some work and adds its time to a sum.
pub(crate) fn timed<T>(sum: &mut Duration, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *sum += start.elapsed();
    result
}

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
        for Member { body, contacts, .. } in &mut self.members {
            for contact in contacts {
                let tool = contact.tool;
                contact.rigid.lead(&from[tool], &to[tool], time, step);
            }
            if let (Some(grip), [.., from], [.., to]) = (&mut body.grip, from, to) {
                grip.lead(from.position, to.position, step);
            }
        }
        let (members, phases) = (&mut self.members, &mut self.phases);
        let Some(contact) = &mut self.deformable else {
            let mut members = members.iter_mut();
            return members.try_for_each(|member| member.advance(step, None, phases));
        };
        contact.begin_step(members);
        advance_together(members, 0, contact, step, phases)
    }
}

/// Takes a step (s) with all bodies from `first` on that touch each other: each is moved, then the next, and when the
/// last is, their contact is computed and each gets its forces.
fn advance_together(
    members: &mut [Member],
    first: usize,
    contact: &mut DeformableBodies,
    step: f64,
    phases: &mut Phases,
) -> Result<(), WorldError> {
    let Some((member, others)) = members.split_first_mut() else {
        phases.time(Phase::Contact, || contact.press(step));
        return Ok(());
    };
    let (mut result, mut inner) = (Ok(()), Phases::default());
    let hook = &mut |view: &StepView<'_>, forces: &mut [DVec3]| {
        contact.take(first, view);
        result = advance_together(others, first + 1, contact, step, &mut inner);
        contact.give(first, forces);
    };
    let own = member.advance(step, Some(hook), phases);
    phases.join(&inner);
    result.and(own)
}

impl Member {
    /// Takes a step (s) in which other bodies may act on this one.
    fn advance(
        &mut self,
        step: f64,
        others: Option<&mut Applied<'_>>,
        phases: &mut Phases,
    ) -> Result<(), WorldError> {
        in_body(self.hand_over(), &self.body.name)?;
        let body = &mut self.body;
        body.times = StepTimes::default();
        let start = Instant::now();
        let decay = in_body(body.decay(step), &body.name)?;
        let result = body.advance(step, &mut self.contacts, others);
        if let (Some(cutting), Some(half)) = (&mut self.cutting, decay) {
            cutting.add_decay(body.book_decay(half));
        }
        let times = body.times;
        let inner = times.forces + times.tools + times.others;
        phases.add(Phase::Forces, times.forces);
        phases.add(Phase::Integration, start.elapsed().saturating_sub(inner));
        if !self.contacts.is_empty() {
            phases.add(Phase::Contact, times.tools);
        }
        in_body(result, &body.name)
    }
}
