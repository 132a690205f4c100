//! A rigid tool that moves along a path or under forces, and presses.

use crate::contact::{Contact, ContactForce};
use crate::path::Path;
use crate::shape::{Pose, Shape};
use glam::DVec3;

/// What moves a tool. Its orientation stays.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Drive {
    /// Displacement-driven: `origin` plus the path's displacement.
    Path {
        /// Position (m) that the path's displacement is added to.
        origin: DVec3,
        /// Displacement over time.
        path: Path,
    },
    /// Force-driven: a mass under a constant force (its weight, a hand) and the contact's.
    Force {
        /// Mass (kg), positive.
        mass: f64,
        /// Force (N), weight included.
        force: DVec3,
        /// Mass-proportional damping (1/s).
        damping: f64,
    },
}

/// A rigid tool. Clone it to save its state.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tool {
    /// Shape.
    pub shape: Shape,
    /// Where it is.
    pub pose: Pose,
    /// Velocity (m/s).
    pub velocity: DVec3,
    /// What moves it.
    pub drive: Drive,
    /// Forces of the contact at the end of the last step.
    pub contact: ContactForce,
    /// Work (J) of the contact on the tool so far.
    pub contact_work: f64,
    /// Work (J) of a force-driven tool's own force so far.
    pub load_work: f64,
    /// Energy (J) that a force-driven tool's damping took so far.
    pub dissipated: f64,
}

impl Tool {
    /// A tool at rest.
    #[must_use]
    pub fn new(shape: Shape, pose: Pose, drive: Drive) -> Self {
        Self {
            shape,
            pose,
            velocity: DVec3::ZERO,
            drive,
            contact: ContactForce::default(),
            contact_work: 0.0,
            load_work: 0.0,
            dissipated: 0.0,
        }
    }

    /// Kinetic energy (J) of a force-driven tool, 0 for one on a path.
    #[must_use]
    pub fn kinetic(&self) -> f64 {
        match self.drive {
            Drive::Force { mass, .. } => 0.5 * mass * self.velocity.length_squared(),
            Drive::Path { .. } => 0.0,
        }
    }

    /// Moves the tool to `time` (s), the end of a step of `step` (s), and adds the contact's forces on
    /// the body's nodes there to `forces`: what [`crate::Motion::step_with`] wants from its closure.
    ///
    /// A force-driven tool takes the same velocity Verlet step as the body, damping included, so that
    /// the momentum of both together is kept.
    ///
    /// # Panics
    /// If slices are shorter than the surface's nodes require.
    pub fn press(
        &mut self,
        contact: &mut Contact,
        time: f64,
        step: f64,
        positions: &[DVec3],
        forces: &mut [DVec3],
    ) {
        let before = self.pose.position;
        let old = self.contact.force;
        match &self.drive {
            Drive::Path { origin, path } => {
                let (displacement, velocity) = path.at(time);
                self.pose.position = *origin + displacement;
                self.velocity = velocity;
            }
            Drive::Force {
                mass,
                force,
                damping,
            } => {
                self.dissipated += decay(&mut self.velocity, *mass, *damping, step);
                self.velocity += (*force + old) * (0.5 * step / mass);
                self.pose.position += self.velocity * step;
            }
        }
        let mut sum = contact.add_forces(&self.shape, &self.pose, positions, forces);
        contact.add_friction(&self.pose, forces, &mut sum);
        self.contact = sum;
        let moved = self.pose.position - before;
        self.contact_work += 0.5 * (old + sum.force).dot(moved);
        if let Drive::Force {
            mass,
            force,
            damping,
        } = &self.drive
        {
            self.load_work += force.dot(moved);
            self.velocity += (*force + sum.force) * (0.5 * step / mass);
            self.dissipated += decay(&mut self.velocity, *mass, *damping, step);
        }
    }
}

/// Half a step of damping; returns the energy taken.
fn decay(velocity: &mut DVec3, mass: f64, damping: f64, step: f64) -> f64 {
    let before = 0.5 * mass * velocity.length_squared();
    *velocity *= (-0.5 * damping * step).exp();
    before - 0.5 * mass * velocity.length_squared()
}
