//! The simulated world: bodies, what acts on them, and the clock.
//!
//! The world composes the leaves and computes no physics itself. It knows nothing of pictures and
//! files; whoever runs it asks for them between two steps.

mod body;
mod cutting;
mod error;
mod state;
mod support;

use std::time::{Duration, Instant};

use glam::DVec3;

pub use body::Body;
pub use cutting::{Capture, Cutting, Moment};
pub use error::{BodyProblem, WorldError};
pub use state::WorldState;

use crate::phases::{Phase, Phases};
use crate::scene::Scene;
use state::Incision;

/// Steps between two estimates of the largest eigenvalue: strain stiffens a body.
const STEPS_PER_ESTIMATE: u64 = 25;
/// Products with the stiffness per such estimate; it starts at the vector of the last.
const ESTIMATE_PRODUCTS: usize = 4;

/// A body with the blades that have touched it.
#[derive(Debug)]
pub struct Member {
    /// The body.
    pub body: Body,
    /// Present from the first capture of a blade.
    pub cutting: Option<Cutting>,
}

/// A capture of a blade that is due at a scene time.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Due {
    time: f64,
    cut: usize,
    moment: Moment,
}

/// New pieces of a cut in one body, for whoever draws or records them.
#[derive(Debug, Clone)]
pub struct CutPiece {
    /// Index of the body.
    pub member: usize,
    /// New triangles, corners in material coordinates (m).
    pub triangles: Vec<[DVec3; 3]>,
}

/// Bodies and the clock of one scene.
#[derive(Debug)]
pub struct World {
    scene: Scene,
    members: Vec<Member>,
    step: f64,
    first_step: f64,
    /// Motion time at which scene time is 0; `None` while settling.
    origin: Option<f64>,
    gravity: Option<DVec3>,
    due: Vec<Due>,
    next_due: usize,
    phases: Phases,
    /// When the newest blade update began, until the step that follows it is done.
    waiting: Option<Instant>,
    latencies: Vec<f64>,
    new_pieces: Vec<CutPiece>,
    /// Every edge that was taken up.
    incisions: Vec<Incision>,
}

impl World {
    /// Builds the bodies of a validated scene and chooses the step.
    ///
    /// # Errors
    /// [`WorldError`] with the body at fault.
    pub fn new(scene: Scene) -> Result<Self, WorldError> {
        let mut phases = Phases::default();
        let members = phases.time(Phase::Setup, || {
            scene
                .bodies
                .iter()
                .map(|description| {
                    Ok(Member {
                        body: Body::new(&scene, description)?,
                        cutting: None,
                    })
                })
                .collect::<Result<Vec<_>, WorldError>>()
        })?;
        let mut due: Vec<Due> = Vec::new();
        for (index, cut) in scene.cuts.iter().enumerate() {
            let times = cut.capture_times();
            let last = times.len().saturating_sub(1);
            due.extend(times.iter().enumerate().map(|(k, &time)| Due {
                time,
                cut: index,
                moment: match k {
                    0 => Moment::Start,
                    k if k == last => Moment::End,
                    _ => Moment::Update,
                },
            }));
        }
        due.sort_by(|a, b| a.time.total_cmp(&b.time).then(a.cut.cmp(&b.cut)));
        let mut world = Self {
            gravity: scene.gravity.as_ref().map(|_| DVec3::ZERO),
            scene,
            members,
            step: 0.0,
            first_step: 0.0,
            origin: None,
            due,
            next_due: 0,
            phases,
            waiting: None,
            latencies: Vec::new(),
            new_pieces: Vec::new(),
            incisions: Vec::new(),
        };
        world.step = world.smallest_step_size();
        world.first_step = world.step;
        match world.scene.integration.settle {
            Some(settle) => world.set_damping(Some(settle.damping))?,
            None => world.start_scene()?,
        }
        Ok(world)
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The bodies.
    #[must_use]
    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// Time (s) since the first step, settling included.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.members
            .first()
            .map_or(0.0, |member| member.body.motion.time())
    }

