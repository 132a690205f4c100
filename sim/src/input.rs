//! The input of the world, step by step: tools and blades as a scene's paths move them, as a
//! recording has it, or as a program gives it.

use std::collections::VecDeque;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::scene::{Pose, Scene};

/// When in a stroke the edge is captured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum StrokePhase {
    /// The stroke starts.
    Start,
    /// The blade has moved.
    Update,
    /// The stroke ends.
    End,
}

/// One action of a user.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Action {
    /// Moves a tool; it stays there until the next of these.
    Tool {
        /// Index of the scene's tool.
        tool: usize,
        /// Where it is at the end of the step.
        pose: Pose,
    },
    /// Takes up a blade's edge.
    Blade {
        /// Index of the scene's cut.
        cut: usize,
        /// When in the stroke.
        phase: StrokePhase,
        /// Points of the edge in the world (m).
        edge: Vec<DVec3>,
    },
    /// Grips the nodes around a point, instead of those gripped before.
    Grip {
        /// The point (m), in the world.
        point: DVec3,
        /// Distance (m) up to which nodes are held.
        radius: f64,
    },
    /// Moves the grip.
    Pull {
        /// How far (m) it is from where it gripped, at the end of the step.
        by: DVec3,
    },
    /// Releases the grip.
    LetGo,
    /// Replaces the scene's gravity.
    Gravity {
        /// Acceleration (m/s²).
        acceleration: DVec3,
    },
    /// Replaces the bodies' damping once settled.
    Damping {
        /// Mass-proportional damping (1/s).
        rate: f64,
    },
}

/// An action and the step that it belongs to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// Steps that were taken before, settling included.
    pub step: u64,
    /// What is done.
    pub action: Action,
}

/// An input that cannot be done.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// There is no such tool or cut in the scene.
    #[error("input {index}: the scene has {count} {what}, so there is none of index {asked}")]
    NoSuch {
        /// Which of the inputs.
        index: usize,
        /// "tools" or "cuts".
        what: &'static str,
        /// The index it names.
        asked: usize,
        /// How many there are.
        count: usize,
    },
    /// A position or number is not finite, a rotation none, a radius or damping negative, or an edge has
    /// fewer than two points.
    #[error(
        "input {index}: places must be finite, rotations of unit length, edges two points long, radii \
         and damping not negative"
    )]
    BadPlace {
        /// Which of the inputs.
        index: usize,
    },
    /// An input belongs to a step before that of the input before it.
    #[error("input {index}: step {step} comes after step {last}; inputs must be in order")]
    Order {
        /// Which of the inputs.
        index: usize,
        /// Its step.
        step: u64,
        /// The step before it.
        last: u64,
    },
}

impl Input {
    fn check(&self, scene: &Scene, index: usize) -> Result<(), InputError> {
        let sound = |sound: bool| ("", 0, 1, sound);
        let (what, asked, count, sound) = match &self.action {
            Action::Tool { tool, pose } => {
                let turned = (pose.rotation.length() - 1.0).abs() < 1e-6;
                let sound = turned && pose.position.is_finite();
                ("tools", *tool, scene.tools.len(), sound)
            }
            Action::Blade { cut, edge, .. } => {
                let sound = edge.len() >= 2 && edge.iter().all(|point| point.is_finite());
                ("cuts", *cut, scene.cuts.len(), sound)
            }
            Action::Grip { point, radius } => {
                sound(point.is_finite() && radius.is_finite() && *radius >= 0.0)
            }
            Action::Pull { by } => sound(by.is_finite()),
            Action::LetGo => sound(true),
            Action::Gravity { acceleration } => sound(acceleration.is_finite()),
            Action::Damping { rate } => sound(rate.is_finite() && *rate >= 0.0),
        };
        if asked >= count {
            return Err(InputError::NoSuch {
                index,
                what,
                asked,
                count,
            });
        }
        sound.then_some(()).ok_or(InputError::BadPlace { index })
    }
}

/// The inputs of tools and blades: from the scene or pushed by a program, with a record if one is asked for.
#[derive(Debug, Clone)]
pub(crate) struct InputSource {
    /// Captures of blades by the scene's paths, in order: scene time (s), cut, phase.
    due: Vec<(f64, usize, StrokePhase)>,
    pub(crate) state: InputState,
}

/// All of it that a scene does not say.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct InputState {
    /// The capture of the scene's that is due next; 0 once a program gives inputs.
    next: usize,
    /// What a program gave; then the scene's paths have no say.
    given: Option<VecDeque<Input>>,
    /// Where each tool is at the beginning of the step, and last how far the grip has moved.
    pub(crate) poses: Vec<Pose>,
    /// What was done so far, if the scene asks for a record.
    pub(crate) record: Option<Vec<Input>>,
}

