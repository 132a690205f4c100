//! Edges of blades, captured as the clock passes them: when, in which bodies, all or none.

use std::time::Instant;

use crate::scene;
use glam::DVec3;

use crate::cut_state::Cutting;
use crate::cutting::{Capture, CutUpdate};
use crate::error::{WorldError, in_body};
use crate::input::StrokePhase;
use crate::phases::Phase;
use crate::{Body, CutPiece, World};

/// Steps between two looks at whether tissue tears. It runs by half a spacing a look. So a tear is no faster than some half of
/// shear waves in explicit steps, slower in longer ones and where fast tools divide steps. With 2, 5 and 10 a tear
/// (`benches -- griffith --quick`) ends at 0.86, 0.86 and 0.92 of the toughness.
const TEARING: u64 = 5;

impl World {
    /// Captures the edges of all blades that are due, each in all bodies or in none.
    pub(crate) fn capture_blades(&mut self, step: u64) -> Result<(), WorldError> {
        let time = self.scene_time();
        let mut first = true;
        while let Some((index, phase, edge)) = self.input.next_blade(&self.scene, step, time) {
            if std::mem::take(&mut first) {
                self.end_stretch()?;
            }
            self.capture(index, phase, &edge)?;
            self.input.end_blade(step, index, phase, edge);
        }
        Ok(())
    }

    /// Cuts every body between two steps by a blade of the program's own: its edge (m) lies here now, and what it
    /// swept since the call before is cut open. A stroke starts with [`StrokePhase::Start`], which cuts nothing,
    /// and ends with [`StrokePhase::End`]; a call every half node spacing follows a curved way. Whether a body
    /// changed. The scene needs no cut for it, and its paths continue. [`World::state`] holds the cut,
    /// [`World::record`] does not.
    ///
    /// # Errors
    /// [`WorldError`] for an edge of fewer than two points or with one that is not finite, and if it cannot be
    /// captured; the world is then as it was.
    ///
    /// # Examples
    /// ```
    /// use phyxel::glam::DVec3;
    /// use phyxel::scene::{Body, Scene, Shape, Target};
    /// use phyxel::{StrokePhase, World};
    ///
    /// let mut body = Body::new(Shape::Box { size: DVec3::new(0.03, 0.03, 0.06) });
    /// body.sampling.target = Target::Nodes(300);
    /// let mut world = World::new(Scene::new("block", vec![body]))?;
    /// let uncut = world.clone(); // to go back to
    /// let edge = |x: f64| [-0.02, 0.02].map(|y| DVec3::new(x, y, 0.001));
    /// world.cut(StrokePhase::Start, &edge(-0.02))?;
    /// for k in 1..8 {
    ///     world.cut(StrokePhase::Update, &edge(-0.02 + 0.005 * f64::from(k)))?;
    ///     world.step()?;
    /// }
    /// world.cut(StrokePhase::End, &edge(0.02))?;
    /// assert_eq!(world.bodies()[0].pieces().sizes.len(), 2);
    /// world = uncut;
    /// assert_eq!(world.bodies()[0].pieces().sizes.len(), 1);
    /// assert_eq!(world.positions(0).len(), world.bodies()[0].rest.len());
    /// # Ok::<(), phyxel::WorldError>(())
    /// ```
    pub fn cut(&mut self, phase: StrokePhase, edge: &[DVec3]) -> Result<bool, WorldError> {
        if edge.len() < 2 || !edge.iter().all(|point| point.is_finite()) {
            return Err(WorldError::BadEdge);
        }
        self.end_stretch()?;
        // One more than the scene has.
        self.capture(self.scene.cuts.len(), phase, edge)
    }

