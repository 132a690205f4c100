//! Steps that hold: the stable step follows the stiffness, the energy is monitored, and what went wrong
//! is rolled back and retried in shorter steps.
//!
//! A state is kept every few steps and after each capture. A step that diverges, or a stretch of steps
//! over which energy appears or is lost, is rolled back to it and retried in halves, quarters, eighths.
//! Only if that fails too the run ends.

use std::time::Instant;

use glam::DVec3;
use phyxel_integrate::{DeformableForce, DeformableState, Motion, RigidEnergies, StepControl};

use crate::World;
use crate::body::Body;
use crate::body_state::BodyState;
use crate::error::{BodyProblem, WorldError, in_body};
use crate::phases::Phase;
use crate::scene::Pose;
use crate::stiffness::PRODUCTS;
use crate::tool::ToolContact;

/// Products with the stiffness per estimate of the largest eigenvalue; it starts at the vector of the last.
const ESTIMATE_PRODUCTS: usize = 2;

/// A state to return to, and the steps taken since.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Kept {
    pub(crate) bodies: Vec<BodyState>,
    /// Energies of their pieces' rigid motions.
    rigid: Vec<RigidEnergies>,
    /// Contact between them.
    pub(crate) contact: Option<DeformableState>,
    gravity: Option<DVec3>,
    /// Where the tools were.
    poses: Vec<Pose>,
    /// Steps (s) taken since and where they moved the tools.
    taken: Vec<(f64, Vec<Pose>)>,
}

impl Kept {
    /// Whether it can be one of these bodies with so many tools.
    pub(crate) fn is_sound(&self, bodies: &[Body], poses: usize) -> bool {
        let finite = |rigid: &RigidEnergies| rigid.kinetic.is_finite() && rigid.lag.is_finite();
        let mut taken = self.taken.iter();
        let mut kept = self.bodies.iter().zip(bodies);
        [self.bodies.len(), self.rigid.len()] == [bodies.len(); 2]
            && self.rigid.iter().all(finite)
            && self.gravity.is_none_or(DVec3::is_finite)
            && self.poses.len() == poses
            && taken.all(|(step, to)| step.is_finite() && *step > 0.0 && to.len() == poses)
            && kept.all(|(kept, body)| kept.fits(body))
    }
}

/// What was retried.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Retaken {
    /// Stretches that were retried in shorter steps.
    pub stretches: u64,
    /// Those of them after which the energy was still off.
    pub unbalanced: u64,
}

/// Steps of a scene at most: years of the smallest body's.
const MOST_STEPS: f64 = 1e12;

impl World {
    /// Takes one step (s) from where tools are to `poses`, and does it again from the last snapshot if
    /// it fails.
    pub(crate) fn advance_safely(&mut self, step: f64, poses: &[Pose]) -> Result<(), WorldError> {
        let from = self.input.state.poses.clone();
        if self.scene.integration.scheme.step().is_some() {
            return self.advance_in_parts(step, 1, &from, poses);
        }
        if self.steps().is_multiple_of(StepControl::STEPS) {
            self.estimate_eigenvalues(ESTIMATE_PRODUCTS)?;
        }
        self.follow_stiffness()?;
        self.watch_step()?;
        if self.now.kept.is_none() {
            self.keep();
        }
        // Below it a run leads nowhere.
        let smallest = StepControl::smallest_step(self.first_step());
        let stable = self.check_step(smallest);
        let vanished = stable.is_err();
        let result = stable.and_then(|()| self.advance_in_parts(step, 1, &from, poses));
        let Some(kept) = &mut self.now.kept else {
            return result;
        };
        // A step that was chosen when it had vanished already, as after a cut, leads nowhere: it is not retried.
        if !vanished || step >= smallest {
            kept.taken.push((step, poses.to_vec()));
        }
        let due = kept.taken.len() as u64 >= StepControl::STEPS;
        let result = result.and_then(|()| if due { self.check_energy() } else { Ok(()) });
        match result {
            Err(error) => {
                self.retake(error)?;
                if vanished {
                    self.check_step(smallest)?;
                }
            }
            Ok(()) if due => self.now.control.recover(),
            Ok(()) => return Ok(()),
        }
        self.keep();
        Ok(())
    }

