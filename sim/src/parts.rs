//! What each part of the model costs.

use std::mem::size_of_val;

use crate::phases::Phase;
use crate::tool::ToolContact;
use crate::{Member, World};

/// A part of the model of one body.
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

impl Member {
    /// Every part that a body's model can have, in the order of a step, those that are off included.
    #[must_use]
    pub fn parts(&self) -> Vec<PartCost> {
        let body = &self.body;
        let (moving, elastic) = (body.motion.bytes(), body.elastic.bytes());
        let positions = size_of_val(&*body.rest) + size_of_val(&*body.tetrahedra);
        let graph = &body.neighborhoods;
        let others = elastic.held + elastic.cuts + elastic.watch + elastic.viscosity;
        let cutting = self.cutting.as_ref().map_or(0, crate::Cutting::bytes);
        let nodes = positions + size_of_val(&*body.volumes) + size_of_val(&*body.masses);
        let edges = size_of_val(graph.offsets()) + size_of_val(graph.indices());
        let motion = moving.state + size_of_val(&*body.eigenvector) + elastic.watch;
        let tools: usize = self.contacts.iter().map(ToolContact::bytes).sum();
        let contact = tools + size_of_val(&*body.surface_triangles) + moving.applied;
        let part = |name, bytes, phase| PartCost { name, bytes, phase };
        vec![
            part("nodes", nodes, None),
            part("neighbours", edges, None),
            part("stencils", body.stencils.bytes(), None),
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
        let mut members = self.members.iter().map(Member::parts);
        let mut all = members.next().unwrap_or_default();
        for parts in members {
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
