//! A body with what touches and cuts it.

use std::borrow::Cow;
use std::time::Duration;

use glam::DVec3;
use phyxel_enrich::{Pieces, Sweep, connected_pieces};
use phyxel_splat::{SurfelError, Tissue, triangle_near_box};

use crate::body::Body;
use crate::cutting::{CapturedEdge, CutUpdate, Cutting, Swept};
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

/// What a blade's edge does to a body, computed but not applied.
#[derive(Debug)]
pub(crate) struct Capture {
    swept: Swept,
    before: Before,
}

/// What computing a capture changed, as it was.
#[derive(Debug)]
struct Before {
    /// Whether no blade had touched the body.
    untouched: bool,
    /// What moves, and the energy (J) that viscosity had lost; `None` without viscosity.
    relaxed: Option<(phyxel_integrate::State, f64)>,
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
            let size = a
                .distance(middle)
                .max(b.distance(middle))
                .max(c.distance(middle));
            body.solid.signed_distance(middle) < size + 2.0 * body.spacing
        });
        near.flat_map(|triangle| triangle_near_box(*triangle, bounds.min, bounds.max))
            .collect()
    }

    /// Heap bytes of the contacts of tools.
    pub(crate) fn contact_bytes(&self) -> usize {
        let points: usize = self.contacts.iter().map(ToolContact::bytes).sum();
        points + size_of_val(&*self.body.surface_triangles)
    }

    /// Computes what a blade's edge (m) does to the body as it is: all of a capture that can fail. On an error the
    /// body is as before.
    pub(crate) fn capture(
        &mut self,
        cut: (usize, Option<f64>),
        edge: &[DVec3],
        phase: StrokePhase,
    ) -> Result<Capture, BodyProblem> {
        let body = &self.body;
        let is_viscous = body.elastic.is_viscous();
        let before = Before {
            untouched: self.cutting.is_none(),
            relaxed: is_viscous.then(|| (body.motion.state().clone(), body.relaxed)),
        };
        match self.sweep(cut, edge, phase) {
            Ok(swept) => Ok(Capture { swept, before }),
            Err(problem) => {
                self.go_back(before);
                Err(problem)
            }
        }
    }

    fn sweep(
        &mut self,
        cut: (usize, Option<f64>),
        edge: &[DVec3],
        phase: StrokePhase,
    ) -> Result<Swept, BodyProblem> {
        let (body, cutting, _) = self.with_cutting()?;
        body.fetch_all();
        // What viscosity lost in the last step is not the cut's.
        body.relax(0.0, &mut Duration::default())?;
        cutting.sweep(body, cut, edge, phase)
    }

    /// Undoes [`Member::capture`].
    pub(crate) fn take_back(&mut self, capture: Capture) {
        if let Some(cutting) = &mut self.cutting {
            cutting.take_back(&capture.swept);
        }
        self.go_back(capture.before);
    }

    fn go_back(&mut self, before: Before) {
        if before.untouched {
            self.cutting = None;
        }
        if let Some((state, relaxed)) = before.relaxed {
            self.body.motion.restore(state);
            self.body.relaxed = relaxed;
        }
    }

    /// Applies a capture to the body and what touches it; also what it added to the cut. Only a bug makes it fail, see
    /// [`Cutting::follow`].
    pub(crate) fn apply(
        &mut self,
        index: usize,
        capture: Capture,
        phase: StrokePhase,
    ) -> Result<(CutUpdate, Sweep), BodyProblem> {
        let (body, cutting, contacts) = self.with_cutting()?;
        let (update, sweep) = cutting.advance(body, index, capture.swept, phase);
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
        Ok((update, sweep))
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
