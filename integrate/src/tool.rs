//! A rigid tool that follows a path, is driven step by step or moves under forces, and presses on one body.

use crate::contact::{Contact, ContactForce, ContactSurface};
use crate::shape::{Pose, RigidShape};
use crate::trajectory::{Ease, Trajectory};
use crate::vector::bounds_of;
use crate::view::StepView;
use glam::{BVec3, DQuat, DVec3};

/// What moves a tool.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Drive {
    /// Displacement-driven.
    Path {
        /// Pose that the path displaces, and turns about the shape's origin.
        origin: Pose,
        /// Displacement and rotation over time.
        path: Trajectory,
    },
    /// Force-driven: a mass under a constant force (its weight, a user's) and the contact's. It does not
    /// turn: who holds it takes the torque.
    Force {
        /// Mass (kg), positive.
        mass: f64,
        /// Force (N), weight included.
        force: DVec3,
        /// Mass-proportional damping (1/s).
        damping: f64,
    },
}

/// A rigid tool and its contact with one body. Clone it to save its state.
///
/// After each step `load` holds the force and torque on it; keep them over time for a record.
///
/// # Examples
/// A mass falls on a floor, in explicit steps:
/// ```
/// use phyxel_integrate::{BoundaryConditions, Contact, ContactSettings, ContactSurface, Motion, MotionSettings};
/// use phyxel_integrate::{Pose, RigidShape, RigidTool, glam::DVec3};
///
/// let settings = MotionSettings { gravity: DVec3::Z * -9.81, ..MotionSettings::default() };
/// let mut motion = Motion::new(&[DVec3::Z * 0.02], &[0.01], BoundaryConditions::free(1), settings)?;
/// // Node 0 stands for 1 cm² of surface.
/// let surface = ContactSurface::from_nodes(&[0], &[1e-4], 1)?;
/// let contact = Contact::new(surface, ContactSettings::new(1e7));
/// let floor = RigidShape::Plane { normal: DVec3::Z };
/// let mut floor = RigidTool::standing(floor, Pose::IDENTITY, contact);
/// let free = |_: &[DVec3], forces: &mut [DVec3]| {
///     forces.fill(DVec3::ZERO);
///     0.0
/// };
/// let mut lowest = 0.0_f64;
/// for k in 1..=100 {
///     let end = 1e-3 * f64::from(k);
///     motion.advance_with(end, 1e-4, free, &mut |view, forces| floor.press(view, forces))?;
///     lowest = lowest.min(motion.positions()[0].z);
/// }
/// assert!(lowest < 0.0 && lowest > -0.01); // m
/// assert!(motion.positions()[0].z < 0.02);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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
    /// The contact.
    pub contact: Contact,
    /// Forces of the contact on the tool at the end of the last step, the torque about its origin.
    pub load: ContactForce,
    /// Work (J) of the contact on the tool so far.
    pub contact_work: f64,
    /// Work (J) of a force-driven tool's own force so far.
    pub load_work: f64,
    /// Energy (J) that a force-driven tool's damping took so far.
    pub dissipated: f64,
}

/// Farthest that a tool moves in a step, in spacings of the body's nodes: what goes farther would come out behind the
/// surface that it is to press. A tool thinner than that moves half its thickness, but for `LEAST` spacings.
const FARTHEST: f64 = 0.5;
const LEAST: f64 = 0.1;
/// Most parts that a step has for a fast tool: a thousand times as fast as the fastest wave in the body. What would need
/// more was not moved but put where it is, as by a hand that takes it up: it comes through nothing.
const MOST_PARTS: f64 = 1000.0;

/// How far a tool moves in a step ([`RigidTool::stride`]), so that it passes through no body from one part of the step to
/// the next.
#[derive(Debug, Clone, Copy)]
pub struct Stride {
    /// The way of its corner that moves most, over the farthest that it may move at once.
    farthest: f64,
    is_jump: bool,
    /// Opposite corners of a box (m) around all that may touch it; `None` for a plane.
    swept: Option<[DVec3; 2]>,
}

impl Stride {
    /// Whether the tool was not moved but put where it is.
    #[must_use]
    pub fn is_jump(&self) -> bool {
        self.is_jump
    }

