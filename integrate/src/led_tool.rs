//! A tool that is led from pose to pose, and its contact with one body.

use glam::{DQuat, DVec3};

use crate::contact::{Contact, ContactForce, ContactSettings, ContactSurface};
use crate::path::Ease;
use crate::rigid_path::RigidPath;
use crate::shape::Pose;
use crate::tool::{Drive, RigidTool};
use crate::tool_shape::ToolShape;
use crate::view::StepView;

/// A tool whose next pose is known one step at a time, with its contact with one body: what a scene's path, a
/// recording or a hand leads. Once let go it moves by forces.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LedTool {
    tool: RigidTool,
    contact: Contact,
    /// Surface triangles that a cut has torn.
    torn: usize,
}

impl LedTool {
    /// The contact of a tool at `pose` with a surface.
    ///
    /// # Panics
    /// If the pose is not finite.
    #[must_use]
    pub fn new(
        shape: &ToolShape,
        pose: &Pose,
        surface: ContactSurface,
        settings: ContactSettings,
    ) -> Self {
        let (solid, local) = shape.contact();
        let still = RigidPath::new(&[(0.0, Pose::IDENTITY)], Ease::Linear);
        let still = still.expect("one finite key is a path");
        Self {
            tool: RigidTool::on_path(solid, pose.compose(&local), still),
            contact: Contact::new(surface, settings),
            torn: 0,
        }
    }

    /// Whether its numbers are finite and its contact can be one with a body of so many nodes.
    #[must_use]
    pub fn is_sound(&self, node_count: usize) -> bool {
        let tool = &self.tool;
        tool.pose.position.is_finite()
            && tool.pose.rotation.is_finite()
            && tool.velocity.is_finite()
            && tool.angular_velocity.is_finite()
            && self.contact.is_sound(node_count)
    }

    /// Leads the tool from where it is to where it will be after a step (s) that begins at `time` (s),
    /// and as far again, for contact forces that look ahead. A released tool goes its own way.
    ///
    /// # Panics
    /// If a pose or time is not finite, or the step is not above zero.
    pub fn lead(&mut self, shape: &ToolShape, from: &Pose, to: &Pose, time: f64, step: f64) {
        if self.is_released() {
            return;
        }
        let (_, local) = shape.contact();
        let (from, to) = (from.compose(&local), to.compose(&local));
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
        self.tool.drive = Drive::Path {
            origin: from,
            path: path.expect("finite keys in rising order"),
        };
    }

    /// Lets the tool go, at rest: a mass (kg) under a force (N), its weight included, and mass-proportional
    /// damping (1/s).
    pub fn release(&mut self, mass: f64, force: DVec3, damping: f64) {
        self.tool.velocity = DVec3::ZERO;
        self.tool.drive = Drive::Force {
            mass,
            force,
            damping,
        };
    }

    fn is_released(&self) -> bool {
        matches!(self.tool.drive, Drive::Force { .. })
    }

    /// Moves the tool to the end of a step and adds its forces on the body: [`RigidTool::press`].
    ///
    /// # Panics
    /// As [`RigidTool::press`].
    pub fn press(&mut self, view: &StepView<'_>, forces: &mut [DVec3]) {
        self.tool.press(&mut self.contact, view, forces);
    }

    /// Gives way where a cut has torn the surface, which now has `torn` torn triangles: their area goes to their
    /// corners, so that nothing spans the gap. Where friction sticks is forgotten then.
    ///
    /// # Errors
    /// What `surface` says, which makes the surface as it is now.
    pub fn tear<E>(
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

    /// The contact.
    #[must_use]
    pub fn contact(&self) -> &Contact {
        &self.contact
    }

    /// The tool and its contact, for implicit steps.
    pub fn parts(&mut self) -> (&mut RigidTool, &mut Contact) {
        (&mut self.tool, &mut self.contact)
    }

    /// Where a tool that goes its own way is, in the frame of its settings; `None` while it is led.
    #[must_use]
    pub fn released_pose(&self, shape: &ToolShape) -> Option<Pose> {
        let (_, local) = shape.contact();
        self.is_released().then(|| {
            let rotation = (self.tool.pose.rotation * local.rotation.inverse()).normalize();
            Pose {
                rotation,
                position: self.tool.pose.position - rotation * local.position,
            }
        })
    }

    /// Forces of the contact on the tool at the end of the last step, the torque about a point (m).
    #[must_use]
    pub fn force_about(&self, point: DVec3) -> ContactForce {
        let found = self.tool.contact;
        let arm = self.tool.pose.position - point;
        ContactForce {
            torque: found.torque + arm.cross(found.force),
            ..found
        }
    }

    /// Work (J) of the contact on the tool so far.
    #[must_use]
    pub fn contact_work(&self) -> f64 {
        self.tool.contact_work
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn led(shape: &ToolShape) -> LedTool {
        let surface = ContactSurface::from_nodes(&[0], &[1.0], 1).expect("a surface");
        LedTool::new(shape, &Pose::IDENTITY, surface, ContactSettings::new(1.0))
    }

    /// At the end of the step it is where it was led, and on a straight way there in between.
    #[test]
    fn it_is_where_it_is_led() {
        let shape = ToolShape::Capsule {
            from: DVec3::ZERO,
            to: DVec3::X,
            radius: 0.1,
        };
        let mut tool = led(&shape);
        let to = Pose {
            position: DVec3::new(0.1, 0.0, 0.2),
            rotation: DQuat::from_rotation_z(0.3),
        };
        tool.lead(&shape, &Pose::IDENTITY, &to, 2.0, 0.5);
        let (inner, _) = tool.parts();
        let end = inner.pose_at(2.5).expect("it is on a path");
        let (_, local) = shape.contact();
        let wanted = to.compose(&local);
        assert!(end.position.distance(wanted.position) < 1e-12, "{end:?}");
        assert!(end.rotation.dot(wanted.rotation).abs() > 1.0 - 1e-12);
        let start = inner.pose_at(2.0).expect("it is on a path");
        assert!(start.position.distance(local.position) < 1e-12, "{start:?}");
    }

    #[test]
    fn once_released_nothing_leads_it_and_its_pose_is_its_own() {
        let shape = ToolShape::Plane { normal: DVec3::Y };
        let mut tool = led(&shape);
        assert_eq!(tool.released_pose(&shape), None);
        tool.release(1.0, DVec3::ZERO, 0.0);
        tool.lead(&shape, &Pose::IDENTITY, &Pose::at(DVec3::X), 0.0, 1.0);
        let (inner, _) = tool.parts();
        assert_eq!(inner.pose_at(1.0), None, "no path");
        let pose = tool.released_pose(&shape).expect("it goes its own way");
        assert!(pose.position.length() < 1e-15, "{pose:?}");
        assert!(pose.rotation.dot(DQuat::IDENTITY).abs() > 1.0 - 1e-12);
    }
}
