#![doc = include_str!("../README.md")]

/// The program in the page for trainers is compiled and run as a test.
#[cfg(doctest)]
#[doc = include_str!("../docs/trainer.md")]
mod trainer {}

mod alarm;
mod body;
mod body_state;
mod capture;
mod cut_state;
mod cutting;
mod decay;
mod deformable;
mod error;
mod grip;
mod guard;
mod input;
mod memory;
mod model;
mod moves;
mod newest;
mod parts;
mod phases;
mod settling;
mod shape;
mod shares;
mod state;
mod stiffness;
mod surface;
mod tool;

use std::sync::{Arc, Mutex};
use std::time::Instant;

use glam::DVec3;

// The crates and the vectors that the public types use.
pub use glam;
pub use {
    phyxel_discretize as discretize, phyxel_elastic as elastic, phyxel_enrich as enrich,
    phyxel_integrate as integrate, phyxel_mls as mls, phyxel_scene as scene, phyxel_splat as splat,
};

pub use body::Body;
use capture::finest_spacing;
pub use cut_state::{Cutting, StrokeEnergy};
use error::in_body;
pub use error::{BodyProblem, WorldError};
pub use guard::Retaken;
pub use input::{Action, Input, InputError, StrokePhase};
pub use memory::{MemoryShortage, ask_memory};
pub use model::elastic_stencils;
pub use parts::PartCost;
pub use phases::{Phase, Phases, Spent};
pub use phyxel_integrate::CutEnergy;
pub use shares::BodyShares;
use state::Standing;
pub use state::WorldState;
pub use tool::ToolForce;

use deformable::DeformableBodies;
use input::InputSource;
use phyxel_integrate::{DeformableForce, DeformableState, StepControl};
use scene::{Checks, Scene};

/// New pieces of a cut in one body, for drawing and recording them.
#[derive(Debug, Clone)]
pub struct CutPiece {
    /// Index of the body.
    pub body: usize,
    /// New triangles, corners in material coordinates (m).
    pub triangles: Vec<[DVec3; 3]>,
}

/// Bodies and the clock of one scene.
///
/// A clone is a state to go back to at once: `let before = world.clone(); ..; world = before`.
/// [`World::state`] is one that can be written to a file, for a new world of the same scene. A clone has no shares
/// ([`World::new_shared`]): its bodies' nodes are all here.
#[derive(Debug)]
pub struct World {
    scene: Scene,
    bodies: Vec<Body>,
    /// Contact between bodies, if the scene asks for it.
    deformable: Option<Box<DeformableBodies>>,
    first_step: f64,
    now: Standing,
    input: InputSource,
    phases: Phases,
    /// When the newest blade update began, until the step that follows it is done.
    waiting: Option<Instant>,
    latencies: Vec<f64>,
    new_pieces: Vec<CutPiece>,
}

impl Clone for World {
    fn clone(&self) -> Self {
        Self {
            scene: self.scene.clone(),
            bodies: self.bodies.clone(),
            deformable: self.deformable.clone(),
            first_step: self.first_step,
            now: self.standing(),
            input: self.input.clone(),
            phases: self.phases.clone(),
            waiting: self.waiting,
            latencies: self.latencies.clone(),
            new_pieces: self.new_pieces.clone(),
        }
    }
}

impl World {
    /// Builds the bodies of a scene and chooses the step. The scene settles first unless it says
    /// otherwise: [`World::play`] does all of it.
    ///
    /// Set-up and steps take the threads of the current `rayon` pool; `ThreadPool::install` chooses another. Steps that are
    /// taken within it keep its threads awake; from outside, each pass waits until they wake. Set-up cannot be
    /// cancelled and takes 20 s to a minute for 1e6 nodes, so a program that must answer gives it a thread of its own.
    ///
    /// # Errors
    /// [`WorldError`] with the value of the scene or the body at fault.
    pub fn new(scene: Scene) -> Result<Self, WorldError> {
        Self::with(scene, Body::new)
    }

