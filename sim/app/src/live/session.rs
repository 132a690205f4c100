//! The world with the users' tools in it, step by step.

mod blade;
mod lead;
mod record;
mod undo;

use std::collections::VecDeque;

use glam::DVec3;

use blade::Stroke;
use lead::PoseLead;
pub(super) use record::Recording;
use record::{Forces, Score};
use undo::Before;

use super::setting::{PARKED, prepare};
use crate::output::{OutputError, OutputFolder, input_csv, write_checkpoint};
use crate::picture::{Painter, PictureError};
use crate::run::RunState;
use phyxel::scene::{Pose, Scene, Settle};
use phyxel::{Action, CutPiece, Input, InputError, StrokePhase, World, WorldError};
use phyxel_scene::TextError;

/// Distance (node spacings) of a blade between two captures: half of a tetrahedron, as finely as a cut
/// can be distinguished.
const CAPTURE: f64 = 0.6;
/// Triangles of a cut by which surfaces grow at a time: a capture adds about 30, whose skin takes as long as
/// several steps, and a user is answered between two helpings.
const HELPING: usize = 8;
/// Files of a saved session: the scene, what users did, the state at the end, the score sheet.
pub(super) const SAVED: [&str; 4] = ["scene.ron", "input.csv", "state.checkpoint", "score.csv"];
/// A session that cannot start or continue.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The scene does not fit.
    #[error(transparent)]
    Scene(#[from] TextError),
    /// The world cannot be built, or a step failed.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The world cannot be drawn.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// An input does not belong to the scene.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// The grip.
#[derive(Debug)]
struct HeldGrip {
    from: DVec3,
    lead: PoseLead,
    radius: f64,
    gripped: bool,
    open: bool,
}

/// A scene with a user.
#[derive(Debug)]
pub struct Session {
    world: World,
    painter: Painter,
    /// Pieces of cuts that surfaces have still to grow by.
    lagging: VecDeque<CutPiece>,
    leads: Vec<PoseLead>,
    stroke: VecDeque<Stroke>,
    hand: Option<HeldGrip>,
    /// What is given with the next step beside tools and blades.
    pending: Vec<Action>,
    record: Vec<Input>,
    replay: Recording,
    /// The world as it was built.
    built: World,
    /// Where a reset leads.
    start: Before,
    /// Before each of the last strokes, the newest at the end.
    befores: VecDeque<Before>,
    strokes: usize,
    score: Score,
    forces: Forces,
    /// Displacements (m) of blade, tools and grip in this step.
    moved: [f64; 3],
}

impl Session {
    /// Builds the world of a scene, made ready for users.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn new(scene: &Scene) -> Result<Self, SessionError> {
        let scene = prepare(scene)?;
        let mut world = World::new(scene.clone())?;
        // Paths are left to users from here on.
        world.push(Vec::new())?;
        let pictures = scene.pictures.clone().unwrap_or_default();
        let painter = Painter::new(&world, &pictures)?;
        let leads = (0..scene.tools.len()).map(|tool| PoseLead::new(*world.tool_pose(tool)));
        let leads: Vec<PoseLead> = leads.collect();
        let start = Before::start(&world, &painter, &leads);
        Ok(Self {
            leads,
            built: world.clone(),
            world,
            painter,
            lagging: VecDeque::new(),
            stroke: VecDeque::new(),
            hand: None,
            pending: Vec::new(),
            record: Vec::new(),
            replay: Recording::default(),
            start,
            befores: VecDeque::new(),
            strokes: 0,
            score: Score::default(),
            forces: Forces::default(),
            moved: [0.0; 3],
        })
    }

    /// The world.
    #[must_use]
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The surfaces.
    #[must_use]
    pub fn painter(&self) -> &Painter {
        &self.painter
    }

    /// The surfaces, to draw them, and the world.
    pub fn drawing(&mut self) -> (&mut Painter, &World) {
        (&mut self.painter, &self.world)
    }

    /// Does what a recording of this scene says from here on; hands wait until it has ended.
    pub(super) fn replay(&mut self, recording: Recording) {
        self.replay = recording;
    }

    /// Whether a recording is played that has not ended.
    pub(super) fn is_replaying(&self) -> bool {
        self.world.steps() < self.replay.steps
    }

    /// Simulated time (s) at which the recording ends that is played; 0 without one.
    pub(super) fn recorded_time(&self) -> f64 {
        self.replay.time
    }

    /// What users did so far; the scene with this is the session, bit for bit.
    #[must_use]
    pub fn record(&self) -> &[Input] {
        &self.record
    }

    /// Whether bodies still come to rest.
    #[must_use]
    pub fn is_settling(&self) -> bool {
        self.world.scene_time().is_none()
    }

    /// Strokes so far, and how many of them can be undone.
    #[must_use]
    pub fn strokes(&self) -> (usize, usize) {
        (self.strokes, self.befores.len())
    }

    pub(super) fn score(&self) -> &Score {
        &self.score
    }

    pub(super) fn forces(&mut self) -> &mut Forces {
        &mut self.forces
    }

    /// Path length (m) of a blade between two captures.
    pub(crate) fn capture(&self) -> f64 {
        CAPTURE * self.spacing()
    }

    /// Smallest distance (m) of nodes of all bodies.
    pub(crate) fn spacing(&self) -> f64 {
        let bodies = self.world.bodies().iter();
        bodies
            .map(|body| body.spacing)
            .fold(f64::INFINITY, f64::min)
    }

    /// Puts a tool somewhere at once: a user takes it up, or lays it aside (`None`).
    pub fn put_tool(&mut self, tool: usize, pose: Option<Pose>) {
        if let Some(lead) = self.leads.get_mut(tool) {
            let pose = pose.unwrap_or(Pose::at(PARKED));
            *lead = PoseLead::new(pose);
            self.pending.push(Action::Tool { tool, pose });
        }
    }

    /// Sets where a tool shall go.
    pub fn lead_tool(&mut self, tool: usize, pose: Pose) {
        if let Some(lead) = self.leads.get_mut(tool) {
            lead.target = pose;
        }
    }

    /// Grips the surface within `radius` (m) of a point (m).
    pub fn grip(&mut self, point: DVec3, radius: f64) {
        self.hand = Some(HeldGrip {
            from: point,
            lead: PoseLead::new(Pose::at(point)),
            radius,
            gripped: false,
            open: false,
        });
    }

    /// Sets where the grip shall go.
    pub fn pull(&mut self, point: DVec3) {
        if let Some(hand) = &mut self.hand {
            hand.lead.target = Pose::at(point);
        }
    }

    /// Releases the grip.
    pub fn let_go(&mut self) {
        if let Some(hand) = &mut self.hand {
            hand.open = true;
        }
    }

    /// Sets gravity (m/s²) from the next step on.
    pub fn set_gravity(&mut self, acceleration: DVec3) {
        self.pending.push(Action::Gravity { acceleration });
    }

    /// Sets the mass-proportional damping (1/s) from the next step on.
    pub fn set_damping(&mut self, rate: f64) {
        self.pending.push(Action::Damping { rate });
    }

    /// Takes one step. Surfaces lag behind cuts until [`Session::grow`].
    ///
    /// # Errors
    /// [`SessionError`] if it is lost; [`Session::recover`] brings a good state back.
    pub fn step(&mut self) -> Result<(), SessionError> {
        let step = self.world.step_size();
        let number = self.world.steps();
        let actions = if self.is_replaying() {
            self.repeated(number)
        } else {
            if number > 0 && number == self.replay.steps && self.world.grip_force().is_some() {
                // Who gripped then holds no more.
                self.pending.push(Action::LetGo);
            }
            self.actions(step)
        };
        let inputs = actions.into_iter().map(|action| Input {
            step: number,
            action,
        });
        let inputs: Vec<Input> = inputs.collect();
        self.world.push(inputs.clone())?;
        self.record.extend(inputs);
        self.world.step()?;
        self.settle()?;
        self.observe(step);
        Ok(())
    }

    /// Whether there is a cut that surfaces do not show yet.
    pub(crate) fn surfaces_lag(&self) -> bool {
        !self.lagging.is_empty() || self.world.has_new_pieces()
    }

    /// Grows the surfaces by some of what was cut and they do not show yet: a few triangles, so that it takes
    /// no longer than some steps. The surfels of each body that may be other than before; nothing without a cut.
    ///
    /// # Errors
    /// [`SessionError`] if a piece of a cut is not finite.
    pub fn grow(&mut self) -> Result<Vec<Vec<u32>>, SessionError> {
        self.lagging.extend(self.world.take_new_pieces());
        let Some(next) = self.lagging.front_mut() else {
            return Ok(Vec::new());
        };
        let rest = next.triangles.split_off(HELPING.min(next.triangles.len()));
        let piece = CutPiece {
            body: next.body,
            triangles: std::mem::replace(&mut next.triangles, rest),
        };
        self.lagging.retain(|piece| !piece.triangles.is_empty());
        Ok(self.painter.grow(&self.world, &[piece])?)
    }

    /// What the recording does in a step.
    fn repeated(&mut self, step: u64) -> Vec<Action> {
        self.pending.clear();
        let inputs = &self.replay.inputs;
        let first = inputs.partition_point(|input| input.step < step);
        let now = inputs[first..].iter();
        let now = now.take_while(|input| input.step == step);
        let actions: Vec<Action> = now.map(|input| input.action.clone()).collect();
        for action in &actions {
            match action {
                Action::Tool { tool, pose } => self.leads[*tool] = PoseLead::new(*pose),
                Action::Blade {
                    phase: StrokePhase::Start,
                    ..
                } => {
                    let before = self.before();
                    self.remember(before);
                    self.strokes += 1;
                }
                _ => {}
            }
        }
        actions
    }

    /// What a user does in a step of `step` (s).
    fn actions(&mut self, step: f64) -> Vec<Action> {
        self.moved = [0.0; 3];
        let mut actions = std::mem::take(&mut self.pending);
        for (tool, lead) in self.leads.iter_mut().enumerate() {
            let before = lead.now.position;
            if let Some(pose) = lead.lead(step) {
                self.moved[1] = self.moved[1].max(before.distance(pose.position));
                actions.push(Action::Tool { tool, pose });
            }
        }
        let blade = self.lead_blade(step);
        actions.extend(blade.map(|(phase, edge)| Action::Blade {
            cut: 0,
            phase,
            edge,
        }));
        if let Some(hand) = &mut self.hand {
            if !hand.gripped {
                hand.gripped = true;
                actions.push(Action::Grip {
                    point: hand.from,
                    radius: hand.radius,
                });
            }
            let before = hand.lead.now.position;
            if let Some(Pose { position, .. }) = hand.lead.lead(step) {
                self.moved[2] = before.distance(position);
                let by = position - hand.from;
                actions.push(Action::Pull { by });
            } else if hand.open {
                actions.push(Action::LetGo);
                self.hand = None;
            }
        }
        actions
    }

    /// Ends settling when the bodies are at rest, as a run does.
    fn settle(&mut self) -> Result<(), SessionError> {
        if self.is_settling() && !self.world.is_settling() {
            self.world.start_scene()?;
            // What users did before is not part of the start: a reset goes back to before it.
            if self.record.is_empty() {
                self.start.world = self.world.state();
            }
        }
        Ok(())
    }

    fn observe(&mut self, step: f64) {
        let tools = self.world.tool_forces();
        let grip = self.world.grip_force();
        let felt = tools.iter().map(|tool| (tool.force, tool.penetration));
        let of_grip = (grip.unwrap_or(DVec3::ZERO), 0.0);
        let forces: Vec<(DVec3, f64)> = felt.chain([of_grip]).collect();
        for tool in &tools {
            self.score.peak[0] = self.score.peak[0].max(tool.force.length());
        }
        self.score.peak[1] = self.score.peak[1].max(grip.map_or(0.0, DVec3::length));
        self.forces.take(self.world.time(), &forces);
        let touching = tools.iter().any(|tool| tool.penetration > 0.0);
        let acting = [!self.stroke.is_empty(), touching, grip.is_some()];
        for (k, acting) in acting.into_iter().enumerate() {
            if acting {
                self.score.time[k] += step;
                self.score.path[k] += self.moved[k];
            }
        }
    }

    /// Writes the recording (`scene.ron` and `input.csv`: `phyxel run scene.ron --replay input.csv` repeats
    /// it), a checkpoint of the world and the score sheet; the files' names.
    ///
    /// # Errors
    /// [`SessionError::Output`].
    pub fn save(&self, folder: &OutputFolder) -> Result<Vec<String>, SessionError> {
        let mut scene = self.world.scene().clone();
        let integration = &mut scene.integration;
        // A run ends with the first step that reaches the duration; without one it ends where settling does.
        integration.duration = self.world.scene_time().unwrap_or(0.0);
        if self.is_settling() {
            let time = Some(self.world.time()).filter(|&time| time > 0.0);
            let settle = integration.settle.zip(time);
            integration.settle = settle.map(|(settle, limit)| Settle { limit, ..settle });
        }
        let duration = integration.duration;
        // Paths that nothing follows must end with the scene, too.
        for key in scene.cuts.iter_mut().filter_map(|cut| cut.path.last_mut()) {
            if duration > 0.0 {
                key.time = key.time.min(duration);
            }
        }
        let names = SAVED;
        folder.write(names[0], phyxel_scene::to_ron(&scene).as_bytes())?;
        folder.write(names[1], &input_csv(&scene, &self.record))?;
        write_checkpoint(folder, names[2], &scene, &RunState::of(&self.world))?;
        let severed: usize = self.severed_pairs();
        let rows = [
            ("simulated_time_s", format!("{:.4}", self.world.time())),
            ("steps", self.world.steps().to_string()),
            ("strokes", self.strokes.to_string()),
            ("severed_pairs", severed.to_string()),
        ];
        folder.write(names[3], self.score.csv(&rows).as_bytes())?;
        Ok(names.map(str::to_owned).to_vec())
    }

    /// Pairs of nodes that cuts severed.
    #[must_use]
    pub fn severed_pairs(&self) -> usize {
        let cuttings = self.world.bodies().iter().flat_map(|body| &body.cutting);
        cuttings.map(phyxel::Cutting::severed_pairs).sum()
    }
}
