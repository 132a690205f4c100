//! What users grip and pull, and what they change of what acts on a body.

use glam::DVec3;
use phyxel_integrate::Grip;
use serde::{Deserialize, Serialize};

use crate::World;
use crate::error::WorldError;
use crate::input::Action;
use crate::scene::Pose;

/// What replaces values of the scene.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Adjusted {
    /// Gravity (m/s²).
    pub(crate) gravity: Option<DVec3>,
    /// Mass-proportional damping (1/s).
    pub(crate) damping: Option<f64>,
}

impl World {
    /// Applies what users grip, pull and change in a step.
    pub(crate) fn hold(&mut self, step: u64) -> Result<(), WorldError> {
        for action in self.input.holds(step) {
            match action {
                Action::Grip { point, radius } => {
                    // The hand has not moved yet.
                    if let Some(hand) = self.input.state.poses.last_mut() {
                        *hand = Pose::IDENTITY;
                    }
                    self.grip(point, radius);
                }
                Action::LetGo => {
                    for body in &mut self.bodies {
                        body.grip = None;
                    }
                }
                Action::Gravity { acceleration } => {
                    self.now.adjusted.gravity = Some(acceleration);
                    self.set_gravity(Some(acceleration))?;
                }
                Action::Damping { rate } => {
                    self.now.adjusted.damping = Some(rate);
                    if self.now.origin.is_some() {
                        self.set_damping(None)?;
                    }
                }
                // Taken up with the tools' poses.
                Action::Tool { .. } | Action::Blade { .. } | Action::Pull { .. } => continue,
            }
            // Steps before this must not be retried with it.
            self.now.kept = None;
        }
        Ok(())
    }

    /// Grips every body that has nodes there.
    fn grip(&mut self, point: DVec3, radius: f64) {
        let step = self.now.step;
        for (body, description) in self.bodies.iter_mut().zip(&self.scene.bodies) {
            let modulus = description.material.youngs_modulus;
            // Less than a node spacing would find none on one position and one on another.
            let radius = radius.max(body.spacing);
            let positions = body.motion().positions();
            body.grip = Grip::new(positions, &body.masses, point, radius, modulus, step);
        }
    }

    /// Force (N) on the grip, at the end of the last step; `None` if it holds nothing.
    #[must_use]
    pub fn grip_force(&self) -> Option<DVec3> {
        let grips = self.bodies.iter().filter_map(|m| m.grip.as_ref());
        grips.map(Grip::force).reduce(|sum, force| sum + force)
    }

    /// Gravity (m/s²) as the scene or a hand has it, at its full size.
    #[must_use]
    pub fn gravity(&self) -> DVec3 {
        let scene = self.scene.gravity.map_or(DVec3::ZERO, |g| g.acceleration);
        self.now.adjusted.gravity.unwrap_or(scene)
    }

    /// Mass-proportional damping (1/s) once settled, of the first body where they differ.
    #[must_use]
    pub fn damping(&self) -> f64 {
        let first = self.bodies.first();
        let own = first.map_or(0.0, |body| body.damping);
        self.now.adjusted.damping.unwrap_or(own)
    }

    /// Where a tool was driven last.
    ///
    /// # Panics
    /// If the scene has no such tool.
    #[must_use]
    pub fn tool_pose(&self, tool: usize) -> &Pose {
        &self.input.state.poses[tool]
    }
}