impl InputSource {
    /// Of what the scene says, its cuts captured at these times (s).
    pub(crate) fn of(scene: &Scene, captures: Vec<Vec<f64>>) -> Self {
        let mut due = Vec::new();
        for (cut, times) in captures.into_iter().enumerate() {
            let last = times.len().saturating_sub(1);
            due.extend(times.into_iter().enumerate().map(|(k, time)| match k {
                0 => (time, cut, StrokePhase::Start),
                k if k == last => (time, cut, StrokePhase::End),
                _ => (time, cut, StrokePhase::Update),
            }));
        }
        due.sort_by(|(a, first, _), (b, second, _)| a.total_cmp(b).then(first.cmp(second)));
        let poses = scene.tools.iter().map(|tool| tool.pose_at(0.0));
        Self {
            due,
            state: InputState {
                next: 0,
                given: None,
                poses: poses.chain([Pose::IDENTITY]).collect(),
                record: scene.observe.input.then(Vec::new),
            },
        }
    }

    /// Of all paths.
    pub(crate) fn capture_count(&self) -> usize {
        self.due.len()
    }

    /// From now on only what is given is done.
    pub(crate) fn push(&mut self, scene: &Scene, inputs: Vec<Input>) -> Result<(), InputError> {
        let newest = self.state.given.as_ref().and_then(VecDeque::back);
        let mut last = newest.map_or(0, |input| input.step);
        for (index, input) in inputs.iter().enumerate() {
            input.check(scene, index)?;
            if input.step < last {
                let step = input.step;
                return Err(InputError::Order { index, step, last });
            }
            last = input.step;
        }
        self.state.next = 0;
        self.state.given.get_or_insert_default().extend(inputs);
        Ok(())
    }

    /// The next blade's edge that is due in a step that begins at a scene time (s), which is `None` while bodies
    /// settle. It stays due until [`InputSource::end_blade`].
    pub(crate) fn next_blade(
        &self,
        scene: &Scene,
        step: u64,
        time: Option<f64>,
    ) -> Option<(usize, StrokePhase, Vec<DVec3>)> {
        let Some(given) = &self.state.given else {
            let now = time.unwrap_or(f64::NEG_INFINITY);
            let next = self.due.get(self.state.next);
            let &(time, cut, phase) = next.filter(|(time, ..)| *time <= now)?;
            return Some((cut, phase, scene.cuts[cut].edge_at(time)));
        };
        let mut now = given.iter().take_while(|input| input.step <= step);
        now.find_map(|input| match &input.action {
            Action::Blade { cut, phase, edge } => Some((*cut, *phase, edge.clone())),
            _ => None,
        })
    }

    /// The blade's edge that was due next is captured.
    pub(crate) fn end_blade(
        &mut self,
        step: u64,
        cut: usize,
        phase: StrokePhase,
        edge: Vec<DVec3>,
    ) {
        let is_blade = |input: &Input| matches!(input.action, Action::Blade { .. });
        match &mut self.state.given {
            None => self.state.next += 1,
            Some(given) => {
                if let Some(at) = given.iter().position(is_blade) {
                    given.remove(at);
                }
            }
        }
        if let Some(record) = &mut self.state.record {
            let action = Action::Blade { cut, phase, edge };
            record.push(Input { step, action });
        }
    }

    /// What is gripped, pulled or changed in a step, in order.
    pub(crate) fn holds(&mut self, step: u64) -> Vec<Action> {
        let given = self.state.given.iter().flatten();
        let now = given.take_while(|input| input.step <= step);
        let other =
            |action: &&Action| !matches!(action, Action::Tool { .. } | Action::Blade { .. });
        let holds: Vec<Action> = now
            .map(|input| &input.action)
            .filter(other)
            .cloned()
            .collect();
        if let Some(record) = &mut self.state.record {
            let holds = holds.iter().cloned();
            record.extend(holds.map(|action| Input { step, action }));
        }
        holds
    }

    /// Where the tools are at the end of a step, whose end is at a scene time (s). Ends the step's
    /// input.
    pub(crate) fn tools(&mut self, scene: &Scene, step: u64, end: Option<f64>) -> Vec<Pose> {
        let InputState {
            given,
            poses: before,
            record,
            ..
        } = &mut self.state;
        let mut poses = before.clone();
        if let Some(given) = given {
            while given.front().is_some_and(|input| input.step <= step) {
                match given.pop_front().map(|input| input.action) {
                    Some(Action::Tool { tool, pose }) => poses[tool] = pose,
                    Some(Action::Pull { by }) => poses[scene.tools.len()].position = by,
                    _ => {}
                }
            }
        } else {
            for (pose, tool) in poses.iter_mut().zip(&scene.tools) {
                *pose = tool.pose_at(end.unwrap_or(0.0));
            }
        }
        if let Some(record) = record {
            let tools = before.iter().zip(&poses).take(scene.tools.len());
            for (tool, (before, pose)) in tools.enumerate() {
                if before != pose {
                    let action = Action::Tool { tool, pose: *pose };
                    record.push(Input { step, action });
                }
            }
        }
        poses
    }

    /// Whether a snapshot has as many poses as there are tools, and inputs that the scene knows.
    pub(crate) fn fits(&self, state: &InputState, scene: &Scene) -> bool {
        let given = state.given.iter().flatten();
        let inputs = given.chain(state.record.iter().flatten());
        state.poses.len() == self.state.poses.len()
            && (state.poses.iter()).all(|p| p.position.is_finite() && p.rotation.is_finite())
            && inputs
                .enumerate()
                .all(|(k, input)| input.check(scene, k).is_ok())
    }
}
