//! Before the scene starts: gravity comes, bodies come to rest, and time begins.

use std::time::Instant;

use glam::DVec3;
use phyxel_integrate::Motion;

use crate::World;
use crate::error::{BodyProblem, WorldError, in_body};
use crate::phases::Phase;
use crate::scene::Rest;
use crate::stiffness::PRODUCTS;

impl World {
    /// Root of the mean squared speed of all mass (m/s).
    #[must_use]
    pub fn speed(&self) -> f64 {
        let (mut kinetic, mut mass) = (0.0, 0.0);
        for body in &self.bodies {
            kinetic += body.whole.of_motion(|motion| motion.audit().kinetic);
            mass += body.masses.iter().sum::<f64>();
        }
        (2.0 * kinetic / mass).sqrt()
    }

    /// Whether the bodies are at rest under all of gravity, as the scene's settling asks.
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        let full = self.scene.gravity.map(|gravity| gravity.acceleration);
        let is_full = self.now.gravity == full || self.now.adjusted.gravity.is_some();
        let settle = self.scene.integration.settle;
        is_full && settle.is_none_or(|settle| self.speed() < settle.speed)
    }

    /// Lets the bodies come to rest as the scene's `integration.settle` says, and starts the scene;
    /// nothing once it has started. Whether they came to rest within the time given for it.
    ///
    /// # Errors
    /// As [`World::step`] and [`World::rest_in_equilibrium`].
    pub fn settle(&mut self) -> Result<bool, WorldError> {
        if self.now.origin.is_some() {
            return Ok(true);
        }
        while self.is_settling() {
            self.step()?;
        }
        let rested = self.rests_in_equilibrium() || self.is_at_rest();
        self.start_scene()?;
        Ok(rested)
    }

    /// Whether steps go on until the bodies are at rest or the time for it is over; then [`World::start_scene`] follows.
    #[must_use]
    pub fn is_settling(&self) -> bool {
        self.now.origin.is_none() && !self.rests_in_equilibrium() && self.moves_to_rest()
    }

    fn moves_to_rest(&self) -> bool {
        !(self.has_settled() || self.steps() > 0 && self.is_at_rest())
    }

    fn rests_in_equilibrium(&self) -> bool {
        let settle = self.scene.integration.settle;
        settle.is_some_and(|settle| settle.rest == Rest::Equilibrium)
    }

    /// Whether the bodies have settled for as long as they may and the scene has not started:
    /// [`World::start_scene`] follows.
    #[must_use]
    pub fn has_settled(&self) -> bool {
        let settle = self.scene.integration.settle;
        self.now.origin.is_none() && settle.is_some_and(|settle| self.time() >= settle.limit)
    }

    /// Puts every body where it is in equilibrium with all of gravity, instead of settling by motion;
    /// tools have no part in it. [`World::start_scene`] follows.
    ///
    /// # Errors
    /// [`WorldError`] if a body has no equilibrium or none is found.
    pub fn rest_in_equilibrium(&mut self) -> Result<(), WorldError> {
        let start = Instant::now();
        let gravity = self.scene.gravity.map(|gravity| gravity.acceleration);
        self.set_gravity(gravity)?;
        let now = gravity.unwrap_or(DVec3::ZERO);
        for body in &mut self.bodies {
            let loads: Vec<DVec3> = body.masses.iter().map(|&mass| now * mass).collect();
            in_body(body.come_to_rest(&loads), &body.name)?;
        }
        self.phases.add(Phase::Setup, start.elapsed());
        self.estimate_eigenvalues(PRODUCTS)
    }

    /// Ends settling: scene time is 0 from here. Where the scene asks for an equilibrium the bodies are put there; where none
    /// is found they come to rest by motion, as in other scenes, which [`World::alarms`] reports.
    ///
    /// # Errors
    /// As [`World::rest_in_equilibrium`] but for that, as [`World::step`], and if a motion refuses its damping.
    pub fn start_scene(&mut self) -> Result<(), WorldError> {
        if self.now.origin.is_none() && self.rests_in_equilibrium() {
            let found = self.rest_in_equilibrium();
            found.or_else(|error| self.rest_by_motion(error))?;
        }
        self.start_scene_at(self.time())
    }

    fn rest_by_motion(&mut self, error: WorldError) -> Result<(), WorldError> {
        let WorldError::Body {
            problem: BodyProblem::Solve(problem),
            ..
        } = &error
        else {
            return Err(error);
        };
        self.set_gravity(self.scene.gravity.map(|_| DVec3::ZERO))?;
        while self.moves_to_rest() {
            self.step()?;
        }
        let how = format!(" ({problem}); bodies come to rest by motion instead");
        self.alarm("no equilibrium was found".to_owned(), &how);
        Ok(())
    }

    pub(crate) fn start_scene_at(&mut self, start: f64) -> Result<(), WorldError> {
        self.now.origin = Some(start);
        self.now.kept = None;
        self.set_damping(None)?;
        for (body, description) in self.bodies.iter_mut().zip(&self.scene.bodies) {
            if self.scene.is_driven(description) {
                let supports = self.scene.supports_of(description, &body.rest, Some(start));
                body.set_supports(supports);
            }
            if description.velocity != DVec3::ZERO {
                in_body(body.begin_with(description.velocity), &body.name)?;
            }
            if !body.whole.of_motion(Motion::has_pieces) {
                // What nothing holds falls and turns freely from here on.
                let pieces = body.pieces().piece;
                let (_, motion) = body.whole.as_it_is();
                motion.set_pieces(&pieces);
                if !motion.has_free_pieces() {
                    motion.set_pieces(&[]);
                }
            }
            let gravity = self.scene.gravity.map_or(DVec3::ZERO, |g| g.acceleration);
            for contact in &mut body.contacts {
                if let Some(release) = &self.scene.tools[contact.tool].release {
                    let force = release.force + gravity * release.mass;
                    contact.rigid.release(release.mass, force, release.damping);
                }
            }
        }
        Ok(())
    }

    pub(crate) fn set_damping(&mut self, damping: Option<f64>) -> Result<(), WorldError> {
        for body in &mut self.bodies {
            let value = damping.or(self.now.adjusted.damping);
            let value = value.unwrap_or(body.damping);
            in_body(body.whole.as_it_is().1.set_damping(value), &body.name)?;
        }
        Ok(())
    }

    /// Sets the weights at the end of a step (s) while gravity grows.
    pub(crate) fn load_gravity(&mut self, step: f64) -> Result<(), WorldError> {
        let (Some(gravity), Some(present)) = (self.scene.gravity, self.now.gravity) else {
            return Ok(());
        };
        if present == gravity.acceleration || self.now.adjusted.gravity.is_some() {
            return Ok(());
        }
        let reached = if gravity.ramp > 0.0 {
            ((self.time() + step) / gravity.ramp).min(1.0)
        } else {
            1.0
        };
        self.set_gravity(Some(gravity.acceleration * reached))
    }

    pub(crate) fn set_gravity(&mut self, gravity: Option<DVec3>) -> Result<(), WorldError> {
        self.now.gravity = gravity;
        let Some(now) = gravity else {
            return Ok(());
        };
        for body in &mut self.bodies {
            let loads: Vec<DVec3> = body.masses.iter().map(|&mass| now * mass).collect();
            in_body(body.whole.motion_mut().set_loads(&loads), &body.name)?;
        }
        Ok(())
    }
}
