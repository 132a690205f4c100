//! How steps are taken, by the scheme that a scene asks for.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use glam::DVec3;
use phyxel_elastic::Elastic;
use phyxel_integrate::{Applied, ForceLaw, Grip, Implicit, Motion, MotionError, StepView};

use crate::error::BodyProblem;
use crate::scene::Scheme;
use crate::shares::BodyShares;
use crate::tool::ToolContact;

/// What acts on a body from outside: tools, a hand, and whatever comes after them.
pub(crate) type Acting<'a, 'b> = (
    &'a mut [ToolContact],
    Option<&'a mut Grip>,
    Option<&'a mut Applied<'b>>,
);

/// What takes a body's steps: the solver and the step (s) of an implicit scheme, if it is one.
#[derive(Debug, Clone)]
pub(crate) struct Stepper(Option<(Box<Implicit>, f64)>);

impl Stepper {
    pub(crate) fn new(scheme: Scheme) -> Result<Self, MotionError> {
        let solver = scheme.implicit().map(Implicit::new).transpose()?;
        Ok(Self(solver.map(Box::new).zip(scheme.step())))
    }

    /// Step (s) of an implicit scheme.
    pub(crate) fn step(&self) -> Option<f64> {
        self.0.as_ref().map(|(_, step)| *step)
    }

    /// Takes one step of `step` (s), where the shares of a body are if it has any.
    pub(crate) fn step_with(
        &mut self,
        step: f64,
        motion: &mut Motion,
        law: &mut Timed<'_>,
        shares: Option<&Mutex<dyn BodyShares>>,
        (contacts, mut grip, mut others): Acting<'_, '_>,
        in_contact: &mut Duration,
    ) -> Result<(), BodyProblem> {
        if let Some((solver, _)) = &mut self.0 {
            let mut tools: Vec<_> = contacts
                .iter_mut()
                .map(|contact| &mut contact.rigid)
                .collect();
            solver.step_with(motion, step, law, &mut tools)?;
            return Ok(());
        }
        let is_free = contacts.is_empty() && grip.is_none() && others.is_none();
        let press = &mut |view: &StepView<'_>, forces: &mut [DVec3]| {
            for contact in contacts.iter_mut() {
                contact.press(view, forces, in_contact);
            }
            if let Some(grip) = &mut grip {
                grip.pull(view, forces);
            }
            if let Some(others) = &mut others {
                others(view, forces);
            }
        };
        let forces = |x: &[DVec3], f: &mut [DVec3]| law.forces_into(x, f);
        match shares {
            Some(shares) => {
                let shares = &mut *shares.lock().unwrap_or_else(PoisonError::into_inner);
                motion.step_shared(step, shares, if is_free { None } else { Some(press) })?;
            }
            None if is_free => motion.step(step, forces)?,
            None => motion.step_with(step, forces, press)?,
        }
        Ok(())
    }
}

/// A body's forces with the time that they take.
pub(crate) struct Timed<'a> {
    pub(crate) elastic: &'a mut Elastic,
    pub(crate) in_forces: &'a mut Duration,
}

impl ForceLaw for Timed<'_> {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        let start = Instant::now();
        let energy = self.elastic.forces_into(positions, forces);
        *self.in_forces += start.elapsed();
        energy
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        let start = Instant::now();
        self.elastic.tangent_product_into(vector, product);
        *self.in_forces += start.elapsed();
    }
}
