//! Rigid tools that touch the bodies.

use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};
use phyxel_integrate::{
    Contact, ContactSettings, ContactSurface, Drive, Ease, Pose, RigidPath, StepView, penalty,
};
use serde::{Deserialize, Serialize};

use crate::scene::{self, Release, ToolShape};

/// The contact of one tool with one body.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Touch {
    /// Index of the scene's tool.
    pub(super) tool: usize,
    hand: phyxel_integrate::Tool,
    contact: Contact,
    /// Surface triangles that a cut has torn.
    torn: usize,
}

/// Forces on a tool at the end of the last step, of all bodies together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolForce {
    /// Where the tool is.
    pub pose: Pose,
    /// Force on the tool (N).
    pub force: DVec3,
    /// Torque on the tool about its origin (N m).
    pub torque: DVec3,
    /// Deepest penetration (m).
    pub penetration: f64,
    /// Area of contact at rest (m²).
    pub area: f64,
    /// Work of the bodies on the tool so far (J).
    pub work: f64,
}

impl ToolForce {
    pub(super) fn free(pose: Pose) -> Self {
        Self {
            pose,
            force: DVec3::ZERO,
            torque: DVec3::ZERO,
            penetration: 0.0,
            area: 0.0,
            work: 0.0,
        }
    }
}

impl Touch {
    /// Whether it can be one of a body of so many nodes in the place of another.
    pub(super) fn is_sound(&self, node_count: usize, built: &Self) -> bool {
        let hand = &self.hand;
        self.tool == built.tool
            && hand.pose.position.is_finite()
            && hand.pose.rotation.is_finite()
            && hand.velocity.is_finite()
            && hand.angular_velocity.is_finite()
            && self.contact.is_sound(node_count)
    }

    /// The contact of a tool at `pose` with the surface of an uncut body of a modulus (Pa), its nodes `spacing` (m)
    /// apart.
    pub(super) fn new(
        tool: usize,
        description: &scene::Tool,
        pose: &Pose,
        surface: ContactSurface,
        (youngs_modulus, spacing): (f64, f64),
    ) -> Self {
        let (shape, _) = description.solid().contact();
        let stiffness = description
            .penalty
            .unwrap_or_else(|| penalty(youngs_modulus, spacing));
        let settings = ContactSettings {
            friction: description.friction,
            ..ContactSettings::new(stiffness)
        };
        let still = RigidPath::new(&[(0.0, Pose::IDENTITY)], Ease::Linear);
        let path = still.expect("one finite key is a path");
        let placed = placed(&description.solid(), pose);
        Self {
            tool,
            hand: phyxel_integrate::Tool::on_path(shape, placed, path),
            contact: Contact::new(surface, settings),
            torn: 0,
        }
    }

    /// Leads the tool from where it is to where it will be after a step (s) that begins at `time` (s),
    /// and as far again, for contact forces that look ahead. A released tool goes its own way.
    pub(super) fn lead(&mut self, shape: &ToolShape, from: &Pose, to: &Pose, time: f64, step: f64) {
        if matches!(self.hand.drive, Drive::Force { .. }) {
            return;
        }
        let (from, to) = (placed(shape, from), placed(shape, to));
        let end = time + 2.0 * step;
        let half = (to.rotation * from.rotation.inverse()).normalize();
        let way = Pose {
            position: (to.position - from.position) * 2.0,
            rotation: if half.w.abs() < 1.0 {
                half * half
            } else {
                DQuat::IDENTITY
            },
        };
        let path = RigidPath::new(&[(time, Pose::IDENTITY), (end, way)], Ease::Linear);
        self.hand.drive = Drive::Path {
            origin: from,
            path: path.expect("finite keys in rising order"),
        };
    }

    /// Lets the tool go.
    pub(super) fn release(&mut self, release: &Release, gravity: DVec3) {
        self.hand.velocity = DVec3::ZERO;
        self.hand.drive = Drive::Force {
            mass: release.mass,
            force: release.force + gravity * release.mass,
            damping: release.damping,
        };
    }

    /// Moves the tool to the end of a step and adds its forces on the body.
    pub(super) fn press(
        &mut self,
        view: &StepView<'_>,
        forces: &mut [DVec3],
        spent: &mut Duration,
    ) {
        let start = Instant::now();
        self.hand.press(&mut self.contact, view, forces);
        *spent += start.elapsed();
    }

    /// Gives way where a cut has torn the surface: a torn triangle's area goes to its corners, so that
    /// nothing spans the gap. Where friction sticks is forgotten then.
    pub(super) fn tear<E>(
        &mut self,
        torn: usize,
        surface: impl FnOnce() -> Result<ContactSurface, E>,
    ) -> Result<(), E> {
        if torn != self.torn {
            self.contact = Contact::new(surface()?, *self.contact.settings());
            self.torn = torn;
        }
        Ok(())
    }

    /// The body's nodes that it may press on, rising.
    pub(super) fn nodes(&self) -> &[u32] {
        self.contact.surface().members()
    }

    /// The tool and its contact, for implicit steps.
    pub(super) fn parts(&mut self) -> (&mut phyxel_integrate::Tool, &mut Contact) {
        (&mut self.hand, &mut self.contact)
    }

    /// Adds this body's share of the forces; where the tool is, if it goes its own way.
    pub(super) fn add_to(&self, shape: &ToolShape, sum: &mut ToolForce) {
        let (_, local) = shape.contact();
        if matches!(self.hand.drive, Drive::Force { .. }) {
            let rotation = (self.hand.pose.rotation * local.rotation.inverse()).normalize();
            sum.pose = Pose {
                rotation,
                position: self.hand.pose.position - rotation * local.position,
            };
        }
        let found = &self.hand.contact;
        let arm = self.hand.pose.position - sum.pose.position;
        sum.force += found.force;
        sum.torque += found.torque + arm.cross(found.force);
        sum.penetration = sum.penetration.max(found.penetration);
        sum.area += found.area;
        sum.work += self.hand.contact_work;
    }

    /// Bytes of the contact's arrays.
    pub(super) fn bytes(&self) -> usize {
        self.contact.bytes()
    }
}

/// Where contact's shape is in the world when the tool is at `pose`.
fn placed(shape: &ToolShape, pose: &Pose) -> Pose {
    let (_, local) = shape.contact();
    pose.compose(&local)
}
