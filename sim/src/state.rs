//! A world's state, to be kept and resumed from.
//!
//! A scene says how bodies are built; what it does not say is where their nodes are, and what blades
//! have done. Of a blade only what it added to the cut is kept, in the material: capturing that again
//! gives the same cut, factors and rows, bit for bit.

use std::sync::Arc;

use glam::DVec3;
use phyxel_integrate::{DeformableState, StepControl};
use serde::{Deserialize, Serialize};

use crate::body_state::BodyState;
use crate::cut_state::CapturedEdge;
use crate::error::{BodyProblem, WorldError, in_body};
use crate::grip::Adjusted;
use crate::guard::{Kept, Retaken};
use crate::input::InputState;
use crate::{Body, CutPiece, World};

/// All of a world that its scene does not say, and nothing that a clock said: two runs of a scene give the same state.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct WorldState {
    now: Standing,
    input: InputState,
    bodies: Vec<BodyState>,
    pub(crate) contact: Option<DeformableState>,
}

/// Where a world stands, beside its bodies and inputs.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Standing {
    /// Motion time (s) at which scene time is 0; `None` while settling.
    pub(crate) origin: Option<f64>,
    pub(crate) gravity: Option<DVec3>,
    /// Every captured edge; copies of a world share them.
    pub(crate) captured: Vec<Arc<CapturedEdge>>,
    /// Where to return to if a step fails; none that is of another model, or of another part of the scene.
    pub(crate) kept: Option<Kept>,
    /// Divisor of the step after steps that failed.
    pub(crate) control: StepControl,
    pub(crate) step: f64,
    pub(crate) retaken: Retaken,
    /// What users changed of what the scene says.
    pub(crate) adjusted: Adjusted,
    /// What was told at once, each once.
    pub(crate) alarms: Vec<String>,
    /// The step from which on all are below a hundredth of the first.
    pub(crate) short_since: Option<u64>,
}

impl World {
    /// The state between two steps. Pieces that [`World::take_new_pieces`] has not handed out count
    /// as handed out.
    #[must_use]
    pub fn state(&self) -> WorldState {
        WorldState {
            now: self.standing(),
            input: self.input.state.clone(),
            bodies: self.bodies.iter().map(Body::state).collect(),
            contact: (self.deformable.as_ref()).map(|contact| contact.contact.state().clone()),
        }
    }

    /// Where it stands, with what partitions of bodies have of the snapshot.
    pub(crate) fn standing(&self) -> Standing {
        let mut now = self.now.clone();
        let kept = now.kept.iter_mut().flat_map(|kept| &mut kept.bodies);
        for (body, state) in self.bodies.iter().zip(kept) {
            body.fetch_kept(state);
        }
        now
    }

    /// Brings a new world into a state that [`World::state`] gave. `grown` sees the pieces of cuts
    /// as the first run saw them, with the world's cuts as they were then.
    ///
    /// # Errors
    /// [`WorldError`] with [`BodyProblem::OtherBody`] if a body is not built as it was, with
    /// [`BodyProblem::Damaged`] if the state has a number or a length that it cannot have, and whatever
    /// capturing an edge returns. The world is then good for nothing.
    pub fn restore(
        &mut self,
        state: WorldState,
        mut grown: impl FnMut(&Self, &[CutPiece]),
    ) -> Result<(), WorldError> {
        self.check(&state)?;
        let now = &state.now;
        self.now.adjusted = now.adjusted;
        for (k, edge) in now.captured.iter().enumerate() {
            self.capture_again(edge)?;
            let next = now.captured.get(k + 1);
            if next.is_none_or(|next| next.steps != edge.steps) {
                let pieces = self.take_new_pieces();
                if !pieces.is_empty() {
                    grown(self, &pieces);
                }
            }
        }
        match (now.origin, self.now.origin) {
            (Some(start), None) => self.start_scene_at(start)?,
            // It started as it was built: no state has the damping of what moves.
            (Some(_), Some(_)) => self.set_damping(None)?,
            (None, _) => {}
        }
        for (body, kept) in self.bodies.iter_mut().zip(&state.bodies) {
            body.weaken_again(&kept.elastic.deficient);
        }
        self.check_numbers(&state)?;
        // Before the first step a new world is as it was then. To rewind is to evaluate, which the first step's size had not
        // seen.
        let is_moved = |body: &BodyState| body.motion.steps > 0;
        if !now.captured.is_empty() || state.bodies.iter().any(is_moved) {
            self.rewind(now.gravity, state.bodies, state.contact)?;
        }
        self.now = state.now;
        self.input.state = state.input;
        Ok(())
    }