    /// Scene time (s); `None` while settling.
    #[must_use]
    pub fn scene_time(&self) -> Option<f64> {
        self.origin.map(|origin| self.time() - origin)
    }

    /// Step (s).
    #[must_use]
    pub fn step_size(&self) -> f64 {
        self.step
    }

    /// Step (s) that was chosen for the uncut bodies.
    #[must_use]
    pub fn first_step(&self) -> f64 {
        self.first_step
    }

    /// Steps taken, settling included.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.members
            .first()
            .map_or(0, |member| member.body.motion.steps())
    }

    /// Stopwatches; the run loop books its own phases here too.
    pub fn phases(&mut self) -> &mut Phases {
        &mut self.phases
    }

    /// Milliseconds from each blade update that changed the connectivity to the end of the step
    /// that followed it.
    #[must_use]
    pub fn latencies(&self) -> &[f64] {
        &self.latencies
    }

    /// Takes the pieces that blades have added since the last call.
    pub fn take_new_pieces(&mut self) -> Vec<CutPiece> {
        std::mem::take(&mut self.new_pieces)
    }

    /// Root of the mean squared speed of all mass (m/s).
    #[must_use]
    pub fn speed(&self) -> f64 {
        let (mut kinetic, mut mass) = (0.0, 0.0);
        for Member { body, .. } in &self.members {
            kinetic += body.motion.audit().kinetic;
            mass += body.masses.iter().sum::<f64>();
        }
        (2.0 * kinetic / mass).sqrt()
    }

    /// Whether gravity has reached its full size.
    #[must_use]
    pub fn gravity_is_full(&self) -> bool {
        self.gravity == self.scene.gravity.map(|gravity| gravity.acceleration)
    }

    /// Ends settling: scene time is 0 from here.
    ///
    /// # Errors
    /// [`WorldError`] if a motion refuses its damping.
    pub fn start_scene(&mut self) -> Result<(), WorldError> {
        self.start_scene_at(self.time())
    }

    fn start_scene_at(&mut self, start: f64) -> Result<(), WorldError> {
        self.origin = Some(start);
        self.set_damping(None)?;
        for (member, description) in self.members.iter_mut().zip(&self.scene.bodies) {
            let body = &mut member.body;
            let driven = support::driven_supports_of(&self.scene, description, &body.rest, start);
            if let Some(supports) = driven {
                body.motion.set_supports(supports);
            }
        }
        Ok(())
    }

    /// Takes one step: blades first, then motion.
    ///
    /// # Errors
    /// [`WorldError`] if a blade's edge cannot be taken up or a motion diverges.
    pub fn step(&mut self) -> Result<(), WorldError> {
        self.load_gravity()?;
        self.capture_blades()?;
        if self.steps().is_multiple_of(STEPS_PER_ESTIMATE) {
            self.fit_step()?;
        }
        let step = self.step;
        for Member { body, .. } in &mut self.members {
            let mut spent = Duration::ZERO;
            let start = Instant::now();
            let result = body.advance(step, &mut spent);
            self.phases.add(Phase::Forces, spent);
            self.phases
                .add(Phase::Integration, start.elapsed().saturating_sub(spent));
            result.map_err(|problem| WorldError {
                body: body.name.clone(),
                problem,
            })?;
        }
        if let Some(since) = self.waiting.take() {
            self.latencies.push(1e3 * since.elapsed().as_secs_f64());
        }
        Ok(())
    }

    /// Estimates the largest eigenvalues where the bodies are now and chooses the step anew.
    fn fit_step(&mut self) -> Result<(), WorldError> {
        let start = Instant::now();
        for Member { body, .. } in &mut self.members {
            body.estimate_eigenvalue(ESTIMATE_PRODUCTS)
                .map_err(|problem| WorldError {
                    body: body.name.clone(),
                    problem,
                })?;
        }
        self.step = self.smallest_step_size();
        self.phases.add(Phase::Integration, start.elapsed());
        Ok(())
    }

    fn smallest_step_size(&self) -> f64 {
        self.members
            .iter()
            .map(|member| member.body.step_size())
            .fold(f64::INFINITY, f64::min)
    }

    fn set_damping(&mut self, damping: Option<f64>) -> Result<(), WorldError> {
        for Member { body, .. } in &mut self.members {
            let value = damping.unwrap_or(body.damping);
            body.motion
                .set_damping(value)
                .map_err(|problem| WorldError {
                    body: body.name.clone(),
                    problem: problem.into(),
                })?;
        }
        Ok(())
    }

    /// Sets the weights while gravity grows.
    fn load_gravity(&mut self) -> Result<(), WorldError> {
        let (Some(gravity), Some(present)) = (self.scene.gravity, self.gravity) else {
            return Ok(());
        };
        if present == gravity.acceleration {
            return Ok(());
        }
        let reached = if gravity.ramp > 0.0 {
            ((self.time() + self.step) / gravity.ramp).min(1.0)
        } else {
            1.0
        };
        let now = if reached < 1.0 {
            gravity.acceleration * reached
        } else {
            gravity.acceleration
        };
        self.set_gravity(Some(now))
    }

    fn set_gravity(&mut self, gravity: Option<DVec3>) -> Result<(), WorldError> {
        self.gravity = gravity;
        let Some(now) = gravity else {
            return Ok(());
        };
        for Member { body, .. } in &mut self.members {
            let loads: Vec<DVec3> = body.masses.iter().map(|&mass| now * mass).collect();
            body.motion
                .set_loads(&loads)
                .map_err(|problem| WorldError {
                    body: body.name.clone(),
                    problem: problem.into(),
                })?;
        }
        Ok(())
    }

    /// Takes up the edges of all blades that are due.
    fn capture_blades(&mut self) -> Result<(), WorldError> {
        let Some(now) = self.scene_time() else {
            return Ok(());
        };
        while let Some(&due) = self.due.get(self.next_due).filter(|due| due.time <= now) {
            self.next_due += 1;
            let begun = Instant::now();
            let mut changed = false;
            let cut = &self.scene.cuts[due.cut];
            for (index, member) in self.members.iter_mut().enumerate() {
                if cut
                    .body
                    .as_ref()
                    .is_some_and(|name| *name != member.body.name)
                {
                    continue;
                }
                let (capture, edge, level) =
                    member.capture(due, cut).map_err(|problem| WorldError {
                        body: member.body.name.clone(),
                        problem,
                    })?;
                self.incisions.push(Incision {
                    steps: member.body.motion.steps(),
                    member: index,
                    cut: due.cut,
                    moment: due.moment,
                    edge,
                    level,
                });
                changed |= capture.changed;
                if !capture.triangles.is_empty() {
                    self.new_pieces.push(CutPiece {
                        member: index,
                        triangles: capture.triangles,
                    });
                }
            }
            self.phases.add(Phase::Cut, begun.elapsed());
            if changed {
                self.waiting.get_or_insert(begun);
                self.step = self.smallest_step_size();
            }
        }
        Ok(())
    }
}

impl Member {
    /// Takes up a blade's edge; also the edge in the material and the level of the cap.
    fn capture(
        &mut self,
        due: Due,
        cut: &crate::scene::Cut,
    ) -> Result<(Capture, Vec<DVec3>, usize), BodyProblem> {
        let (body, cutting) = self.with_cutting(cut)?;
        let edge = cutting.edge_in_material(body, cut, due.time)?;
        let capture = cutting.capture(body, due.cut, &edge, due.moment)?;
        Ok((capture, edge, cutting.level()))
    }

    fn replay(
        &mut self,
        incision: &Incision,
        cut: &crate::scene::Cut,
    ) -> Result<Capture, BodyProblem> {
        let (body, cutting) = self.with_cutting(cut)?;
        cutting.replay(body, incision)
    }

    fn with_cutting(
        &mut self,
        cut: &crate::scene::Cut,
    ) -> Result<(&mut Body, &mut Cutting), BodyProblem> {
        let fresh = match self.cutting.take() {
            Some(cutting) => cutting,
            None => Cutting::new(&self.body, cut.weld_tolerance)?,
        };
        let cutting = self.cutting.insert(fresh);
        Ok((&mut self.body, cutting))
    }
}
