//! What each part of the model costs.

use std::mem::size_of_val;

use phyxel_elastic::Elastic;
use phyxel_integrate::Motion;

use crate::phases::Phase;
use crate::{Body, World};

/// A part of the model of one self.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct PartCost {
    /// Name in reports.
    pub name: &'static str,
    /// Heap bytes; 0 where the scene does not need it.
    pub bytes: usize,
    /// The phase whose time is this part's alone; `None` if it shares its phase with others.
    pub phase: Option<Phase>,
}

impl Body {
    /// Every part that a body's model can have, in the order of a step, those that are off included.
    #[must_use]
    pub fn parts(&self) -> Vec<PartCost> {
        let moving = self.whole.of_motion(Motion::bytes);
        let elastic = self.whole.of_model(Elastic::bytes);
        let positions = size_of_val(&*self.rest) + size_of_val(&*self.tetrahedra);
        let graph = &self.neighborhoods;
        let others = elastic.held + elastic.cuts + elastic.watch + elastic.viscosity;
        let cutting = self.cutting.as_ref().map_or(0, crate::Cutting::bytes);
        let nodes = positions + size_of_val(&*self.volumes) + size_of_val(&*self.masses);
        let edges = size_of_val(graph.offsets()) + size_of_val(graph.indices());
        let motion = moving.state + size_of_val(self.whole.eigenvector()) + elastic.watch;
        let tools = self.contacts.iter().map(|tool| tool.rigid.contact.bytes());
        let contact = tools.sum::<usize>() + self.tool_surface.bytes() + moving.applied;
        let part = |name, bytes, phase| PartCost { name, bytes, phase };
        vec![
            part("nodes", nodes, None),
            part("neighbours", edges, None),
            part("stencils", self.stencils.bytes(), None),
            part("elasticity", elastic.all - others, Some(Phase::Forces)),
            part("viscosity", elastic.viscosity, None),
            part("motion", motion, Some(Phase::Integration)),
            part("supports", moving.supports + elastic.held, None),
            part("gravity", moving.loads, None),
            part("viscous damping", moving.viscous, None),
            part("contact", contact, Some(Phase::Contact)),
            part("cuts", cutting + elastic.cuts, Some(Phase::Cut)),
        ]
    }
}

impl World {
    /// Parts of all bodies together.
    #[must_use]
    pub fn parts(&self) -> Vec<PartCost> {
        let mut bodies = self.bodies.iter().map(Body::parts);
        let mut all = bodies.next().unwrap_or_default();
        for parts in bodies {
            for (sum, part) in all.iter_mut().zip(parts) {
                sum.bytes += part.bytes;
            }
        }
        let contact = self.deformable.as_ref().map_or(0, |all| all.bytes());
        let own = all.iter_mut().find(|part| part.name == "contact");
        own.into_iter().for_each(|part| part.bytes += contact);
        all
    }
}
