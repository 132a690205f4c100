//! A rigid tool that moves along a path or under forces, and presses.

use crate::contact::{Contact, ContactForce};
use crate::rigid_path::RigidPath;
use crate::shape::{Pose, RigidShape};
use crate::view::StepView;
use glam::DVec3;

/// What moves a tool.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Drive {
    /// Displacement-driven.
    Path {
        /// Pose that the path displaces, and turns about the shape's origin.
        origin: Pose,
        /// Displacement and rotation over time.
        path: RigidPath,
    },
    /// Force-driven: a mass under a constant force (its weight, a hand) and the contact's. It does not
    /// turn: the hand takes the torque.
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
///
/// After each step `contact` holds the force and torque on it; keep them over time for a record.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RigidTool {
    /// Shape.
    pub shape: RigidShape,
    /// Where it is.
    pub pose: Pose,
    /// Velocity (m/s).
    pub velocity: DVec3,
    /// Angular velocity (rad/s), world axes.
    pub angular_velocity: DVec3,
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

impl RigidTool {
    /// A tool at rest.
    #[must_use]
    pub fn new(shape: RigidShape, pose: Pose, drive: Drive) -> Self {
        Self {
            shape,
            pose,
            velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
            drive,
            contact: ContactForce::default(),
            contact_work: 0.0,
            load_work: 0.0,
            dissipated: 0.0,
        }
    }

    /// A tool on a path from `origin`.
    #[must_use]
    pub fn on_path(shape: RigidShape, origin: Pose, path: impl Into<RigidPath>) -> Self {
        let path = path.into();
        let drive = Drive::Path { origin, path };
        Self::new(shape, origin, drive)
    }

    /// Kinetic energy (J) of a force-driven tool, 0 for one on a path.
    #[must_use]
    pub fn kinetic(&self) -> f64 {
        match self.drive {
            Drive::Force { mass, .. } => 0.5 * mass * self.velocity.length_squared(),
            Drive::Path { .. } => 0.0,
        }
    }

    /// Pose at a time (s) of a tool on a path; `None` under forces.
    #[must_use]
    pub fn pose_at(&self, time: f64) -> Option<Pose> {
        match &self.drive {
            Drive::Path { origin, path } => Some(path.pose(origin, time)),
            Drive::Force { .. } => None,
        }
    }

    /// Moves the tool to the end of an explicit step and adds the contact's forces on the body's nodes
    /// to `forces`: what [`crate::Motion::step_with`] wants from its closure. The contact's settings
    /// say where the forces are taken.
    ///
    /// A force-driven tool takes the same velocity Verlet step as the body, damping included, so that
    /// the momentum of both together is kept.
    ///
    /// # Panics
    /// If slices are shorter than the surface's nodes require.
    pub fn press(&mut self, contact: &mut Contact, view: &StepView<'_>, forces: &mut [DVec3]) {
        let before = self.pose;
        let (time, step) = (view.time, view.step);
        let half = 0.5 * step;
        if let Drive::Force {
            mass,
            force,
            damping,
        } = self.drive
        {
            self.dissipated += decay(&mut self.velocity, mass, damping, step);
            self.velocity += (force + self.contact.force) * (half / mass);
            self.pose.position += self.velocity * step;
        } else {
            self.follow(time);
        }
        let sum = if contact.settings().implicit {
            let (middle, mass) = match self.drive {
                Drive::Force { mass, force, .. } => {
                    let moved = (self.velocity + force * (step / mass)) * half;
                    let position = self.pose.position + moved;
                    (
                        Some(Pose {
                            position,
                            ..self.pose
                        }),
                        Some(mass),
                    )
                }
                Drive::Path { .. } => (self.pose_at(time + half), None),
            };
            let middle = middle.unwrap_or(self.pose);
            contact.press_semi_implicit(&self.shape, &middle, mass, view, forces)
        } else {
            let mut sum = contact.add_forces(&self.shape, &self.pose, view.positions, forces);
            contact.add_friction(&self.pose, forces, &mut sum);
            sum
        };
        self.take(sum, &before);
        if let Drive::Force {
            mass,
            force,
            damping,
        } = self.drive
        {
            self.load_work += force.dot(self.pose.position - before.position);
            self.velocity += (force + sum.force) * (half / mass);
            self.dissipated += decay(&mut self.velocity, mass, damping, step);
        }
    }

    /// Goes to where the path is at `time` (s).
    pub(crate) fn follow(&mut self, time: f64) {
        if let Some(pose) = self.pose_at(time) {
            self.pose = pose;
        }
        if let Drive::Path { path, .. } = &self.drive {
            self.velocity = path.displacement(time).1;
            self.angular_velocity = path.rotation(time).1;
        }
    }

    /// Takes over the contact's forces at the end of a step that began at `before`, and their work.
    pub(crate) fn take(&mut self, sum: ContactForce, before: &Pose) {
        let old = std::mem::replace(&mut self.contact, sum);
        let moved = self.pose.position - before.position;
        let turn = self.pose.rotation * before.rotation.inverse();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let turned = turn.to_scaled_axis();
        let work = (old.force + sum.force).dot(moved) + (old.torque + sum.torque).dot(turned);
        self.contact_work += 0.5 * work;
    }
}

/// Half a step of damping; returns the energy taken.
fn decay(velocity: &mut DVec3, mass: f64, damping: f64, step: f64) -> f64 {
    let before = 0.5 * mass * velocity.length_squared();
    *velocity *= (-0.5 * damping * step).exp();
    before - 0.5 * mass * velocity.length_squared()
}