    /// Checks the steps since the last snapshot, however few, and does them again if need be: a capture changes the
    /// model, and a blade may be captured more often than energy is looked at.
    pub(super) fn end_stretch(&mut self) -> Result<(), WorldError> {
        self.check_energy().or_else(|error| self.retake(error))
    }

    /// Whether the stable step is above one (s) that leads nowhere.
    pub(crate) fn check_step(&self, smallest: f64) -> Result<(), WorldError> {
        let (first, step) = (self.first_step(), self.step_size());
        if step > smallest {
            return Ok(());
        }
        self.blame_stiffest(BodyProblem::StepVanishes { first, step })
    }

    /// Whether the scene can be stepped to its end in a lifetime.
    pub(crate) fn check_step_count(&self) -> Result<(), WorldError> {
        let step = self.first_step();
        let steps = self.scene.integration.duration / step;
        if steps <= MOST_STEPS {
            return Ok(());
        }
        self.blame_stiffest(BodyProblem::TooManySteps { steps, step })
    }

    fn blame_stiffest(&self, problem: BodyProblem) -> Result<(), WorldError> {
        let stiffest = self.stiffest_body();
        stiffest.map_or(Ok(()), |at| Err(problem.of(&self.bodies[at].name)))
    }

    /// Number of the body of largest eigenvalue.
    pub(crate) fn stiffest_body(&self) -> Option<usize> {
        let stiffness = |at: &usize| self.bodies[*at].current_eigenvalue();
        (0..self.bodies.len()).max_by(|a, b| stiffness(a).total_cmp(&stiffness(b)))
    }

    fn keep(&mut self) {
        self.now.kept = Some(Kept {
            rigid: self.bodies.iter().map(Body::rigid_energies).collect(),
            bodies: self.bodies.iter_mut().map(Body::keep).collect(),
            contact: (self.deformable.as_ref()).map(|contact| contact.contact.state().clone()),
            gravity: self.now.gravity,
            poses: self.input.state.poses.clone(),
            taken: Vec::new(),
        });
    }

    /// Does the steps since the last snapshot again, shorter.
    fn retake(&mut self, error: WorldError) -> Result<(), WorldError> {
        let Some(kept) = self.standing().kept else {
            return Err(error);
        };
        self.now.kept = None;
        self.now.retaken.stretches += 1;
        let mut last = error;
        for division in StepControl::DIVISIONS {
            self.now.control.shorten(division);
            match self.repeat(&kept, division) {
                Ok(()) => return Ok(()),
                Err(error) => last = error,
            }
        }
        match last {
            WorldError::Body {
                problem: BodyProblem::Unbalanced { share, .. },
                ..
            } if !StepControl::is_fatal(share) => {
                self.now.retaken.unbalanced += 1;
                Ok(())
            }
            WorldError::Body {
                body,
                problem: BodyProblem::Step(source),
            } => Err(BodyProblem::StepsFailed { source }.of(&body)),
            _ => Err(last),
        }
    }

    fn repeat(&mut self, kept: &Kept, division: u32) -> Result<(), WorldError> {
        self.rewind(kept.gravity, kept.bodies.clone(), kept.contact.clone())?;
        self.estimate_eigenvalues(PRODUCTS)?;
        let mut from = kept.poses.clone();
        for (step, to) in &kept.taken {
            self.follow_stiffness()?;
            self.advance_in_parts(*step, division, &from, to)?;
            from.clone_from(to);
        }
        self.check_energy_since(kept)
    }

    /// Takes a step (s) in so many parts, each as many times divided as keeps fast tools from passing through bodies.
    fn advance_in_parts(
        &mut self,
        step: f64,
        division: u32,
        start: &[Pose],
        end: &[Pose],
    ) -> Result<(), WorldError> {
        let mut start = start.to_vec();
        let count = division * self.parts_for_tools(step, division, &mut start, end);
        let part = step / f64::from(count);
        let mut from = start.clone();
        for k in 1..=count {
            let share = f64::from(k) / f64::from(count);
            let toward = |(a, b): (&Pose, &Pose)| if k == count { *b } else { a.toward(b, share) };
            let next: Vec<Pose> = start.iter().zip(end).map(toward).collect();
            if k > 1 {
                self.follow_stiffness()?;
            }
            self.advance(part, &from, &next)?;
            from = next;
        }
        Ok(())
    }

