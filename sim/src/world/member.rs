//! A body with what touches and cuts it.

use std::borrow::Cow;
use std::time::Duration;

use glam::DVec3;
use phyxel_enrich::{Pieces, Sweep, connected_pieces};

use super::body::Body;
use super::cutting::{CapturedEdge, CutUpdate, Cutting};
use super::error::{BodyProblem, WorldError};
use super::input::StrokePhase;
use super::tool::Touch;
use crate::scene::Scene;

/// A body with the blades that have touched it.
#[derive(Debug, Clone)]
pub struct Member {
    /// The body.
    pub body: Body,
    /// Present from the first capture of a blade.
    pub cutting: Option<Cutting>,
    /// Tools that may touch it.
    pub(super) touches: Vec<Touch>,
}

impl Member {
    /// A body that nothing has touched.
    pub(super) fn new(
        scene: &Scene,
        description: &crate::scene::Body,
        body: Body,
    ) -> Result<Self, WorldError> {
        let touches = touches_of(scene, description, &body);
        Ok(Self {
            touches: touches.map_err(|problem| problem.named(&description.name))?,
            body,
            cutting: None,
        })
    }

    /// Pieces of the body as cuts left it, what lies within a support among them.
    #[must_use]
    pub fn pieces(&self) -> Pieces {
        let Self { body, cutting, .. } = self;
        let graph = &body.neighborhoods;
        let (offsets, indices) = (graph.offsets(), graph.indices());
        let mut links = Cow::Borrowed(body.stencils.weights());
        let factor = |pair| cutting.as_ref().map_or(1.0, |c| c.factors().factor(pair));
        for &node in &body.inert {
            for pair in graph.pairs(node as usize) {
                let links = links.to_mut();
                links[pair] = factor(pair);
                if let Some(back) = graph.find_pair(indices[pair] as usize, node) {
                    links[back] = links[pair];
                }
            }
        }
        connected_pieces(offsets, indices, &links)
    }

    /// Heap bytes of the contacts of tools.
    pub(super) fn contact_bytes(&self) -> usize {
        let points: usize = self.touches.iter().map(Touch::bytes).sum();
        points + size_of_val(&*self.body.outside)
    }

    /// Captures a blade's edge (m): what it does is computed from the body as it is, and then applied to the body
    /// and what touches it; also what it added to the cut.
    pub(super) fn capture(
        &mut self,
        index: usize,
        cut: &crate::scene::Cut,
        edge: &[DVec3],
        phase: StrokePhase,
    ) -> Result<(CutUpdate, Sweep), BodyProblem> {
        let (body, cutting, touches) = self.with_cutting()?;
        body.fetch_all();
        // What viscosity has taken up since the last step is not the cut's.
        body.relax(0.0, &mut Duration::default())?;
        let (update, sweep) = cutting.advance(body, (index, cut.weld_tolerance), edge, phase)?;
        if !update.touched.is_empty() {
            cutting.apply(body, &update)?;
            body.cut_here(&update.touched);
            cutting.follow(body, &update)?;
            let factors = Some(cutting.factors());
            let torn = body.torn_count(factors);
            for touch in touches {
                touch.led.tear(torn, || body.contact_surface(factors))?;
            }
        }
        Ok((update, sweep))
    }

    /// Does again what [`Member::capture`] did, but for what depends on the motion.
    pub(super) fn replay(
        &mut self,
        kept: &CapturedEdge,
        cut: &crate::scene::Cut,
    ) -> Result<CutUpdate, BodyProblem> {
        let (body, cutting, _) = self.with_cutting()?;
        let update = cutting.advance_again(body, cut.weld_tolerance, kept)?;
        if !update.touched.is_empty() {
            cutting.apply(body, &update)?;
        }
        Ok(update)
    }

    fn with_cutting(&mut self) -> Result<(&mut Body, &mut Cutting, &mut [Touch]), BodyProblem> {
        let fresh = match self.cutting.take() {
            Some(cutting) => cutting,
            None => Cutting::new(&self.body)?,
        };
        let cutting = self.cutting.insert(fresh);
        Ok((&mut self.body, cutting, &mut self.touches))
    }
}

/// The contacts of all tools that may touch a body.
fn touches_of(
    scene: &Scene,
    description: &crate::scene::Body,
    body: &Body,
) -> Result<Vec<Touch>, BodyProblem> {
    let tools = scene.tools.iter().enumerate();
    tools
        .filter(|(_, tool)| tool.body.as_ref().is_none_or(|name| *name == body.name))
        .map(|(index, tool)| {
            let pose = tool.pose_at(0.0);
            let modulus = description.material.youngs_modulus;
            let surface = body.contact_surface(None)?;
            Ok(Touch::new(
                index,
                tool,
                &pose,
                surface,
                (modulus, body.spacing),
            ))
        })
        .collect()
}
