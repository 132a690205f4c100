//! A body's outside with its cuts: pieces, the surface that tools touch, and samples of it that are drawn or touch other
//! bodies.

use std::borrow::Cow;

use glam::DVec3;
use phyxel_enrich::{Pieces, connected_pieces};
use phyxel_integrate::ContactSurface;
use phyxel_splat::{SurfelError, Tissue, triangles_near};

use crate::body::Body;
use crate::cutting::graph_of;
use crate::error::BodyProblem;
use crate::scene::{self, Scene};
use crate::tool::{ToolContact, ToolSurface};

/// Contact points along a side of a surface triangle: enough for contacts of two spacings.
const DIVISIONS: u32 = 4;

impl Body {
    /// Pieces of the body as cuts left it, what lies within a support among them.
    #[must_use]
    pub fn pieces(&self) -> Pieces {
        let graph = &self.neighborhoods;
        let (offsets, indices) = (graph.offsets(), graph.indices());
        let mut links = Cow::Borrowed(&self.stencils.weights[..]);
        for &node in &self.inert {
            for pair in graph.pairs(node as usize) {
                let links = links.to_mut();
                links[pair] = self.factor(pair);
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
        let (solid, cuts) = (&self.solid, &cutting.cuts);
        let (bounds, distance) = (solid.bounds(), |point| solid.signed_distance(point));
        let bounds = [bounds.min, bounds.max];
        let near = triangles_near(triangles, bounds, 2.0 * self.spacing, distance);
        let inside = |point| solid.contains(point);
        let change = surface.cut(&near, &inside, &|a, b| cuts.crosses(a, b))?;
        Ok(change.surfels)
    }

    /// The contacts of all tools that may touch it, before it was cut.
    pub(crate) fn contacts_of(
        &self,
        scene: &Scene,
        description: &scene::Body,
    ) -> Result<Vec<ToolContact>, BodyProblem> {
        let (modulus, spacing) = (description.material.youngs_modulus, self.spacing);
        let tools = scene.tools.iter().enumerate();
        let ours = |tool: &scene::Tool| tool.body.as_ref().is_none_or(|name| *name == self.name);
        tools
            .filter(|(_, tool)| ours(tool))
            .map(|(index, tool)| {
                Ok(ToolContact {
                    tool: index,
                    rigid: tool.standing(self.contact_surface()?, modulus, spacing),
                    torn: 0,
                })
            })
            .collect()
    }

    /// Gives tools way where cuts have torn the surface since: the area of torn triangles goes to their corners, so that
    /// nothing spans the gap.
    pub(crate) fn tear_contacts(&mut self) -> Result<(), BodyProblem> {
        let torn = {
            let holds = self.holding();
            let torn = |&&[a, b, c]: &&[u32; 3]| !(holds(a, b) && holds(b, c) && holds(c, a));
            self.tool_surface.triangles().iter().filter(torn).count()
        };
        if self.contacts.iter().any(|contact| contact.torn != torn) {
            let surfaces = std::iter::repeat_n(self.contact_surface()?, self.contacts.len());
            for (contact, surface) in self.contacts.iter_mut().zip(surfaces) {
                contact.rigid.set_surface(surface);
                contact.torn = torn;
            }
        }
        Ok(())
    }

    /// Contact points on its outside: a triangle is torn if two of its corners no longer hold together.
    fn contact_surface(&self) -> Result<ContactSurface, BodyProblem> {
        let rest = &self.rest;
        Ok(match &self.tool_surface {
            // No node's area spans a gap.
            ToolSurface::Nodes(nodes, areas) => {
                ContactSurface::from_nodes(nodes, areas, rest.len())?
            }
            ToolSurface::Triangles(outside, bulges) => {
                let outside = (&outside[..], &bulges[..]);
                ContactSurface::from_torn_triangles(outside, rest, DIVISIONS, self.holding())?
            }
        })
    }

    /// Whether no cut has severed two nodes that were neighbours.
    fn holding(&self) -> impl Fn(u32, u32) -> bool {
        let cutting = self.cutting.as_ref();
        let weakened = cutting.map(|cutting| cutting.factors.weakened_nodes(&graph_of(self)));
        move |a, b| {
            let both = |of: &Vec<bool>| of[a as usize] && of[b as usize];
            let pair = || self.neighborhoods.find_pair(a as usize, b);
            !weakened.as_ref().is_some_and(both)
                || pair().is_none_or(|pair| self.factor(pair) > 0.0)
        }
    }
}
