//! One step of all bodies: each is moved, and those that touch get the forces of their contact once all are.

use std::time::{Duration, Instant};

use glam::DVec3;
use phyxel_elastic::PARALLEL_NODES;
use phyxel_integrate::{StepView, awake};

use crate::deformable::DeformableBodies;
use crate::error::{WorldError, in_body};
use crate::phases::{Phase, StepTimes, timed};
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
            body.times = StepTimes::default();
            for contact in &mut body.contacts {
                let tool = contact.tool;
                contact.rigid.lead(&from[tool], &to[tool], time, step);
            }
            if let (Some(grip), [.., from], [.., to]) = (&mut body.grip, from, to) {
                grip.lead(from.position, to.position, step);
            }
        }
        let start = Instant::now();
        let bodies = &mut self.bodies;
        // Passes over the nodes of a shared body are not taken here.
        let here = bodies.iter().filter(|body| !body.whole.is_shared());
        let largest = here.map(|body| body.rest.len()).max();
        let gravity = self.scene.gravity.map_or(DVec3::ZERO, |g| g.acceleration);
        let (contact, mut pressing) = (self.deformable.as_mut(), Duration::ZERO);
        let touches = contact.is_some() || bodies.iter().any(|body| !body.contacts.is_empty());
        let work = || {
            let Some(contact) = contact else {
                let mut bodies = bodies.iter_mut();
                return bodies.try_for_each(|body| in_body(body.step(step, None), &body.name));
            };
            contact.begin_step(bodies, gravity.length());
            advance_together(bodies, 0, contact, step, &mut pressing)
        };
        let result = if largest.unwrap_or(0) < PARALLEL_NODES {
            work()
        } else {
            awake(work)
        };
        let (mut forces, mut tools) = (Duration::ZERO, pressing);
        for body in &self.bodies {
            forces += body.times.forces;
            tools += body.times.tools;
        }
        let others = start.elapsed().saturating_sub(forces + tools);
        self.phases.add(Phase::Forces, forces);
        self.phases.add(Phase::Integration, others);
        if touches {
            self.phases.add(Phase::Contact, tools);
        }
        result
    }
}

/// Takes a step (s) with all bodies from `first` on that touch each other: each is moved, then the next, and when the
/// last is, their contact is computed and each gets its forces. The time that takes is added to `pressing`.
fn advance_together(
    bodies: &mut [Body],
    first: usize,
    contact: &mut DeformableBodies,
    step: f64,
    pressing: &mut Duration,
) -> Result<(), WorldError> {
    let Some((body, others)) = bodies.split_first_mut() else {
        timed(pressing, || contact.press(step));
        return Ok(());
    };
    let mut result = Ok(());
    let hook = &mut |view: &StepView<'_>, forces: &mut [DVec3]| {
        contact.take(first, view);
        result = advance_together(others, first + 1, contact, step, pressing);
        if result.is_ok() {
            contact.give(first, forces);
        }
    };
    let own = body.step(step, Some(hook));
    result.and(in_body(own, &body.name))
}