    /// As [`World::new`], with the nodes of the bodies partitioned: shares estimate the eigenvalue from which the step is
    /// chosen and take all steps. Until they have their nodes, their owners wait: `builders` are the threads that
    /// build the body meanwhile. What the world or its bodies are asked for is brought from the shares.
    ///
    /// # Errors
    /// As [`World::new`], and with [`BodyProblem::NotShared`] if the scene has something that is not shared out, more
    /// than one body included.
    pub fn new_shared(
        scene: Scene,
        shares: Arc<Mutex<dyn BodyShares>>,
        builders: &rayon::ThreadPool,
    ) -> Result<Self, WorldError> {
        Self::with(scene, |scene, description| {
            let shared = Body::shared(scene, description, shares.clone(), builders);
            in_body(shared, &description.name)
        })
    }

    fn with(
        scene: Scene,
        body: impl Fn(&Scene, &scene::Body) -> Result<Body, WorldError>,
    ) -> Result<Self, WorldError> {
        let refused = |fault| WorldError::Scene {
            name: scene.name.clone(),
            fault: Box::new(fault),
        };
        scene.validate().map_err(refused)?;
        let mut phases = Phases::default();
        let bodies = phases.time(Phase::Setup, || {
            let bodies = scene.bodies.iter();
            let bodies = bodies.map(|description| body(&scene, description));
            bodies.collect::<Result<Vec<_>, WorldError>>()
        })?;
        let deformable = phases.time(Phase::Setup, || DeformableBodies::new(&scene, &bodies))?;
        let mut checks = Checks::default();
        checks.each("cuts", &scene.cuts, |checks, cut| {
            cut.check_capture(checks, finest_spacing(cut, &bodies));
        });
        checks.first().map_err(refused)?;
        let cuts = scene.cuts.iter();
        let captures = cuts.map(|cut| cut.capture_times(finest_spacing(cut, &bodies)));
        let captures = captures.collect();
        let mut world = Self {
            now: Standing {
                gravity: scene.gravity.as_ref().map(|_| DVec3::ZERO),
                ..Standing::default()
            },
            input: InputSource::of(&scene, captures),
            scene,
            bodies,
            deformable: deformable.map(Box::new),
            first_step: 0.0,
            phases,
            waiting: None,
            latencies: Vec::new(),
            new_pieces: Vec::new(),
        };
        world.first_step = world.smallest_step_size();
        world.now.step = world.first_step;
        world.check_step_count()?;
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
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// Positions (m) of a body's nodes, as [`World::bodies`] counts them, to be drawn, written and measured: see
    /// [`Body::smoothed_positions`].
    ///
    /// # Panics
    /// If there is no such body.
    #[must_use]
    pub fn positions(&self, body: usize) -> Vec<DVec3> {
        self.bodies[body].smoothed_positions()
    }

    /// Time (s) since the first step, settling included.
    #[must_use]
    pub fn time(&self) -> f64 {
        let first = self.bodies.first();
        first.map_or(0.0, Body::time)
    }

    /// Scene time (s); `None` while settling.
    #[must_use]
    pub fn scene_time(&self) -> Option<f64> {
        self.now.origin.map(|origin| self.time() - origin)
    }

    /// Step (s).
    #[must_use]
    pub fn step_size(&self) -> f64 {
        self.now.step
    }

    /// Step (s) that was chosen for the uncut bodies.
    #[must_use]
    pub fn first_step(&self) -> f64 {
        self.first_step
    }

    /// Steps taken, settling included.
    #[must_use]
    pub fn steps(&self) -> u64 {
        let first = self.bodies.first();
        first.map_or(0, Body::steps)
    }

    /// Stopwatches; the run loop adds its own phases here too.
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

    /// Whether [`World::take_new_pieces`] would return any.
    #[must_use]
    pub fn has_new_pieces(&self) -> bool {
        !self.new_pieces.is_empty()
    }

    /// Settles, unless the scene has started, and plays it until scene time `until` (s); `each` sees
    /// the world after every step of the scene.
    ///
    /// # Errors
    /// As [`World::settle`].
    ///
    /// # Examples
    /// ```
    /// use phyxel::scene::{Body, Region, Scene, Shape, Support, Target};
    /// use phyxel::World;
    /// use phyxel::glam::DVec3;
    ///
    /// let mut body = Body::new(Shape::Box { size: DVec3::splat(0.1) });
    /// body.sampling.target = Target::Nodes(285);
    /// let mut scene = Scene::new("hanging", vec![body]);
    /// let top = Region::HalfSpace { point: DVec3::Z * 0.049, normal: DVec3::Z };
    /// scene.supports.push(Support::fixed(top));
    /// let mut steps = 0;
    /// World::new(scene)?.play(0.1, |world| {
    ///     steps += 1;
    ///     assert!(world.scene_time().is_some());
    /// })?;
    /// assert!(steps > 10);
    /// # Ok::<(), phyxel::WorldError>(())
    /// ```
    pub fn play(&mut self, until: f64, mut each: impl FnMut(&Self)) -> Result<(), WorldError> {
        self.settle()?;
        while self.scene_time().is_some_and(|time| time < until) {
            self.step()?;
            each(self);
        }
        Ok(())
    }

    /// From the next step on, tools and blades do what they are given and no longer what the scene's
    /// paths say: a recording, or what someone does now. Steps are counted as [`World::steps`] does;
    /// what is given for a step that is past is done at the next. A tool stays where it was driven last.
    ///
    /// # Errors
    /// [`InputError`]; nothing is taken then.
    pub fn push(&mut self, inputs: Vec<Input>) -> Result<(), InputError> {
        self.input.push(&self.scene, inputs)
    }

    /// What tools and blades did so far; `None` unless the scene's `observe.input` asks for a record.
    #[must_use]
    pub fn record(&self) -> Option<&[Input]> {
        self.input.state.record.as_deref()
    }

    /// Forces on the tools at the end of the last step, in the scene's order.
    #[must_use]
    pub fn tool_forces(&self) -> Vec<ToolForce> {
        let forces = (0..self.scene.tools.len()).map(|index| {
            let pose = self.input.state.poses[index];
            let mut sum = ToolForce {
                pose,
                ..ToolForce::default()
            };
            for contact in self.bodies.iter().flat_map(|body| &body.contacts) {
                if contact.tool == index {
                    contact.add_to(&mut sum);
                }
            }
            sum
        });
        forces.collect()
    }

    /// Contact at the end of the last step between any two bodies that are near each other, and of each with itself; and
    /// its sums of energy. `None` unless the scene asks for it.
    #[must_use]
    pub fn body_contact(&self) -> Option<(&[DeformableForce], &DeformableState)> {
        let contact = self.deformable.as_ref();
        contact.map(|contact| (contact.contact.between(), contact.contact.state()))
    }

    /// Pressure (Pa) of bodies and flanks at each node of a body ([`phyxel_integrate::DeformableContact::pressures`]);
    /// `None` unless the scene asks for their contact.
    ///
    /// # Panics
    /// If there is no such body.
    #[must_use]
    pub fn contact_pressures(&self, body: usize) -> Option<Vec<f64>> {
        let contact = self.deformable.as_ref();
        contact.map(|contact| contact.pressures(&self.bodies, body))
    }

    /// Pressure (Pa) of tools at each node of a body, the largest of all tools ([`phyxel_integrate::Contact::pressures`]).
    ///
    /// # Panics
    /// If there is no such body.
    #[must_use]
    pub fn tool_pressures(&self, body: usize) -> Vec<f64> {
        let body = &self.bodies[body];
        let mut largest = vec![0.0; body.rest.len()];
        for tool in &body.contacts {
            let pressures = tool.rigid.contact.pressures(largest.len());
            (largest.iter_mut().zip(pressures))
                .for_each(|(most, one)| *most = f64::max(*most, one));
        }
        largest
    }

    /// Takes one step: blades first, then what tears, then motion with the tools.
    ///
    /// # Errors
    /// [`WorldError`] if a blade's edge cannot be captured, a motion diverges, or the bodies have
    /// settled for as long as they may and nobody started the scene. A capture that cannot be computed changes
    /// nothing: the world is as it was before it, and the next step tries it again. Only a bug makes it fail where it is applied,
    /// and leaves the body half cut.
    pub fn step(&mut self) -> Result<(), WorldError> {
        if let Some(settle) = self.scene.integration.settle.filter(|_| self.has_settled()) {
            let limit = settle.limit;
            return Err(WorldError::NeverStarted { limit });
        }
        let number = self.steps();
        if self.bodies.len() > 1
            && self.deformable.is_none()
            && number.is_multiple_of(StepControl::STEPS)
        {
            self.watch_overlaps();
        }
        self.capture_blades(number)?;
        self.tear(number)?;
        self.hold(number)?;
        let step = self.next_step();
        let end = self.scene_time().map(|now| now + step);
        let poses = self.input.tools(&self.scene, number, end);
        self.advance_safely(step, &poses)?;
        self.watch_depths();
        self.input.state.poses = poses;
        if let Some(since) = self.waiting.take() {
            self.latencies.push(1e3 * since.elapsed().as_secs_f64());
        }
        Ok(())
    }

    /// Whether the scene's duration is over, up to round-off.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.time_left()
            .is_some_and(|left| left <= self.time_round_off())
    }

