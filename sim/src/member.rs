//! A body with what touches and cuts it.

use std::borrow::Cow;

use glam::DVec3;
use phyxel_enrich::{Pieces, connected_pieces};
use phyxel_integrate::{Grip, StiffnessTracker};
use phyxel_splat::{SurfelError, Tissue, triangle_near_box};
use serde::{Deserialize, Serialize};

use crate::body::Body;
use crate::cutting::{Capture, CapturedEdge, CutState, CutUpdate, Cutting};
use crate::error::{BodyProblem, WorldError, in_body};
use crate::input::StrokePhase;
use crate::scene::Scene;
use crate::tool::ToolContact;

/// A body with the blades that have touched it.
#[derive(Debug, Clone)]
pub struct Member {
    /// The body.
    pub body: Body,
    /// Present from the first capture of a blade.
    pub cutting: Option<Cutting>,
    /// Tools that may touch it.
    pub(crate) contacts: Vec<ToolContact>,
}

impl Member {
    /// A body that nothing has touched.
    pub(crate) fn new(
        scene: &Scene,
        description: &crate::scene::Body,
        body: Body,
    ) -> Result<Self, WorldError> {
        let contacts = contacts_of(scene, description, &body);
        Ok(Self {
            contacts: in_body(contacts, &description.name)?,
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
        let mut links = Cow::Borrowed(&body.stencils.weights[..]);
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

    /// Lets samples of its surface follow new triangles of its cut (m, at rest); the surfels that may be other than before.
    ///
    /// # Errors
    /// [`SurfelError`] if a triangle is not finite.
    pub fn cut_surface(
        &self,
        surface: &mut Tissue,
        triangles: &[[DVec3; 3]],
    ) -> Result<Vec<u32>, SurfelError> {
        let Some(cutting) = &self.cutting else {
            return Ok(Vec::new());
        };
        let (near, cuts) = (self.triangles_near(triangles), cutting.cuts());
        let inside = |point| self.body.solid.contains(point);
        let change = surface.cut(&near, &inside, &|a, b| cuts.crosses(a, b))?;
        Ok(change.surfels)
    }

    /// What lies in or near the body of such triangles: a blade reaches far out of it.
    fn triangles_near(&self, triangles: &[[DVec3; 3]]) -> Vec<[DVec3; 3]> {
        let body = &self.body;
        let bounds = body.solid.bounds();
        let near = triangles.iter().filter(|[a, b, c]| {
            let middle = (*a + *b + *c) / 3.0;
            let sizes = [a, b, c].map(|corner| corner.distance(middle));
            let size = sizes.into_iter().fold(0.0, f64::max);
            body.solid.signed_distance(middle) < size + 2.0 * body.spacing
        });
        near.flat_map(|triangle| triangle_near_box(*triangle, bounds.min, bounds.max))
            .collect()
    }

    /// Computes what a blade's edge (m) does to the body as it is, number `member` of the world: all of a capture that can
    /// fail. On an error the body is as before.
    pub(crate) fn capture(
        &mut self,
        member: usize,
        cut: (usize, Option<f64>),
        edge: &[DVec3],
        phase: StrokePhase,
    ) -> Result<Capture, BodyProblem> {
        let (body, cutting, _) = self.with_cutting()?;
        body.fetch_all();
        let captured = cutting.sweep((body, member), cut, edge, phase);
        if captured.is_err() {
            self.forget_untouched();
        }
        captured
    }

    /// Undoes [`Member::capture`].
    pub(crate) fn take_back(&mut self, capture: &Capture) {
        if let Some(cutting) = &mut self.cutting {
            cutting.take_back(capture);
        }
        self.forget_untouched();
    }

    /// A body that no capture has reached has no data of cuts.
    fn forget_untouched(&mut self) {
        self.cutting.take_if(|cutting| cutting.counts().0 == 0);
    }

    /// Applies a capture to the body and what touches it; also what it added to the cut. Only a bug makes it fail, see
    /// [`Cutting::follow`].
    pub(crate) fn apply(&mut self, capture: Capture) -> Result<CutUpdate, BodyProblem> {
        let (body, cutting, contacts) = self.with_cutting()?;
        // What viscosity lost in the last step is not the cut's.
        body.relax(0.0)?;
        let update = cutting.advance(body, capture);
        if !update.touched.is_empty() {
            cutting.apply(body, &update)?;
            body.cut_here(&update.touched);
            cutting.follow(body, &update)?;
            let factors = Some(cutting.factors());
            let torn = body.torn_count(factors);
            for contact in contacts {
                contact.tear(torn, || body.contact_surface(factors))?;
            }
        }
        Ok(update)
    }

    /// Does again what [`Member::capture`] and [`Member::apply`] did, but for what depends on the motion.
    pub(crate) fn replay(
        &mut self,
        kept: &CapturedEdge,
        weld_tolerance: Option<f64>,
    ) -> Result<CutUpdate, BodyProblem> {
        let (body, cutting, _) = self.with_cutting()?;
        let update = cutting.advance_again(body, weld_tolerance, kept)?;
        if !update.touched.is_empty() {
            cutting.apply(body, &update)?;
        }
        Ok(update)
    }

    /// Takes their strain from nodes that lost it in a cut for where they were then, which [`Member::replay`] does not know.
    pub(crate) fn weaken_again(&mut self, deficient: &[u32]) {
        let (Some(cutting), elastic) = (&self.cutting, &mut self.body.elastic) else {
            return;
        };
        let (known, count) = (elastic.deficient_nodes(), elastic.node_count());
        let is_missing =
            |node: &u32| (*node as usize) < count && known.binary_search(node).is_err();
        let missing: Vec<u32> = deficient.iter().copied().filter(is_missing).collect();
        let positions = self.body.motion.positions();
        elastic.weaken(&missing, positions, &|pair| cutting.factors().factor(pair));
    }

    /// What moves, to be kept.
    pub(crate) fn state(&self) -> BodyState {
        let Self {
            body,
            cutting,
            contacts,
        } = self;
        BodyState {
            fingerprint: body.fingerprint,
            motion: body.motion.state().clone(),
            stiffness: body.stiffness.clone(),
            eigenvector: body.eigenvector.clone(),
            smallest_ratio: body.smallest_ratio,
            doubt: body.doubt,
            cut: cutting.as_ref().map(Cutting::state).unwrap_or_default(),
            elastic: body.elastic.state(),
            relaxed: body.relaxed,
            contacts: contacts.clone(),
            grip: body.grip.clone(),
        }
    }

    /// Restores a snapshot of the same body with the same cuts.
    pub(crate) fn set_state(&mut self, state: BodyState) {
        let body = &mut self.body;
        body.elastic.set_state(&state.elastic);
        body.relaxed = state.relaxed;
        body.smallest_ratio = state.smallest_ratio;
        body.doubt = state.doubt;
        body.grip = state.grip;
        body.restore(state.motion, state.stiffness, state.eigenvector);
        self.contacts = state.contacts;
        if let Some(cutting) = &mut self.cutting {
            cutting.set_state(state.cut);
        }
    }

    fn with_cutting(
        &mut self,
    ) -> Result<(&mut Body, &mut Cutting, &mut [ToolContact]), BodyProblem> {
        let fresh = match self.cutting.take() {
            Some(cutting) => cutting,
            None => Cutting::new(&self.body)?,
        };
        let cutting = self.cutting.insert(fresh);
        Ok((&mut self.body, cutting, &mut self.contacts))
    }
}

/// What moves in a body, and what watches over it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct BodyState {
    /// Checksum of the rest positions: a mesh file may have changed since.
    pub(crate) fingerprint: u32,
    pub(crate) motion: phyxel_integrate::State,
    pub(crate) stiffness: StiffnessTracker,
    pub(crate) eigenvector: Vec<DVec3>,
    pub(crate) smallest_ratio: f64,
    pub(crate) doubt: Option<phyxel_integrate::Warning>,
    pub(crate) cut: CutState,
    /// What decays in the model, and its control.
    pub(crate) elastic: phyxel_elastic::State,
    /// Energy (J) that viscosity has lost.
    pub(crate) relaxed: f64,
    pub(crate) contacts: Vec<ToolContact>,
    pub(crate) grip: Option<Grip>,
}

impl BodyState {
    /// Whether this can be a state of a body with the cuts that it has now: lists of its lengths, indices
    /// within it, finite numbers.
    pub(crate) fn fits(&self, member: &Member) -> bool {
        let body = &member.body;
        let n = body.rest.len();
        let mut numbers = self.stiffness.indicators.iter().chain([&self.relaxed]);
        let mut estimates = self.stiffness.estimates.iter();
        body.motion.fits(&self.motion)
            && estimates.all(|value| value.is_finite() && *value >= 0.0)
            && (self.eigenvector.is_empty() || self.eigenvector.len() == n)
            && self.eigenvector.iter().all(|x| x.is_finite())
            && !self.smallest_ratio.is_nan()
            && numbers.all(|x| x.is_finite())
            && self.cut.is_finite()
            && self.elastic.fits(&body.elastic)
            && self.contacts.len() == member.contacts.len()
            && (self.contacts.iter().zip(&member.contacts))
                .all(|(kept, built)| kept.is_sound(n, built))
            && self.grip.as_ref().is_none_or(|grip| grip.is_sound(n))
    }
}

/// The contacts of all tools that may touch a body.
fn contacts_of(
    scene: &Scene,
    description: &crate::scene::Body,
    body: &Body,
) -> Result<Vec<ToolContact>, BodyProblem> {
    let tools = scene.tools.iter().enumerate();
    tools
        .filter(|(_, tool)| tool.body.as_ref().is_none_or(|name| *name == body.name))
        .map(|(index, tool)| {
            let stiffness = (description.material.youngs_modulus, body.spacing);
            let surface = body.contact_surface(None)?;
            Ok(ToolContact::new(index, tool, surface, stiffness))
        })
        .collect()
}
