//! One step of all bodies: each is moved, and those that touch get the forces of their contact once all are.

use std::cell::Cell;
use std::time::{Duration, Instant};

use glam::DVec3;
use phyxel_integrate::{Applied, StepView};

use crate::deformable::DeformableBodies;
use crate::error::{WorldError, in_body};
use crate::phases::{Phase, Phases};
use crate::scene::Pose;
use crate::{Member, World};

impl World {
    /// Takes one step (s) with tools that move between two positions.
    pub(crate) fn advance(
        &mut self,
        step: f64,
        from: &[Pose],
        to: &[Pose],
    ) -> Result<(), WorldError> {
        self.load_gravity(step)?;
        let moves = Moves {
            step,
            time: self.time(),
            from,
            to,
        };
        if let Some(contact) = &mut self.deformable {
            contact.begin_step(&self.members);
            return moves.advance_together(&mut self.members, 0, contact, &mut self.phases);
        }
        for member in &mut self.members {
            moves.advance(member, None, &mut self.phases)?;
        }
        Ok(())
    }
}

/// One step of all bodies: its length and its begin (s), and where tools are at its begin and end.
#[derive(Clone, Copy)]
struct Moves<'a> {
    step: f64,
    time: f64,
    from: &'a [Pose],
    to: &'a [Pose],
}

impl Moves<'_> {
    /// Takes the step with one body, on which others may act.
    fn advance(
        &self,
        member: &mut Member,
        others: Option<(&mut Applied<'_>, &Cell<Duration>)>,
        phases: &mut Phases,
    ) -> Result<(), WorldError> {
        let (step, from, to) = (self.step, self.from, self.to);
        in_body(member.hand_over(), &member.body.name)?;
        let Member {
            body,
            cutting,
            contacts,
        } = member;
        for contact in contacts.iter_mut() {
            let tool = contact.tool;
            contact.rigid.lead(&from[tool], &to[tool], self.time, step);
        }
        if let (Some(grip), [.., from], [.., to]) = (&mut body.grip, from, to) {
            grip.lead(from.position, to.position, step);
        }
        let (mut in_forces, mut in_contact) = (Duration::ZERO, Duration::ZERO);
        let start = Instant::now();
        let decay = body.decay(step, &mut in_forces);
        let decay = in_body(decay, &body.name)?;
        let (others, in_others) = others.unzip();
        let acting = (&mut contacts[..], others);
        let result = body.advance(step, acting, &mut in_forces, &mut in_contact);
        if let (Some(cutting), Some(half)) = (cutting, decay) {
            cutting.add_decay(body.book_decay(half));
        }
        let in_others = in_others.map_or(Duration::ZERO, Cell::get);
        let rest = (start.elapsed()).saturating_sub(in_forces + in_contact + in_others);
        phases.add(Phase::Forces, in_forces);
        phases.add(Phase::Integration, rest);
        if !contacts.is_empty() {
            phases.add(Phase::Contact, in_contact);
        }
        in_body(result, &body.name)
    }

    /// Takes the step with all bodies from `first` on that touch each other: each is moved, then the next, and when the
    /// last is, their contact is computed and each gets its forces.
    fn advance_together(
        &self,
        members: &mut [Member],
        first: usize,
        contact: &mut DeformableBodies,
        phases: &mut Phases,
    ) -> Result<(), WorldError> {
        let Some((member, others)) = members.split_first_mut() else {
            phases.time(Phase::Contact, || contact.press(self.step));
            return Ok(());
        };
        let (mut result, spent, mut inner) = (Ok(()), Cell::default(), Phases::default());
        let hook = &mut |view: &StepView<'_>, forces: &mut [DVec3]| {
            let start = Instant::now();
            contact.take(first, view);
            result = self.advance_together(others, first + 1, contact, &mut inner);
            contact.give(first, forces);
            spent.set(start.elapsed());
        };
        let own = self.advance(member, Some((hook, &spent)), phases);
        phases.join(&inner);
        result.and(own)
    }
}
