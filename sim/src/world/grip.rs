//! A hand that holds a patch of a body, and what hands change of what acts on it.

use glam::DVec3;
use phyxel_integrate::StepView;
use serde::{Deserialize, Serialize};

use super::body::Body;
use super::error::WorldError;
use super::input::Action;
use super::{Member, World};
use crate::scene::Pose;

/// Stiffness of the hold over that of the patch, `2 E r / (1 - ν²)` with ν = 1/2 (a rigid disk on a
/// half-space): the patch comes along by nine tenths of the hand's way, by less where nodes are
/// few and [`LARGEST_PHASE`] bounds it.
const FIRMNESS: f64 = 10.0;
/// Largest frequency of a held node on its spring times the step, and damping of that node, as a share of
/// critical. With damping that is taken at the half step a mode needs `(ω dt)² < 4 - 2 c dt`; the
/// stiffest of a body has 2.9 at a step factor of 0.85, the hold adds at most 0.25 and takes 0.5.
const LARGEST_PHASE: f64 = 0.5;
const DAMPING_RATIO: f64 = 0.25;

/// What takes the place of values of the scene.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Adjusted {
    /// Gravity (m/s²).
    pub(super) gravity: Option<DVec3>,
    /// Mass-proportional damping (1/s).
    pub(super) damping: Option<f64>,
}

/// Nodes that a hand holds, each by a spring to its place in the hand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Grip {
    held: Vec<Held>,
    /// Way (m) of the hand since it gripped, at the end of this step, and its velocity (m/s).
    by: DVec3,
    velocity: DVec3,
    /// Force (N) on the hand at the end of the last step.
    force: DVec3,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Held {
    node: u32,
    /// Place (m) when it was gripped.
    from: DVec3,
    /// Stiffness (N/m) and damping (N s/m).
    stiffness: f64,
    damping: f64,
}

impl Grip {
    /// Whether it can be one of a body of so many nodes.
    pub(super) fn is_sound(&self, node_count: usize) -> bool {
        let vectors = [self.by, self.velocity, self.force];
        vectors.iter().all(|vector| vector.is_finite())
            && self.held.iter().all(|held| {
                (held.node as usize) < node_count
                    && held.from.is_finite()
                    && held.stiffness.is_finite()
                    && held.damping.is_finite()
            })
    }

    /// The nodes that it holds.
    pub(super) fn nodes(&self) -> impl Iterator<Item = u32> + '_ {
        self.held.iter().map(|held| held.node)
    }

    /// Holds the nodes within `radius` (m) of a point, the nearer the firmer: stiffness falls off as
    /// `(1 - d²/r²)²`. `None` if there is none.
    fn new(body: &Body, point: DVec3, radius: f64, modulus: f64, step: f64) -> Option<Self> {
        let positions = body.motion.positions();
        let near = |&(_, x): &(usize, &DVec3)| x.distance(point) < radius;
        let weight = |x: &DVec3| (1.0 - x.distance_squared(point) / (radius * radius)).powi(2);
        let patch = || positions.iter().enumerate().filter(near);
        let mass: f64 = patch().map(|(i, x)| body.masses[i] * weight(x)).sum();
        if mass <= 0.0 {
            return None;
        }
        let whole = FIRMNESS * 2.0 * modulus * radius / 0.75;
        // Springs in proportion to masses: all held nodes swing alike.
        let per_mass = (whole / mass).min((LARGEST_PHASE / step).powi(2));
        let held = patch().map(|(node, &from)| {
            let share = weight(&from);
            let stiffness = per_mass * body.masses[node] * share;
            Held {
                node: u32::try_from(node).unwrap_or(u32::MAX),
                from,
                stiffness,
                damping: 2.0 * DAMPING_RATIO * body.masses[node] * (per_mass * share).sqrt(),
            }
        });
        Some(Self {
            held: held.collect(),
            by: DVec3::ZERO,
            velocity: DVec3::ZERO,
            force: DVec3::ZERO,
        })
    }

    /// Adds the forces of the hold on the body's nodes at the end of a step.
    pub(super) fn pull(&mut self, view: &StepView<'_>, forces: &mut [DVec3]) {
        self.force = DVec3::ZERO;
        for held in &self.held {
            let node = held.node as usize;
            let apart = held.from + self.by - view.positions[node];
            let force =
                apart * held.stiffness + (self.velocity - view.velocities[node]) * held.damping;
            forces[node] += force;
            self.force -= force;
        }
    }

    /// Leads the hand over a step (s) from one way (m) to another.
    pub(super) fn lead(&mut self, from: DVec3, to: DVec3, step: f64) {
        self.by = to;
        self.velocity = (to - from) / step;
    }
}

impl World {
    /// Takes up what hands grip, pull and change in a step.
    pub(super) fn hold(&mut self, step: u64) -> Result<(), WorldError> {
        for action in self.hands.holds(step) {
            match action {
                Action::Grip { point, radius } => {
                    self.hands.begin_grip();
                    self.grip(point, radius);
                }
                Action::LetGo => {
                    for Member { body, .. } in &mut self.members {
                        body.grip = None;
                    }
                }
                Action::Gravity { acceleration } => {
                    self.adjusted.gravity = Some(acceleration);
                    self.set_gravity(Some(acceleration))?;
                }
                Action::Damping { rate } => {
                    self.adjusted.damping = Some(rate);
                    if self.origin.is_some() {
                        self.set_damping(None)?;
                    }
                }
                // Taken up with the tools' poses.
                Action::Tool { .. } | Action::Blade { .. } | Action::Pull { .. } => continue,
            }
            // Steps before this must not be done again with it.
            self.forget_kept();
        }
        Ok(())
    }

    /// Grips every body that has nodes there.
    fn grip(&mut self, point: DVec3, radius: f64) {
        let step = self.step;
        for (Member { body, .. }, description) in self.members.iter_mut().zip(&self.scene.bodies) {
            let modulus = description.material.youngs_modulus;
            // Less than a distance of nodes would find none on one place and one on another.
            let radius = radius.max(body.spacing);
            body.grip = Grip::new(body, point, radius, modulus, step);
        }
    }

    /// Force (N) on the hand that grips, at the end of the last step; `None` if it holds nothing.
    #[must_use]
    pub fn grip_force(&self) -> Option<DVec3> {
        let grips = self.members.iter().filter_map(|m| m.body.grip.as_ref());
        grips
            .map(|grip| grip.force)
            .reduce(|sum, force| sum + force)
    }

    /// Gravity (m/s²) as the scene or a hand has it, at its full size.
    #[must_use]
    pub fn gravity(&self) -> DVec3 {
        let scene = self.scene.gravity.map_or(DVec3::ZERO, |g| g.acceleration);
        self.adjusted.gravity.unwrap_or(scene)
    }

    /// Mass-proportional damping (1/s) once settled, of the first body where they differ.
    #[must_use]
    pub fn damping(&self) -> f64 {
        let first = self.members.first();
        let own = first.map_or(0.0, |member| member.body.damping);
        self.adjusted.damping.unwrap_or(own)
    }

    /// Where a tool was led last.
    ///
    /// # Panics
    /// If the scene has no such tool.
    #[must_use]
    pub fn tool_pose(&self, tool: usize) -> &Pose {
        &self.hands.poses()[tool]
    }
}