    /// Into how many parts each of `division` of the step is divided.
    #[must_use]
    pub fn parts(&self, division: u32) -> u32 {
        let parts = (self.farthest / f64::from(division)).ceil();
        #[allow(clippy::cast_possible_truncation, reason = "from 1 to MOST_PARTS")]
        let parts = parts.clamp(1.0, MOST_PARTS) as u32;
        parts
    }

    /// Whether it may touch a body with nodes at these positions (m).
    #[must_use]
    pub fn meets(&self, positions: &[DVec3]) -> bool {
        self.swept.is_none_or(|[low, high]| {
            let [min, max] = bounds_of(positions);
            low.cmple(max).all() && high.cmpge(min).all()
        })
    }
}

impl RigidTool {
    /// A tool at rest.
    #[must_use]
    pub fn new(shape: RigidShape, pose: Pose, drive: Drive, contact: Contact) -> Self {
        Self {
            shape,
            pose,
            velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
            drive,
            contact,
            load: ContactForce::default(),
            contact_work: 0.0,
            load_work: 0.0,
            dissipated: 0.0,
        }
    }

    /// A tool on a path from `origin`.
    #[must_use]
    pub fn on_path(shape: RigidShape, origin: Pose, path: Trajectory, contact: Contact) -> Self {
        let drive = Drive::Path { origin, path };
        Self::new(shape, origin, drive, contact)
    }

    /// A tool that stands at a pose until [`RigidTool::lead`].
    ///
    /// # Panics
    /// If the pose is not finite.
    #[must_use]
    pub fn standing(shape: RigidShape, pose: Pose, contact: Contact) -> Self {
        let still = Trajectory::new(&[(0.0, Pose::IDENTITY)], Ease::Linear);
        let still = still.expect("one finite key is a path");
        Self::on_path(shape, pose, still, contact)
    }

    /// Drives the tool from where it is to where it will be after a step (s) that begins at `time` (s),
    /// and as far again, for contact forces that look ahead. A released tool moves on by itself.
    ///
    /// # Panics
    /// If a pose or time is not finite, or the step is not above zero.
    pub fn lead(&mut self, from: &Pose, to: &Pose, time: f64, step: f64) {
        if self.is_released() {
            return;
        }
        let end = time + 2.0 * step;
        let half = (to.rotation * from.rotation.inverse()).normalize();
        let twice = Pose {
            position: (to.position - from.position) * 2.0,
            rotation: if half.w.abs() < 1.0 {
                half * half
            } else {
                DQuat::IDENTITY
            },
        };
        let path = Trajectory::new(&[(time, Pose::IDENTITY), (end, twice)], Ease::Linear);
        self.drive = Drive::Path {
            origin: *from,
            path: path.expect("finite keys in ascending order"),
        };
    }

    /// Lets the tool go, at rest: a mass (kg) under a force (N), its weight included, and mass-proportional
    /// damping (1/s).
    pub fn release(&mut self, mass: f64, force: DVec3, damping: f64) {
        self.velocity = DVec3::ZERO;
        self.drive = Drive::Force {
            mass,
            force,
            damping,
        };
    }

    /// Whether it moves under forces.
    #[must_use]
    pub fn is_released(&self) -> bool {
        matches!(self.drive, Drive::Force { .. })
    }

    /// How the tool moves from one pose to another in a step (s), on its own path if it is released, beside a body whose
    /// nodes are `spacing` (m) apart.
    #[must_use]
    pub fn stride(&self, from: &Pose, to: &Pose, step: f64, spacing: f64) -> Stride {
        let (mut from, mut to) = (*from, *to);
        if self.is_released() {
            (from, to) = (self.pose, self.pose);
            to.position += self.velocity * step;
        }
        let bounds = self.shape.bounds();
        // A plane has no end: its origin stands for it.
        let [min, max] = bounds.unwrap_or_default();
        let moves = [0, 1, 2, 3, 4, 5, 6, 7].map(|k: usize| {
            let is_high = [0, 1, 2].map(|axis| k >> axis & 1 == 1);
            let corner = DVec3::select(BVec3::from_array(is_high), max, min);
            [from.apply(corner), to.apply(corner)]
        });
        let way = moves
            .iter()
            .fold(0.0, |way: f64, [a, b]| way.max(a.distance(*b)));
        let thickness = bounds.map_or(spacing, |_| 0.5 * (max - min).min_element());
        let farthest = (FARTHEST * spacing).min(thickness.max(LEAST * spacing));
        let margin = DVec3::splat(farthest + min.distance(max));
        let [low, high] = bounds_of(moves.iter().flatten());
        Stride {
            farthest: way / farthest,
            is_jump: way > MOST_PARTS * farthest && !self.is_released(),
            swept: bounds.map(|_| [low - margin, high + margin]),
        }
    }