    /// What is known before the edges are captured.
    fn check(&self, state: &WorldState) -> Result<(), WorldError> {
        let finite = |value: Option<f64>| value.is_none_or(f64::is_finite);
        let bodies = self.bodies.len();
        let now = &state.now;
        let cuts = now.captured.iter().all(|edge| {
            edge.body < bodies && edge.cut <= self.scene.cuts.len() && edge.sweep.is_finite()
        });
        let adjusted = now.adjusted;
        let times = finite(now.origin) && finite(adjusted.damping);
        let gravity = [now.gravity, adjusted.gravity];
        let gravity = gravity.iter().flatten().all(|g| g.is_finite());
        let steps = now.control.is_sound() && now.step > 0.0 && now.step.is_finite();
        let inputs = self.input.fits(&state.input, &self.scene);
        let sound = [
            (state.bodies.len() == bodies, "its bodies"),
            (cuts, "its edges of blades"),
            (times, "its times or rates"),
            (gravity, "its values of gravity"),
            (steps, "its shortened steps"),
            (inputs, "its tools and inputs"),
        ];
        if let Some((_, what)) = sound.iter().find(|(sound, _)| !sound) {
            return Err(self.damaged(0, what));
        }
        for (index, body) in self.bodies.iter().enumerate() {
            let kept = state.bodies.get(index);
            if !kept.is_none_or(|kept| kept.cut.is_sound(body.rest.len())) {
                return Err(self.damaged(index, "its blades"));
            }
            if kept.is_none_or(|kept| kept.fingerprint != body.fingerprint) {
                return Err(BodyProblem::OtherBody.of(&body.name));
            }
        }
        Ok(())
    }

    /// What a body with its cuts has to say of its state.
    fn check_numbers(&self, state: &WorldState) -> Result<(), WorldError> {
        for (index, (body, kept)) in self.bodies.iter().zip(&state.bodies).enumerate() {
            if !kept.fits(body) {
                return Err(self.damaged(index, "numbers of its nodes"));
            }
        }
        let tools = self.input.state.poses.len();
        let kept = state.now.kept.as_ref();
        let touches = |contact: Option<&DeformableState>| match (&self.deformable, contact) {
            (Some(built), Some(contact)) => built.fits(contact),
            (built, contact) => built.is_none() && contact.is_none(),
        };
        if !touches(state.contact.as_ref()) {
            return Err(self.damaged(0, "numbers of contact between bodies"));
        }
        let sound =
            |kept: &Kept| kept.is_sound(&self.bodies, tools) && touches(kept.contact.as_ref());
        if !kept.is_none_or(sound) {
            return Err(self.damaged(0, "numbers of the state to return to"));
        }
        Ok(())
    }

    fn damaged(&self, body: usize, what: &'static str) -> WorldError {
        BodyProblem::Damaged(what).of(&self.bodies[body].name)
    }

    /// Goes back to what moved, with the cuts that bodies have now.
    pub(crate) fn rewind(
        &mut self,
        gravity: Option<DVec3>,
        bodies: Vec<BodyState>,
        contact: Option<DeformableState>,
    ) -> Result<(), WorldError> {
        self.set_gravity(gravity)?;
        for (body, state) in self.bodies.iter_mut().zip(bodies) {
            body.set_state(state);
        }
        if let (Some(contact), Some(state)) = (&mut self.deformable, contact) {
            let bound = contact.restore(state);
            for body in &mut self.bodies {
                body.contact_eigenvalue = bound;
            }
        }
        Ok(())
    }