    /// Into how many parts each of so many of a step (s) is divided, so that no tool passes through a body from one
    /// to the next. A tool that was put where it is starts there.
    fn parts_for_tools(
        &mut self,
        step: f64,
        division: u32,
        start: &mut [Pose],
        end: &[Pose],
    ) -> u32 {
        let mut most = 1;
        for body in &mut self.bodies {
            for at in 0..body.contacts.len() {
                let ToolContact { tool, rigid, .. } = &body.contacts[at];
                let stride = rigid.stride(&start[*tool], &end[*tool], step, body.spacing);
                if stride.is_jump() {
                    start[*tool] = end[*tool];
                    continue;
                }
                let parts = stride.parts(division);
                if parts > most && stride.meets(body.motion().positions()) {
                    most = parts;
                }
            }
        }
        most
    }

    /// Chooses the step again where stiffness has changed.
    fn follow_stiffness(&mut self) -> Result<(), WorldError> {
        let start = Instant::now();
        let mut any = false;
        if let Some(contact) = &mut self.deformable
            && let Some(bound) = contact.new_bound(&self.bodies)
        {
            any = true;
            for body in &mut self.bodies {
                body.contact_eigenvalue = bound;
            }
        }
        for body in &mut self.bodies {
            any |= in_body(body.follow_stiffness(), &body.name)?;
        }
        if any {
            self.now.step = self.smallest_step_size();
            self.phases.add(Phase::Integration, start.elapsed());
        }
        Ok(())
    }

    /// Estimates the largest eigenvalues where the bodies are now and chooses the step again.
    pub(crate) fn estimate_eigenvalues(&mut self, products: usize) -> Result<(), WorldError> {
        let start = Instant::now();
        for body in &mut self.bodies {
            in_body(body.estimate_eigenvalue(products), &body.name)?;
        }
        self.now.step = self.smallest_step_size();
        self.phases.add(Phase::Integration, start.elapsed());
        Ok(())
    }

    fn check_energy(&self) -> Result<(), WorldError> {
        let kept = self.now.kept.as_ref();
        kept.map_or(Ok(()), |kept| self.check_energy_since(kept))
    }

    fn check_energy_since(&self, kept: &Kept) -> Result<(), WorldError> {
        let (mut moved, mut floor) = (0.0, 0.0);
        let before = kept.bodies.iter().zip(&kept.rigid);
        for (body, (before, rigid)) in self.bodies.iter().zip(before) {
            let rigid = [*rigid, body.rigid_energies()];
            let gained = |round_off| {
                let gained =
                    |motion: &Motion| motion.gained_since(&before.motion, rigid, round_off);
                body.whole.of_motion(gained)
            };
            // Round-off takes all positions.
            let is_off = gained(0.0).is_some();
            let round_off = if is_off || self.deformable.is_some() {
                body.energy_round_off()
            } else {
                0.0
            };
            if let Some(share) = gained(round_off) {
                let time = body.time();
                return Err(BodyProblem::Unbalanced { share, time }.of(&body.name));
            }
            let scale = |motion: &Motion| motion.audit().scale_since(&before.motion.audit, rigid);
            moved += body.whole.of_motion(scale);
            floor += round_off;
        }
        let Some((contact, before)) = self.deformable.as_ref().zip(kept.contact.as_ref()) else {
            return Ok(());
        };
        let hardest = |a: &&DeformableForce, b: &&DeformableForce| a.normal.total_cmp(&b.normal);
        let pair = contact.contact.between().iter().max_by(hardest);
        let share = contact.contact.state().gained_since(before, moved, floor);
        share.zip(pair).map_or(Ok(()), |(share, pair)| {
            let body = &self.bodies[pair.bodies[0] as usize];
            let time = body.time();
            Err(BodyProblem::Unbalanced { share, time }.of(&body.name))
        })
    }
}