    /// Whether its numbers are finite and its contact can be one with a body of so many nodes.
    #[must_use]
    pub fn is_sound(&self, node_count: usize) -> bool {
        self.pose.position.is_finite()
            && self.pose.rotation.is_finite()
            && self.velocity.is_finite()
            && self.angular_velocity.is_finite()
            && self.contact.is_sound(node_count)
    }

    /// Presses on another surface from now on, as after a cut; where friction sticks is forgotten.
    pub fn set_surface(&mut self, surface: ContactSurface) {
        self.contact = Contact::new(surface, *self.contact.settings());
    }

    /// The forces on the tool with the torque about a point (m).
    #[must_use]
    pub fn load_about(&self, point: DVec3) -> ContactForce {
        let arm = self.pose.position - point;
        ContactForce {
            torque: self.load.torque + arm.cross(self.load.force),
            ..self.load
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
    pub fn press(&mut self, view: &StepView<'_>, forces: &mut [DVec3]) {
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
            self.velocity += (force + self.load.force) * (half / mass);
            self.pose.position += self.velocity * step;
        } else {
            self.follow(time);
        }
        let sum = if self.contact.settings().implicit {
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
            let contact = &mut self.contact;
            contact.press_semi_implicit(&self.shape, &middle, mass, view, forces)
        } else {
            let (shape, contact) = (&self.shape, &mut self.contact);
            let mut sum = contact.add_forces(shape, &self.pose, view.positions, forces);
            contact.add_friction((shape, &self.pose), forces, &mut sum);
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

    /// Adopts the contact's forces at the end of a step that began at `before`, and their work.
    pub(crate) fn take(&mut self, sum: ContactForce, before: &Pose) {
        let old = std::mem::replace(&mut self.load, sum);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ContactSettings;

    fn standing(shape: RigidShape) -> RigidTool {
        let surface = ContactSurface::from_nodes(&[0], &[1.0], 1).expect("a surface");
        let contact = Contact::new(surface, ContactSettings::new(1.0));
        RigidTool::standing(shape, Pose::IDENTITY, contact)
    }

    /// At the end of the step it is where it was driven, and on a straight line there in between.
    #[test]
    fn it_is_where_it_is_led() {
        let mut tool = standing(RigidShape::Sphere { radius: 0.1 });
        let to = Pose {
            position: DVec3::new(0.1, 0.0, 0.2),
            rotation: DQuat::from_rotation_z(0.3),
        };
        tool.lead(&Pose::IDENTITY, &to, 2.0, 0.5);
        let end = tool.pose_at(2.5).expect("it is on a path");
        assert!(end.position.distance(to.position) < 1e-12, "{end:?}");
        assert!(end.rotation.dot(to.rotation).abs() > 1.0 - 1e-12);
        let start = tool.pose_at(2.0).expect("it is on a path");
        assert!(start.position.length() < 1e-15, "{start:?}");
        let half = tool.pose_at(2.25).expect("it is on a path");
        assert!(half.position.distance(0.5 * to.position) < 1e-12);
    }

    #[test]
    fn once_released_nothing_leads_it() {
        let mut tool = standing(RigidShape::Plane { normal: DVec3::Y });
        assert!(!tool.is_released());
        tool.release(1.0, DVec3::ZERO, 0.0);
        tool.lead(&Pose::IDENTITY, &Pose::at(DVec3::X), 0.0, 1.0);
        assert!(tool.is_released());
        assert_eq!(tool.pose_at(1.0), None, "no path");
        assert_eq!(tool.pose, Pose::IDENTITY, "where it was let go");
    }
}