    fn capture_again(&mut self, edge: &CapturedEdge) -> Result<(), WorldError> {
        let body = &mut self.bodies[edge.body];
        let update = body.replay(edge);
        let update = in_body(update, &body.name)?;
        self.take_note(edge.body, update)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{PronyTerm, Scene, embedded};
    use crate::testing::{assert_alike, bytes, small};
    use crate::{Action, Input, StrokePhase};

    /// A scene with few nodes and viscosity.
    fn viscous(name: &str) -> Scene {
        let mut scene = small(name, 200);
        scene.bodies[0].material.viscosity = vec![PronyTerm {
            ratio: 0.5,
            relaxation_time: 0.01,
        }];
        scene
    }

    /// A liver with a tool.
    fn world() -> World {
        World::new(viscous("press")).unwrap()
    }

    /// Which nodes a cut leaves without a strain of their own depends on where a soft body's nodes are then.
    #[test]
    fn a_soft_body_that_was_cut_while_stretched_continues_bitwise() {
        let mut scene = small("block", 250);
        scene.bodies[0].material.youngs_modulus = 600.0;
        let mut whole = World::new(scene.clone()).unwrap();
        for _ in 0..800 {
            whole.step().unwrap();
        }
        let state = whole.state();
        let mut again = World::new(scene.clone()).unwrap();
        for edge in &state.now.captured {
            again.capture_again(edge).unwrap();
        }
        let count = |world: &World| world.bodies[0].elastic().deficient_nodes().len();
        assert!(count(&again) < count(&whole), "the motion had a say");
        let mut again = World::new(scene).unwrap();
        again.restore(state, |_, _| ()).unwrap();
        assert_alike(&mut whole, &mut again, 100);
    }

    type Damage = fn(&mut WorldState);

    #[test]
    fn a_damaged_state_is_refused_and_a_valid_one_continues_bitwise() {
        let mut whole = world();
        for _ in 0..60 {
            whole.step().unwrap();
        }
        // As chosen last, which need not be what the stiffness of now gives.
        whole.now.step *= 0.9;
        let state = whole.state();
        let mut again = world();
        again.restore(state.clone(), |_, _| ()).unwrap();
        assert_alike(&mut whole, &mut again, 60);

        let damages: [(&str, Damage); 17] = [
            ("a position", |s| {
                s.bodies[0].motion.positions[3].x = f64::NAN;
            }),
            ("positions", |s| s.bodies[0].motion.positions.truncate(9)),
            ("forces", |s| s.bodies[0].motion.forces.truncate(9)),
            ("an energy", |s| {
                s.bodies[0].motion.audit.elastic = f64::INFINITY;
            }),
            ("a time", |s| s.bodies[0].motion.time = f64::NAN),
            ("estimates", |s| {
                s.bodies[0].stiffness.estimates[0] = f64::NAN;
            }),
            ("a vector", |s| s.bodies[0].eigenvector.truncate(3)),
            ("history", |s| s.bodies[0].elastic.viscosity.clear()),
            ("offsets", |s| {
                s.bodies[0].elastic.offsets.push((1 << 30, ([0.0; 9], 0.0)));
            }),
            ("bonds", |s| s.bodies[0].elastic.bonds.push(0.0)),
            ("control", |s| s.bodies[0].elastic.control.push((0, 0.5))),
            ("a front", |s| {
                s.bodies[0].elastic.fronts.push((0, glam::DMat3::IDENTITY));
            }),
            ("contacts", |s| s.bodies[0].contacts.clear()),
            ("bodies", |s| s.bodies.clear()),
            ("steps", |s| s.now.control.divisor = 0.0),
            ("steps", |s| s.now.step = f64::NAN),
            ("gravity", |s| s.now.gravity = Some(DVec3::NAN)),
        ];
        for (what, damage) in damages {
            let mut broken = state.clone();
            damage(&mut broken);
            let refused = world().restore(broken, |_, _| ()).unwrap_err();
            let problem = match &refused {
                WorldError::Body { problem, .. } => Some(problem),
                _ => None,
            };
            let damaged = matches!(problem, Some(BodyProblem::Damaged(_)));
            assert!(damaged, "{what}: {refused}");
            let mut body = state.clone();
            damage(&mut body);
            let mut broken = state.clone();
            if let (Some(kept), Some(body)) = (&mut broken.now.kept, body.bodies.pop()) {
                kept.bodies = vec![body];
                let result = world().restore(broken, |_, _| ());
                let same = ["steps", "gravity"].contains(&what);
                assert_eq!(result.is_ok(), same, "kept: {what}");
            }
        }
    }

    /// Two blocks that one blade cuts, the second with viscosity.
    fn blocks() -> World {
        let mut scene = viscous("block");
        scene.observe.input = true;
        let mut first = scene.bodies[0].clone();
        first.name = "first".to_owned();
        first.material.viscosity.clear();
        scene.bodies.insert(0, first);
        for cut in &mut scene.cuts {
            cut.body = None;
        }
        World::new(scene).unwrap()
    }

    /// Edges of a blade that goes through the blocks, one for each of the steps from `start` on.
    fn edges(start: u64) -> Vec<Input> {
        let edge = |x: f64| vec![DVec3::new(x, -0.06, 0.0), DVec3::new(x, 0.06, 0.0)];
        let inputs = (0..10).map(|k| {
            let phase = match k {
                0 => StrokePhase::Start,
                9 => StrokePhase::End,
                _ => StrokePhase::Update,
            };
            let edge = edge(-0.06 + 0.008 * k as f64);
            let action = Action::Blade {
                cut: 0,
                phase,
                edge,
            };
            let step = start + k;
            Input { step, action }
        });
        inputs.collect()
    }

    /// Wherever a capture fails, of the first edge of a stroke or of a later one, and although the first body has
    /// it, all is as before; once its cause is gone, the same cut is made, bit for bit.
    #[test]
    fn a_capture_that_fails_changes_nothing() {
        let mut sound = blocks();
        for _ in 0..3 {
            sound.step().unwrap();
        }
        sound.push(edges(3)).unwrap();
        let mut world = sound.clone();
        for step in 0..12 {
            if [0, 1, 6, 9].contains(&step) {
                let motion = world.bodies[1].whole.motion_mut();
                let state = motion.state().clone();
                let mut broken = state.clone();
                broken.positions[0] = DVec3::NAN;
                motion.restore(broken);
                let before = bytes(&world);
                for _ in 0..2 {
                    let error = world.step().unwrap_err();
                    assert!(matches!(&error, WorldError::Body { .. }), "{error}");
                    assert_eq!(bytes(&world), before, "capture {step}");
                }
                world.bodies[1].whole.motion_mut().restore(state);
            }
            assert_alike(&mut world, &mut sound, 1);
        }
        for body in world.bodies() {
            let cutting = body.cutting.as_ref().unwrap();
            assert!(cutting.severed_pairs() > 10, "{}", cutting.severed_pairs());
        }
    }

    /// Users changed the damping of a scene that does not settle.
    #[test]
    fn damping_that_users_set_is_part_of_the_state() {
        let mut world = World::new(viscous("press")).unwrap();
        let action = Action::Damping { rate: 40.0 };
        world.push(vec![Input { step: 0, action }]).unwrap();
        for _ in 0..20 {
            world.step().unwrap();
        }
        let mut again = World::new(viscous("press")).unwrap();
        again.restore(world.state(), |_, _| ()).unwrap();
        assert_alike(&mut world, &mut again, 20);
    }

    #[test]
    fn a_state_of_before_the_first_step_continues_bitwise() {
        let mut scene = small("liver", 300);
        scene.integration.settle = embedded("liver", &[]).unwrap().integration.settle;
        let mut world = World::new(scene.clone()).unwrap();
        let mut again = World::new(scene).unwrap();
        again.restore(world.state(), |_, _| ()).unwrap();
        assert_alike(&mut world, &mut again, 20);
    }

    /// The scene has no cut; a new world of it goes on bitwise from the state of one that a program cut.
    #[test]
    fn a_cut_of_the_program_is_part_of_the_state() {
        let mut scene = blocks().scene().clone();
        scene.cuts.clear();
        let mut world = World::new(scene.clone()).unwrap();
        let uncut = world.clone();
        let mut changes = 0;
        for input in edges(0) {
            if let Action::Blade { phase, edge, .. } = input.action {
                changes += usize::from(world.cut(phase, &edge).unwrap());
                world.step().unwrap();
            }
        }
        assert!(changes > 3, "{changes}");
        let bad = world.cut(StrokePhase::Start, &[DVec3::ZERO]);
        assert!(matches!(bad, Err(WorldError::BadEdge)), "{bad:?}");
        let mut again = World::new(scene).unwrap();
        again.restore(world.state(), |_, _| ()).unwrap();
        assert_alike(&mut world, &mut again, 10);
        assert_ne!(world.positions(1), uncut.positions(1));
        for (body, uncut) in world.bodies().iter().zip(uncut.bodies()) {
            let cutting = body.cutting.as_ref().unwrap();
            assert!(cutting.severed_pairs() > 10, "{}", cutting.severed_pairs());
            assert!(uncut.cutting.is_none());
        }
    }
}