    /// Scene time (s) that is left; `None` before the scene starts.
    fn time_left(&self) -> Option<f64> {
        Some(self.scene.integration.duration - self.scene_time()?)
    }

    /// How far (s) sums of steps may be off.
    fn time_round_off(&self) -> f64 {
        1e-12 * self.time()
    }

    /// The next step (s): the last one ends where the scene does, and steps longer than the time between
    /// two rows of the history end at the rows.
    fn next_step(&self) -> f64 {
        let mut step = self.now.step;
        let rate = self.scene.observe.history_rate;
        if step * rate > 1.0 {
            let done = (self.time() * rate * (1.0 + 1e-12)).floor();
            step = step.min((done + 1.0) / rate - self.time());
        }
        // A step that ends there but for round-off stays as it is, so that a recording repeats it bitwise.
        let off = self.time_round_off();
        match self.time_left() {
            Some(left) if left > off && left < step - off => left,
            _ => step,
        }
    }

    /// Stretches of steps that were retried.
    #[must_use]
    pub fn retaken(&self) -> Retaken {
        self.now.retaken
    }

    fn smallest_step_size(&self) -> f64 {
        let steps = self.bodies.iter().map(|body| body.step_size());
        steps.fold(f64::INFINITY, f64::min) / self.now.control.divisor
    }
}

#[cfg(test)]
mod testing {
    use super::{Scene, World};
    use crate::scene::{Target, embedded};

    /// An embedded scene of few nodes in its first body that begins at once and is not drawn.
    pub(crate) fn small(name: &str, nodes: u32) -> Scene {
        let mut scene = embedded(name, &[]).expect("it is there");
        scene.bodies[0].sampling.target = Target::Nodes(nodes);
        scene.integration.settle = None;
        scene.pictures = None;
        scene
    }

    /// Two worlds are bitwise the same after so many steps of each.
    pub(crate) fn assert_alike(one: &mut World, other: &mut World, steps: usize) {
        for _ in 0..steps {
            one.step().unwrap();
            other.step().unwrap();
        }
        assert!(bytes(one) == bytes(other), "bitwise");
    }

    /// All of a world's state.
    pub(crate) fn bytes(world: &World) -> Vec<u8> {
        postcard::to_stdvec(&world.state()).expect("it can be written")
    }
}