impl Body {
    /// Energies of the rigid motions of pieces that nothing holds.
    fn rigid_energies(&self) -> RigidEnergies {
        if !self.whole.of_motion(Motion::has_free_pieces) {
            return RigidEnergies::default();
        }
        self.motion().rigid_energies()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::scene::{Capture, Cut, Key, Scene, Target, embedded};
    use crate::testing::small;

    fn stroke(path: [(f64, f64); 2]) -> Cut {
        let edge = [-0.06, 0.06].map(|y| DVec3::new(0.0, y, 0.02)).to_vec();
        let path = path.map(|(time, x)| Key::new(time, DVec3::X * x));
        Cut::new(edge, path.to_vec())
    }

    fn block(cuts: Vec<Cut>) -> World {
        World::new(scene(cuts)).unwrap()
    }

    fn scene(cuts: Vec<Cut>) -> Scene {
        let mut scene = small("block", 300);
        scene.cuts = cuts;
        scene
    }

    fn updates(world: &World) -> usize {
        let cutting = world.bodies[0].cutting.as_ref();
        cutting.map_or(0, |cutting| cutting.counts().1)
    }

    fn scale(world: &World) -> f64 {
        let audit = world.bodies()[0].motion().audit();
        audit.elastic.max(audit.kinetic)
    }

    /// A step beyond the limit lets a mode grow; that is seen, and the stretch is retried.
    #[test]
    fn a_step_beyond_the_limit_is_seen_and_taken_again() {
        let mut sound = block(Vec::new());
        let mut most = 0.0_f64;
        let until = 4.0 * StepControl::STEPS as f64 * sound.step_size();
        while sound.time() < until {
            sound.step().unwrap();
            most = most.max(scale(&sound));
        }
        assert_eq!(sound.retaken(), Retaken::default());

        let mut rash = block(Vec::new());
        // The eigenvalue in use is up to 5 % above the true one, the step 2.5 % below the largest stable one.
        rash.bodies[0].step_factor = 1.05;
        rash.estimate_eigenvalues(PRODUCTS).unwrap();
        while rash.time() < until {
            rash.step().unwrap();
            assert!(scale(&rash).is_finite());
        }
        assert!(rash.retaken().stretches > 0, "nothing was seen");
        assert!(scale(&rash) < 2.0 * most, "{} J of {most} J", scale(&rash));
    }

    /// The same while a blade is captured every few steps, each of which changes the model: a watch over whole windows
    /// alone saw nothing of a run that blew up.
    #[test]
    fn a_blade_does_not_blind_the_watch() {
        let mut stroke = stroke([(0.0, -0.04), (0.4, 0.04)]);
        stroke.capture = Capture::Distance(1e-4);
        let mut rash = block(vec![stroke]);
        rash.bodies[0].step_factor = 1.02;
        rash.estimate_eigenvalues(PRODUCTS).unwrap();
        let mut most = 0.0_f64;
        while rash.time() < 0.35 {
            rash.step().unwrap();
            most = most.max(scale(&rash));
        }
        let updates = updates(&rash);
        assert!(updates > 20, "{updates} updates");
        assert!(rash.retaken().stretches > 0, "nothing was seen");
        // The block at rest holds 0.2 J.
        assert!(most < 0.5, "{most} J");
    }

    /// A stiffness beyond all measure ends the run with an error, damping or not.
    #[test]
    fn a_step_that_vanishes_is_an_error() {
        for ratio in [0.0, 0.02] {
            let mut scene = embedded("press", &[]).expect("it is there");
            scene.bodies[0].sampling.target = Target::Nodes(300);
            scene.bodies[0].damping_ratio = ratio;
            let mut world = World::new(scene).unwrap();
            world.step().unwrap();
            let rash = |world: &mut World| {
                world.bodies[0].stiffness.estimates = [1e40; 2];
                world.estimate_eigenvalues(ESTIMATE_PRODUCTS).unwrap();
            };
            // From a valid state it is retried.
            rash(&mut world);
            world.step().unwrap();
            assert_eq!(world.retaken().stretches, 1);
            rash(&mut world);
            world.now.kept = None;
            let error = world.step().unwrap_err().to_string();
            assert!(error.contains("stable step has fallen"), "{error}");
        }
        let mut scene = embedded("minimal", &[]).expect("it is there");
        scene.bodies[0].material.youngs_modulus = 1e100;
        let error = World::new(scene).unwrap_err().to_string();
        assert!(error.contains("would take"), "{error}");
    }
}