    /// Computes what a blade's edge does to each body that its cut is of, and applies it; whether one changed. If the first
    /// fails in one, all are as before.
    fn capture(
        &mut self,
        index: usize,
        phase: StrokePhase,
        edge: &[DVec3],
    ) -> Result<bool, WorldError> {
        let begun = Instant::now();
        // None for a blade of the program.
        let cut = self.scene.cuts.get(index);
        let of = cut.and_then(|cut| cut.body.as_ref());
        let weld_tolerance = cut.and_then(|cut| cut.weld_tolerance);
        let mut captures: Vec<Capture> = Vec::new();
        for (place, body) in self.bodies.iter_mut().enumerate() {
            if of.is_some_and(|name| *name != body.name) {
                continue;
            }
            let captured = body.with_cutting(|body, cutting| {
                cutting.sweep((body, place), (index, weld_tolerance), edge, phase)
            });
            match captured {
                Ok(capture) => captures.push(capture),
                Err(problem) => {
                    let error = problem.of(&body.name);
                    for capture in captures {
                        self.bodies[capture.edge.body].take_back(&capture);
                    }
                    return Err(error);
                }
            }
        }
        self.apply_all(captures, begun)
    }

    /// Lets cuts run ahead of their blades where tissue with a toughness tears.
    pub(crate) fn tear(&mut self, step: u64) -> Result<(), WorldError> {
        if !step.is_multiple_of(TEARING) {
            return Ok(());
        }
        for place in 0..self.bodies.len() {
            let body = &self.bodies[place];
            let (Some(toughness), Some(cutting)) = (body.toughness, &body.cutting) else {
                continue;
            };
            let cuts: Vec<usize> = cutting.strokes.iter().map(|stroke| stroke.cut).collect();
            for index in cuts {
                let (begun, body) = (Instant::now(), &self.bodies[place]);
                let tears = |cutting: &Cutting| cutting.tears(body, index, toughness);
                if !body.cutting.as_ref().is_some_and(tears) {
                    continue;
                }
                self.end_stretch()?;
                let cut = self.scene.cuts.get(index);
                let cut = (index, cut.and_then(|cut| cut.weld_tolerance));
                let body = &mut self.bodies[place];
                let torn =
                    body.with_cutting(|body, cutting| cutting.tear((body, place), cut, toughness));
                let torn = in_body(torn, &body.name)?;
                if let Some(capture) = torn {
                    self.apply_all(vec![capture], begun)?;
                }
            }
        }
        Ok(())
    }

    /// Applies captures, each of another body, that began at an instant; whether one changed a body.
    fn apply_all(&mut self, captures: Vec<Capture>, begun: Instant) -> Result<bool, WorldError> {
        let mut changed = false;
        for capture in captures {
            let edge = capture.edge.clone();
            let body = &mut self.bodies[edge.body];
            let update = in_body(body.apply(capture), &body.name)?;
            changed |= !update.touched.is_empty();
            self.take_note(edge.body, update)?;
            self.now.captured.push(edge);
        }
        self.phases.add(Phase::Cut, begun.elapsed());
        if changed {
            self.waiting.get_or_insert(begun);
            self.now.step = self.smallest_step_size();
            self.now.kept = None;
        }
        Ok(changed)
    }

    /// Lets contact between bodies follow a cut that a body has taken, and keeps its new pieces for drawing.
    pub(crate) fn take_note(&mut self, body: usize, update: CutUpdate) -> Result<(), WorldError> {
        if let Some(contact) = &mut self.deformable {
            let grown = contact.grow(&self.bodies, body, &update);
            in_body(grown, &self.bodies[body].name)?;
            // Its samples are others than a snapshot has.
            self.now.kept = None;
        }
        let triangles = update.triangles;
        if !triangles.is_empty() {
            self.new_pieces.push(CutPiece { body, triangles });
        }
        Ok(())
    }

    /// How many edges of all cuts the scene's paths capture.
    #[must_use]
    pub fn capture_count(&self) -> usize {
        self.input.capture_count()
    }
}

/// Smallest mean distance (m) of neighbouring nodes of the bodies that a cut is of.
pub(crate) fn finest_spacing(cut: &scene::Cut, bodies: &[Body]) -> f64 {
    let bodies = bodies.iter();
    let bodies = bodies.filter(|body| cut.body.as_ref().is_none_or(|name| *name == body.name));
    bodies.fold(f64::INFINITY, |least, body| least.min(body.spacing))
}
